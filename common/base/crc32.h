// CRC-32 of zlib, ZIP, PNG and MCAP (polynomial 0xEDB88320). Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace strandcast {

/// Returns the CRC of `bytes`, continuing from `before`, the CRC of all preceding bytes.
uint32_t crc32(std::span<const std::byte> bytes, uint32_t before = 0);

/// Returns the CRC of two pieces, one behind the other, from the CRC of each and the bytes of the second one.
uint32_t joined_crc32(uint32_t first, uint32_t second, uint64_t second_bytes);

}  // namespace strandcast
