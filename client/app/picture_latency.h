// PictureLatency: how long a motion sample takes from its arrival at the server to the decoded picture that
// shows it. The server says which states it drew with which samples, before or after their pictures come.
// Pure logic, one thread.
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
  /// A picture of the state of this simulation time was decoded at this client time.
  void add_picture(int64_t sim_time_ns, int64_t decoded_ns, const ClockOffset& clock);
  /// What the server drew. Samples of before the first picture do not count.
  void add_motions(std::span<const PictureMotion> motions, const ClockOffset& clock);
  /// Other frames were shown meanwhile: the next picture is the first one.
  void restart();

  /// ms, of every sample that was shown, in the first picture with it or with a newer one.
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
