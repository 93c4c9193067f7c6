#include "common/replay/clock_offset.h"

#include <algorithm>

namespace strandcast {
namespace {

constexpr int64_t kMaxRoundTripNs = 10'000'000'000;

/// a - b; false when that does not fit.
bool subtract(int64_t a, int64_t b, int64_t& difference) {
  return !__builtin_sub_overflow(a, b, &difference);
}

/// Mean of two numbers whose sum may not fit.
int64_t mean(int64_t a, int64_t b) {
  return a / 2 + b / 2 + (a % 2 + b % 2) / 2;
}

}  // namespace

void ClockOffset::add(int64_t client_send_ns, int64_t server_receive_ns, int64_t server_send_ns,
                      int64_t client_receive_ns) {
  const auto is_possible = [](int64_t time_ns) { return time_ns >= -kMaxClockNs && time_ns <= kMaxClockNs; };
  if (!is_possible(server_receive_ns) || !is_possible(server_send_ns)) return;
  int64_t elapsed_ns = 0, held_ns = 0, there_ns = 0, back_ns = 0;
  if (!subtract(client_receive_ns, client_send_ns, elapsed_ns) || elapsed_ns < 0) return;
  if (!subtract(server_send_ns, server_receive_ns, held_ns) || held_ns < 0 || held_ns > elapsed_ns) return;
  if (!subtract(server_receive_ns, client_send_ns, there_ns)) return;
  if (!subtract(server_send_ns, client_receive_ns, back_ns)) return;
  const int64_t round_trip_ns = elapsed_ns - held_ns;
  if (round_trip_ns > kMaxRoundTripNs) return;
  probes_.push_back({mean(there_ns, back_ns), round_trip_ns});
  if (probes_.size() > kClockWindow) probes_.pop_front();
}

int64_t ClockOffset::offset_ns() const {
  if (probes_.empty()) return 0;
  return std::min_element(probes_.begin(), probes_.end(),
                          [](const Probe& a, const Probe& b) { return a.round_trip_ns < b.round_trip_ns; })
      ->offset_ns;
}

int64_t ClockOffset::error_ns() const {
  if (probes_.empty()) return 0;
  const auto best = std::min_element(probes_.begin(), probes_.end(), [](const Probe& a, const Probe& b) {
    return a.round_trip_ns < b.round_trip_ns;
  });
  return (best->round_trip_ns + 1) / 2;
}

}  // namespace strandcast
