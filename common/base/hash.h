// Integer hashes: hash_bytes for state hashes on the wire, mix_u32 for per-strand randomness.
// shaders/lib/hash.glsl implements mix_u32 too; a test compares the two.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace strandcast {

/// Computes 64-bit FNV-1a over 8-byte words (then the tail byte by byte); `seed` chains several buffers. Not
/// for security.
uint64_t hash_bytes(std::span<const std::byte> bytes, uint64_t seed = 0xcbf29ce484222325ull);

/// One round of hash_bytes(): mixes an 8-byte word into the hash.
constexpr uint64_t hash_word(uint64_t word, uint64_t hash) {
  hash = (hash ^ word) * 0x100000001b3ull;
  return hash ^ (hash >> 32);  // FNV over words alone leaves the low bits of high bytes unmixed
}

/// Mixes one integer into a 32-bit hash (the lowbias32 finaliser by Chris Wellons, public domain).
constexpr uint32_t mix_u32(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  x ^= x >> 16;
  return x;
}

/// Converts a hash to a uniform number in [0, 1), exact in float (24 bits).
constexpr float unit_float(uint32_t hash) {
  return static_cast<float>(hash >> 8) * (1.0f / 16777216.0f);
}

}  // namespace strandcast
