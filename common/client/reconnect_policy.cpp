#include "common/client/reconnect_policy.h"

#include <algorithm>
#include <utility>

#include "common/base/hash.h"
#include "common/base/units.h"
#include "common/wire/close_code.h"

namespace strandcast {
namespace {

ErrorCode code_for(uint16_t close_code) {
  switch (static_cast<CloseCode>(close_code)) {
    case CloseCode::Unauthorized:
    case CloseCode::Kicked:
      return ErrorCode::Unauthorized;
    case CloseCode::Refused:
      return ErrorCode::Unsupported;
    case CloseCode::Full:
      return ErrorCode::LimitExceeded;
    case CloseCode::NotFound:
      return ErrorCode::NotFound;
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

bool is_final(const Error& error, Standing standing) {
  switch (error.code) {
    case ErrorCode::Unauthorized:
    case ErrorCode::Unsupported:
      return true;
    case ErrorCode::NotFound:
      return standing == Standing::Newcomer;
    case ErrorCode::BadInput:
    case ErrorCode::LimitExceeded:
    case ErrorCode::Unavailable:
    case ErrorCode::Timeout:
    case ErrorCode::Internal:
      return false;
  }
  return false;
}

bool is_silent(int64_t heard_ns, int64_t time_ns) {
  return time_ns - heard_ns >= std::chrono::nanoseconds(kSilentServer).count();
}

bool is_doubted(int64_t heard_ns, int64_t time_ns) {
  return time_ns - heard_ns >= std::chrono::nanoseconds(kDoubtedServer).count();
}

void hear(Heard& heard, double away_s, int64_t time_ns) {
  constexpr double kMostS = 1e9;  // as nanoseconds still a number
  heard.away_since_ns = away_s > 0.0 ? time_ns - static_cast<int64_t>(std::min(away_s, kMostS) * kNsPerS) : 0;
}

int64_t silent_since_ns(const Heard& heard, int64_t time_ns) {
  if (heard.away_since_ns != 0) return heard.away_since_ns;
  return is_silent(heard.last_ns, time_ns) ? heard.last_ns : 0;
}

std::string silence_text(const std::string& server, const Heard& heard, int64_t time_ns) {
  const int64_t since_ns = silent_since_ns(heard, time_ns);
  const bool is_away = !is_silent(heard.last_ns, time_ns) && since_ns != 0;
  return fmt::format("{}: not connected: nothing has come{} for {:.0f} s", server,
                     is_away ? " to this relay from its server" : "",
                     static_cast<double>(since_ns == 0 ? 0 : time_ns - since_ns) / kNsPerS);
}

void ReconnectPolicy::on_welcome(int64_t time_ns) {
  if (lost_ns_ != 0) outage_ns_ += time_ns - std::exchange(lost_ns_, 0);
  if (welcomes_++ == 0) first_ns_ = time_ns;
  welcome_ns_ = time_ns;
  attempts_ = 0;
}

std::optional<std::chrono::milliseconds> ReconnectPolicy::on_lost(const Error& error, int64_t time_ns,
                                                                  int64_t heard_ns) {
  if (welcome_ns_ != 0) {
    lost_ns_ = heard_ns == 0 ? time_ns : std::clamp(heard_ns, welcome_ns_, time_ns);
    if (silent_ns_ != 0) lost_ns_ = std::min(lost_ns_, std::exchange(silent_ns_, 0));
    const int64_t lived_ns = time_ns - std::exchange(welcome_ns_, 0);
    if (lived_ns >= std::chrono::nanoseconds(kStableConnection).count()) doublings_ = 0;
  }
  return on_failed(error);
}

void ReconnectPolicy::on_heard(const Heard& heard, int64_t time_ns) {
  if (welcome_ns_ == 0) return;
  const int64_t since_ns = silent_since_ns(heard, time_ns);
  if (since_ns != 0) {
    // A server that was away before this connection is nothing that it has lost.
    if (silent_ns_ == 0) silent_ns_ = std::clamp(since_ns, welcome_ns_, time_ns);
  } else if (silent_ns_ != 0) {
    outage_ns_ += time_ns - std::exchange(silent_ns_, 0);
  }
}

std::optional<std::chrono::milliseconds> ReconnectPolicy::on_failed(const Error& error) {
  if (is_final(error, standing())) return std::nullopt;
  constexpr uint32_t kMaxDoublings = 16;
  const double doubled = static_cast<double>(kFirstReconnectDelay.count()) *
                         static_cast<double>(1u << std::min(doublings_, kMaxDoublings));
  const auto longest = doublings_ < kUrgentAttempts ? std::min(longest_, kLongestUrgentDelay) : longest_;
  ++doublings_;
  ++attempts_;
  random_ = mix_u32(random_ + doublings_);
  const double jitter = 1.0 + kReconnectJitter * (2.0 * static_cast<double>(unit_float(random_)) - 1.0);
  const double delay_ms = std::min(doubled, static_cast<double>(longest.count())) * jitter;
  return std::chrono::milliseconds(static_cast<int64_t>(delay_ms));
}

double ReconnectPolicy::outage_s(int64_t time_ns) const {
  return static_cast<double>(outage_ns_) / kNsPerS + running_outage_s(time_ns);
}

double ReconnectPolicy::running_outage_s(int64_t time_ns) const {
  const int64_t begin_ns = lost_ns_ != 0 ? lost_ns_ : silent_ns_;
  return begin_ns != 0 ? static_cast<double>(std::max<int64_t>(time_ns - begin_ns, 0)) / kNsPerS : 0.0;
}

double ReconnectPolicy::since_first_s(int64_t time_ns) const {
  return welcomes_ > 0 ? static_cast<double>(time_ns - first_ns_) / kNsPerS : 0.0;
}

}  // namespace strandcast
