// Arithmetic of 32-bit integers that wraps around instead of overflowing. Header only, any thread.
#pragma once

#include <cstdint>

namespace strandcast {

inline int32_t wrapping_sum(int32_t a, int32_t b) {
  return static_cast<int32_t>(static_cast<uint32_t>(a) + static_cast<uint32_t>(b));
}
inline int32_t wrapping_difference(int32_t a, int32_t b) {
  return static_cast<int32_t>(static_cast<uint32_t>(a) - static_cast<uint32_t>(b));
}

}  // namespace strandcast
