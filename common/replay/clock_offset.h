// Estimates the clock offset between client and server from ping round trips. Pure arithmetic, no I/O.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace strandcast {

/// Keeps the probe with the smallest round trip among the last kClockWindow; its midpoint gives the offset.
class ClockOffset {
 public:
  /// Adds a probe: client send, server receive, server send, client receive; in ns, each in its own clock.
  /// Invalid probes are ignored: a negative round trip or one above 10 s, times that run backwards, server
  /// times beyond kMaxClockNs.
  void add(int64_t client_send_ns, int64_t server_receive_ns, int64_t server_send_ns,
           int64_t client_receive_ns);
  bool has_value() const { return !probes_.empty(); }
  /// Returns server clock minus client clock, ns; 0 without a probe.
  int64_t offset_ns() const;
  /// Returns the largest possible error, which is half the best round trip, ns; 0 without a probe.
  int64_t error_ns() const;
  int64_t to_server_ns(int64_t client_ns) const { return client_ns + offset_ns(); }

 private:
  struct Probe {
    int64_t offset_ns;
    int64_t round_trip_ns;
  };
  std::deque<Probe> probes_;
};
inline constexpr size_t kClockWindow = 100;
inline constexpr int64_t kMaxClockNs = int64_t{1} << 61;  // of a server's time: no sum with it overflows

}  // namespace strandcast
