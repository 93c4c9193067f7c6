// Base64 (RFC 4648). Pure functions, any thread.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace strandcast {

std::string base64_of(std::span<const std::byte> bytes);

}  // namespace strandcast
