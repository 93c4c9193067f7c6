// The largest single allocation since a test last asked: how tests see that no unchecked number sizes one.
// Linking largest_allocation.cpp replaces the program's operator new.
#pragma once

#include <cstddef>

namespace strandcast::test {

/// Starts again from 0.
void reset_largest_allocation();
/// Bytes of the largest allocation since then, any thread.
size_t largest_allocation_bytes();

}  // namespace strandcast::test
