#include "server/scene/felt_motion.h"

#include <algorithm>

#include "common/math/turn.h"

namespace strandcast {

double felt_share(double rate) {
  return rate <= 1.0 ? 1.0 : 1.0 / (rate * rate);
}

HeadMovement FeltMotion::feel(const HeadMovement& moved, double share, bool is_cut, double step_s) {
  const HeadMovement at_pace{share * moved.shift_m, share * moved.turn_rad};
  share_ = 0.0;
  if (is_cut) {
    unknown_steps_ = kStepsAfterCut;
    seen_ = {};
    return felt_;
  }
  if (unknown_steps_ > 0) {
    seen_.shift_m += at_pace.shift_m;
    seen_.turn_rad += at_pace.turn_rad;
    if (--unknown_steps_ > 0) return felt_;
    constexpr double kShare = 1.0 / kStepsAfterCut;
    beyond_ = {kShare * seen_.shift_m - felt_.shift_m, kShare * seen_.turn_rad - felt_.turn_rad};
    passed_s_ = beyond_ == HeadMovement{} ? kFeltChangeS : 0.0;
    return felt_;
  }
  passed_s_ = std::min(passed_s_ + step_s, kFeltChangeS);
  const double of_change = ease(passed_s_ / kFeltChangeS);
  share_ = share * of_change;
  felt_ = at_pace;
  if (of_change < 1.0) {
    felt_.shift_m -= (1.0 - of_change) * beyond_.shift_m;
    felt_.turn_rad -= (1.0 - of_change) * beyond_.turn_rad;
  }
  return felt_;
}

}  // namespace strandcast
