// The built-in head of an asset by its form (common/strands/head/head_form.h): who reads it makes the mesh,
// and compares its hash. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/strands/asset/head.h"

namespace strandcast::asset {

/// Appends the form of a mesh that is as_sent(). Returns false, having appended nothing, where it has none or
/// is not what its form makes.
bool append_form(const Mesh& mesh, std::vector<std::byte>& destination);

/// Makes the mesh that append_form() was given, from untrusted bytes. BadInput where they are damaged;
/// Unavailable where this program makes another mesh: from then on makes_other_heads().
Status read_form(std::span<const std::byte> source, const HeadCounts& counts, Mesh& mesh);

/// Whether a form was read in this process whose mesh has another hash here.
bool makes_other_heads();

}  // namespace strandcast::asset
