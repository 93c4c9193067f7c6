// A jogger's ponytail: growth rate of its sideways sway under a head that moves vertically, compared with
// theory.
#pragma once

#include <string>
#include <vector>

#include "server/sim/executor/executor.h"

namespace strandcast {

struct PonytailDesc {
  /// Frequencies of the head, relative to twice that of the ponytail's own sway.
  std::vector<double> ratios = {0.7, 0.85, 1.0, 1.15, 1.4, 1.7};
  double seconds = 8.0;
  double step_rate_hz = 240.0;
  uint32_t tuft_strands = 100;
  double tuft_hairs = 40'000.0;  // that they stand for
};

/// Growth rate of sideways sway under a vertically moving head; negative if it decays.
struct PonytailSway {
  double ratio = 0.0;  // of frequencies, as PonytailDesc::ratios
  double head_hz = 0.0;
  double ours_per_s = 0.0;
  double theory_per_s = 0.0;
};
struct Ponytail {
  std::string name;
  double sway_radps = 0.0;   // of its own, as measured
  double chain_radps = 0.0;  // of a limp chain of its length
  double decay_per_s = 0.0;  // of a free sway's amplitude
  double modulation = 0.0;   // acceleration of the head over that of gravity
  std::vector<PonytailSway> rows;
};

/// Growth rate per second of q'' + 2 decay q' + frequency^2 (1 + modulation cos(head t)) q = 0 (Mathieu). It
/// is the logarithm of the largest Floquet multiplier over the period. A hanging string's sway obeys it under
/// a vertically moving head (Keller 2010), because the head's acceleration acts like gravity.
struct MathieuSway {
  double frequency_radps = 0.0;
  double decay_per_s = 0.0;
  double modulation = 0.0;
  double head_radps = 0.0;
};
double mathieu_growth_per_s(const MathieuSway& sway);

/// Measures a limp hair without air, and a tuft of full quality.
Result<std::vector<Ponytail>> measure_ponytails(const PonytailDesc& desc, Executor& executor);

}  // namespace strandcast
