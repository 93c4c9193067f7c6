// URL prefix of a session at a proxy that serves several: "/s/NAME" before every path. Pure functions on
// untrusted text, any thread.
#pragma once

#include <cstddef>
#include <string_view>

namespace strandcast {

inline constexpr std::string_view kSessionFolder = "/s/";
inline constexpr size_t kMaxSessionNameChars = 64;

/// Returns true for letters, digits, '.', '_' and '-', beginning with a letter or digit.
bool is_session_name(std::string_view name);

/// Removes a session's prefix from a request target: "/s/anna/v1" gives "/v1", "/s/anna" gives "". Other
/// targets are returned unchanged.
std::string_view without_session(std::string_view target);

}  // namespace strandcast
