// Base64 (RFC 4648). Pure functions, any thread.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace strandcast {

std::string base64_of(std::span<const std::byte> bytes);
/// Returns what base64_of() was given; nothing for any other text.
std::optional<std::vector<std::byte>> from_base64(std::string_view text);

}  // namespace strandcast
