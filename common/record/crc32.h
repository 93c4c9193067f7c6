// CRC-32 of zlib, PNG and MCAP (polynomial 0xEDB88320). Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace strandcast {

/// Returns the CRC of `bytes`, continuing from `before`, the CRC of all preceding bytes.
uint32_t crc32(std::span<const std::byte> bytes, uint32_t before = 0);

}  // namespace strandcast
