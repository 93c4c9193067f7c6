#include "server/scene/felt_motion.h"

#include <algorithm>

#include "common/math/turn.h"

namespace strandcast {

HeadMovement FeltMotion::feel(const HeadMovement& moved, bool is_cut, double step_s) {
  if (is_cut) {
    unknown_steps_ = kStepsAfterCut;
    seen_ = {};
    share_ = 0.0;
    return felt_;
  }
  if (unknown_steps_ > 0) {
    seen_.shift_m += moved.shift_m;
    seen_.turn_rad += moved.turn_rad;
    if (--unknown_steps_ > 0) return felt_;
    constexpr double kShare = 1.0 / kStepsAfterCut;
    beyond_ = {kShare * seen_.shift_m - felt_.shift_m, kShare * seen_.turn_rad - felt_.turn_rad};
    passed_s_ = beyond_ == HeadMovement{} ? kFeltChangeS : 0.0;
    return felt_;
  }
  passed_s_ = std::min(passed_s_ + step_s, kFeltChangeS);
  share_ = ease(passed_s_ / kFeltChangeS);
  felt_ = moved;
  if (share_ < 1.0) {
    felt_.shift_m -= (1.0 - share_) * beyond_.shift_m;
    felt_.turn_rad -= (1.0 - share_) * beyond_.turn_rad;
  }
  return felt_;
}

}  // namespace strandcast
