// ChaosPipe: one direction of a relayed connection, which delays bytes and keeps their order. Works on given
// times without sockets or clock, so that tests can check it exactly.
#pragma once

#include <cstdint>
#include <deque>
#include <random>
#include <span>
#include <vector>

#include "common/chaos/chaos_relay.h"

namespace strandcast::chaos {

/// Bytes that cross a rate-limited link as one piece; about one Ethernet frame.
inline constexpr size_t kSegmentBytes = 1'448;

class ChaosPipe {
 public:
  ChaosPipe(const LinkPlan& plan, uint64_t seed)
      : plan_(plan),
        corrupt_random_(seed),
        cut_random_(~seed),
        jitter_random_(seed + 1),
        loss_random_(seed + 2) {}

  void set_plan(const LinkPlan& plan) { plan_ = plan; }
  const LinkPlan& plan() const { return plan_; }

  /// Returns how many bytes push() accepts now; 0 while the queue is full.
  size_t room(int64_t time_us) const;
  /// Queues bytes read at `time_us`, at most room() of them.
  void push(std::span<const std::byte> bytes, int64_t time_us);
  /// Returns the next piece to write, empty if none is due. It stays in front until pop().
  std::span<const std::byte> front(int64_t time_us) const;
  /// Removes the first `byte_count` bytes of front() after they were written.
  void pop(size_t byte_count);
  /// Returns the time of the next piece or of the end of a freeze; -1 if nothing waits.
  int64_t next_due_us(int64_t time_us) const;
  bool is_frozen(int64_t time_us) const;
  bool is_empty() const { return pieces_.empty(); }
  size_t held_bytes() const { return held_bytes_; }
  uint64_t pushed_bytes() const { return pushed_bytes_; }
  uint64_t corrupted_bytes() const { return corrupted_bytes_; }

 private:
  struct Piece {
    int64_t crossed_us = 0;  // off the queue, into the delay line
    int64_t due_us = 0;
    std::vector<std::byte> bytes;
    size_t written = 0;
  };
  void corrupt(std::span<std::byte> bytes);
  void push_segment(std::span<const std::byte> bytes, int64_t time_us);
  size_t cut_bytes() const;
  int64_t resends_us();

  LinkPlan plan_;
  std::mt19937_64 corrupt_random_;
  std::mt19937_64 cut_random_;
  std::mt19937_64 jitter_random_;
  std::mt19937_64 loss_random_;
  std::deque<Piece> pieces_;
  size_t held_bytes_ = 0;
  uint64_t pushed_bytes_ = 0;
  uint64_t corrupted_bytes_ = 0;
  double link_free_us_ = 0.0;  // when the rate allows the next byte
  int64_t last_due_us_ = 0;
  uint64_t next_cut_ = 0;
  uint64_t corrupt_in_ = 0;  // bytes until the next corrupted one, plus one; 0 = not drawn yet
};

}  // namespace strandcast::chaos
