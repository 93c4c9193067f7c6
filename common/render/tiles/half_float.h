// Conversion of IEEE half floats, as the tile renderer stores them.
#pragma once

#include <cstdint>
#include <cstring>

namespace strandcast {

/// Converts a half float; exact for every finite value.
inline float float_of_half(uint16_t half) {
  constexpr float kFloatScale = 5.19229686e33f;  // 2^112: the difference of the two biases
  const uint32_t bits = (static_cast<uint32_t>(half) & 0x7fffu) << 13;
  float size;
  std::memcpy(&size, &bits, sizeof size);
  size *= kFloatScale;
  return (half & 0x8000u) != 0 ? -size : size;
}

}  // namespace strandcast
