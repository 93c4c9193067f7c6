// CRC-32 as zlib, PNG and MCAP have it (polynomial 0xEDB88320). Pure functions, any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace strandcast {

/// Of `bytes`, or of all that was before and `bytes`, where `before` is what it gave for that.
uint32_t crc32(std::span<const std::byte> bytes, uint32_t before = 0);

}  // namespace strandcast
