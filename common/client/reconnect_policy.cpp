#include "common/client/reconnect_policy.h"

#include <algorithm>

#include "common/base/hash.h"
#include "common/wire/close_code.h"

namespace strandcast {
namespace {

ErrorCode code_for(uint16_t close_code) {
  switch (static_cast<CloseCode>(close_code)) {
    case CloseCode::Unauthorized:
    case CloseCode::Kicked:
      return ErrorCode::Unauthorized;
    case CloseCode::Full:
      return ErrorCode::LimitExceeded;
    case CloseCode::BadData:
    case CloseCode::Policy:
    case CloseCode::TooBig:
      return ErrorCode::BadInput;
    case CloseCode::Normal:
    case CloseCode::GoingAway:
    case CloseCode::Internal:
    case CloseCode::TryLater:
      return ErrorCode::Unavailable;
  }
  constexpr uint16_t kProtocolError = 1002;  // RFC 6455, section 7.4.1
  constexpr uint16_t kUnsupportedData = 1003;
  return close_code == kProtocolError || close_code == kUnsupportedData ? ErrorCode::BadInput
                                                                        : ErrorCode::Unavailable;
}

}  // namespace

Error error_from_close(uint16_t close_code, const std::string& reason) {
  return make_error(code_for(close_code), "{}{}", kClosedByServer,
                    reason.empty() ? fmt::format("no reason given (code {})", close_code) : reason);
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
