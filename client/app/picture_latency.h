// PictureLatency: time from a motion sample's arrival at the server to the decoded picture that shows it. The
// server reports which states it drew with which samples, before or after their pictures arrive. Pure logic,
// one thread.
#pragma once

#include <cstdint>
#include <deque>
#include <span>

#include "common/base/profile.h"
#include "common/replay/clock_offset.h"
#include "common/wire/messages.h"

namespace strandcast {

class PictureLatency {
 public:
  /// Notes that a picture of the state with this simulation time was decoded at this client time.
  void add_picture(int64_t sim_time_ns, int64_t decoded_ns, const ClockOffset& clock);
  /// Takes the server's report of drawn motion samples. Samples from before the first picture are ignored.
  void add_motions(std::span<const PictureMotion> motions, const ClockOffset& clock);
  /// Restarts with the next picture, because strands were shown in between.
  void restart();

  /// Returns the times in ms; a sample counts in the first picture that shows it or a newer one.
  const StageTimer& timer() const { return timer_; }

 private:
  struct Decoded {
    int64_t sim_time_ns = 0;
    int64_t time_ns = 0;  // client clock
  };
  void measure(const PictureMotion& motion, const Decoded& picture, const ClockOffset& clock);

  std::deque<Decoded> decoded_;        // the newest, oldest first
  std::deque<PictureMotion> awaited_;  // not in any of them
  StageTimer timer_;
};

}  // namespace strandcast
