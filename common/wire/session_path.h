// Where a session lies behind a proxy that serves many: "/s/NAME" in front of every path. Pure functions on
// untrusted text, any thread.
#pragma once

#include <cstddef>
#include <string_view>

namespace strandcast {

inline constexpr std::string_view kSessionFolder = "/s/";
inline constexpr size_t kMaxSessionNameChars = 64;

/// Letters, digits, '.', '_' and '-', a letter or digit first.
bool is_session_name(std::string_view name);

/// The target of a request without the session's folder: "/v1" of "/s/anna/v1", "" of "/s/anna"; else as it
/// is.
std::string_view without_session(std::string_view target);

}  // namespace strandcast
