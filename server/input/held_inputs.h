// HeldInputs: samples that wait for the simulated time that they are for, where simulation time runs on
// demand (lockstep). Of a source the first sample is for the time that the simulation is at, and its clock
// goes on from there: when a message arrives then says nothing, only that it came before the next step.
// Bounded. Not thread-safe; pure logic.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <vector>

#include "common/wire/messages.h"

namespace strandcast {

/// Of all sources together.
inline constexpr size_t kMaxHeldSamples = 65'536;
/// A source whose clock jumps by more than this begins anew at the time of the simulation.
inline constexpr int64_t kHeldClockJumpNs = 1'000'000'000;
/// Sample times are rounded to nanoseconds by whoever made them.
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

  /// Takes the samples of a message; gives how many found no room. `time_ns` is the simulation's.
  uint64_t hold(uint64_t source_id, const MotionSamples& samples, int64_t time_ns);
  uint64_t hold(uint64_t source_id, const WindSamples& samples, int64_t time_ns);
  /// It sends no more; what waits of it stays.
  void leave(uint64_t source_id);
  /// Takes out what is for times up to `time_ns`, oldest first.
  std::deque<Due> take_due(int64_t time_ns);
  /// Forgets the sources that have left and of which nothing waits; gives which.
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
