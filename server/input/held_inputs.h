// HeldInputs: samples that wait for their simulated time, when simulation time runs on demand (lockstep). The
// first sample of a source is for the present simulated time, and later ones follow the source's clock. So
// the arrival time of a message does not matter, as long as it comes before its step. Bounded. Not
// thread-safe; pure logic.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "common/wire/messages.h"

namespace strandcast {

/// Largest number of held samples of all sources together.
inline constexpr size_t kMaxHeldSamples = 65'536;
/// Clock step beyond which a source begins anew at the simulation's time.
inline constexpr int64_t kHeldClockJumpNs = 1'000'000'000;
/// Tolerance for sample times that senders have rounded to nanoseconds.
inline constexpr int64_t kHeldSlackNs = 1'000;

class HeldInputs {
 public:
  struct Due {
    uint64_t source_id = 0;
    int64_t arrival_ns = 0;  // simulated time that it is for
    // One of the two, of one sample.
    std::shared_ptr<const MotionSamples> motion = {};
    std::shared_ptr<const WindSamples> wind = {};
  };

  /// Takes the samples of a message and returns how many were dropped because the limit was reached.
  /// `time_ns` is the simulation's time.
  uint64_t hold(uint64_t source_id, const MotionSamples& samples, int64_t time_ns);
  uint64_t hold(uint64_t source_id, const WindSamples& samples, int64_t time_ns);
  /// Notes that a source sends no more; its waiting samples stay.
  void leave(uint64_t source_id);
  /// Removes and returns the samples for times up to `time_ns`, oldest first.
  std::deque<Due> take_due(int64_t time_ns);
  /// Forgets sources that have left and have no waiting samples, and returns their ids.
  std::vector<uint64_t> take_left();

 private:
  struct Source {
    int64_t offset_ns = 0;  // simulated time minus source clock
    int64_t newest_ns = 0;  // of its samples, source clock
    std::deque<Due> waiting;
    bool has_left = false;
  };
  template <class Message>
  uint64_t hold_each(uint64_t source_id, const Message& samples, int64_t time_ns);
  size_t held_count() const;

  std::map<uint64_t, Source> sources_;
};

}  // namespace strandcast
