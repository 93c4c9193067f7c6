// Quality of a scene that leaves it to the machine, from the time of a step of full.
#pragma once

#include <fmt/format.h>

#include <string>

#include "common/base/units.h"

namespace strandcast {

struct AutoQuality {
  bool is_full = false;
  std::string reason;  // "a step of full takes 4.9 ms of the 16.7 ms there are"
};

/// Full, where its steps take half of the time there is or less.
inline AutoQuality auto_quality(double step_ms, double step_rate_hz) {
  constexpr double kFullShare = 0.5;
  const double there_ms = kMsPerS / step_rate_hz;
  return {step_ms <= kFullShare * there_ms,
          fmt::format("a step of full takes {:.1f} ms of the {:.1f} ms there are", step_ms, there_ms)};
}

}  // namespace strandcast
