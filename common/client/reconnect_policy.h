// ReconnectPolicy: when to try a lost server again, and when trying again cannot help. Pure logic, no clock,
// no I/O.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace strandcast {

/// Turns a server's farewell, close code and Goodbye sentence, into an error whose code says whether another
/// attempt makes sense: Unauthorized (token), LimitExceeded (server full) and BadInput (it understood us
/// wrongly, or we it) will not go away by themselves, Unavailable and Timeout may. Close code 0: the
/// connection broke without one.
Error error_from_close(uint16_t close_code, const std::string& reason);

/// How its sentence begins: the server said this, and it is no trouble of our own with what it sent.
inline constexpr std::string_view kClosedByServer = "the server closed the connection: ";

class ReconnectPolicy {
 public:
  /// `seed` spreads the attempts of many viewers that lost the same server at the same moment.
  explicit ReconnectPolicy(uint32_t seed) : random_(seed) {}

  /// Delay before the next attempt, or nothing when the reason will not go away by itself. `connected_for` is
  /// how long the connection had lived: a short-lived one does not reset the growing delay.
  std::optional<std::chrono::milliseconds> next_delay(const Error& error,
                                                      std::chrono::milliseconds connected_for);

  uint32_t attempts() const { return attempts_; }

 private:
  uint32_t random_;
  uint32_t attempts_ = 0;
};

inline constexpr std::chrono::milliseconds kFirstReconnectDelay{250};
inline constexpr std::chrono::milliseconds kLongestReconnectDelay{5000};
inline constexpr std::chrono::milliseconds kStableConnection{
    10'000};                                      // lived this long: start from the first delay
inline constexpr double kReconnectJitter = 0.25;  // relative, +-

}  // namespace strandcast
