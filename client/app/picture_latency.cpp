#include "client/app/picture_latency.h"

#include <algorithm>

namespace strandcast {
namespace {

constexpr size_t kKeptPictures = 256;  // four seconds at 60 Hz; the server tells of them twice a second
constexpr size_t kAwaitedMotions = 2 * kMaxPictureMotions;

}  // namespace

void PictureLatency::add_picture(int64_t sim_time_ns, int64_t decoded_ns, const ClockOffset& clock) {
  // The same state again, with another look or finer, shows nothing new.
  if (!decoded_.empty() && decoded_.back().sim_time_ns >= sim_time_ns) return;
  decoded_.push_back({sim_time_ns, decoded_ns});
  if (decoded_.size() > kKeptPictures) decoded_.pop_front();
  std::erase_if(awaited_, [&](const PictureMotion& motion) {
    if (motion.sim_time_ns > sim_time_ns) return false;
    measure(motion, decoded_.back(), clock);
    return true;
  });
}

void PictureLatency::add_motions(std::span<const PictureMotion> motions, const ClockOffset& clock) {
  for (const PictureMotion& motion : motions) {
    if (decoded_.empty() || motion.sim_time_ns <= decoded_.front().sim_time_ns) continue;
    const auto picture = std::find_if(decoded_.begin(), decoded_.end(), [&](const Decoded& decoded) {
      return decoded.sim_time_ns >= motion.sim_time_ns;
    });
    if (picture != decoded_.end()) {
      measure(motion, *picture, clock);
      continue;
    }
    awaited_.push_back(motion);
    if (awaited_.size() > kAwaitedMotions) awaited_.pop_front();
  }
}

void PictureLatency::restart() {
  decoded_.clear();
  awaited_.clear();
}

void PictureLatency::measure(const PictureMotion& motion, const Decoded& picture, const ClockOffset& clock) {
  // The server's word is not to be trusted with an overflow.
  const bool is_sane = motion.motion_time_ns > -kMaxClockNs && motion.motion_time_ns < kMaxClockNs;
  if (!clock.has_value() || !is_sane) return;
  timer_.add_ms(static_cast<double>(clock.to_server_ns(picture.time_ns) - motion.motion_time_ns) * 1e-6);
}

}  // namespace strandcast
