// Fine symbols: the integers of a fine anchor, which a joiner receives, strand by strand. Each is coded by
// the sizes of those beside it. Private to common/strands/tangent; one thread.
#pragma once

#include "common/strands/tangent/motion.h"
#include "common/strands/value_coder.h"

namespace strandcast::tangent {

/// Writes the integers and escapes of all slices.
void write_fine(const Layout& layout, const Codes& codes, ValueWriter& writer);
/// Inverse of write_fine() for untrusted bytes. Any bytes give some integers; escapes take bytes, so their
/// number is bounded.
void read_fine(const Layout& layout, ValueReader& reader, Codes& codes);

}  // namespace strandcast::tangent
