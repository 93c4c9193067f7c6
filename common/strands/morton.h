// Positions on a Morton curve through a cube of 1024 cells a side. Header only, any thread.
#pragma once

#include <cstdint>

namespace strandcast {

/// Spreads the low 10 bits of `cell` with two zero bits between them: one axis of a Morton code.
inline uint32_t morton_bits(uint32_t cell) {
  cell &= 0x3ff;
  cell = (cell | (cell << 16)) & 0x030000ff;
  cell = (cell | (cell << 8)) & 0x0300f00f;
  cell = (cell | (cell << 4)) & 0x030c30c3;
  return (cell | (cell << 2)) & 0x09249249;
}

}  // namespace strandcast
