#include "client/net/reconnect_policy.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "common/base/hash.h"

namespace strandcast {
namespace {

bool has_any(const std::string& text, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return text.find(word) != std::string::npos; });
}

}  // namespace

Error error_from_goodbye(const std::string& reason) {
  std::string lower = reason;
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char letter) { return static_cast<char>(std::tolower(letter)); });
  ErrorCode code = ErrorCode::Unavailable;
  if (has_any(lower, {"token", "role", "origin", "not allowed"})) code = ErrorCode::Unauthorized;
  if (has_any(lower, {"full", "too many"})) code = ErrorCode::LimitExceeded;
  if (has_any(lower, {"version", "protocol"})) code = ErrorCode::Unsupported;
  return make_error(code, "the server said goodbye: {}", reason.empty() ? "no reason given" : reason);
}

std::optional<std::chrono::milliseconds> ReconnectPolicy::next_delay(
    const Error& error, std::chrono::milliseconds connected_for) {
  const bool may_recover = error.code == ErrorCode::Unavailable || error.code == ErrorCode::Timeout;
  if (!may_recover) return std::nullopt;
  if (connected_for >= kStableConnection) attempts_ = 0;

  constexpr uint32_t kMaxDoublings = 16;
  const double doubled = static_cast<double>(kFirstReconnectDelay.count()) *
                         static_cast<double>(1u << std::min(attempts_, kMaxDoublings));
  ++attempts_;
  random_ = mix_u32(random_ + attempts_);
  const double jitter = 1.0 + kReconnectJitter * (2.0 * static_cast<double>(unit_float(random_)) - 1.0);
  const double delay_ms = std::min(doubled, static_cast<double>(kLongestReconnectDelay.count())) * jitter;
  return std::chrono::milliseconds(static_cast<int64_t>(delay_ms));
}

}  // namespace strandcast
