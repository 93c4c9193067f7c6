// libFuzzer entry: a wind file.
#include <cmath>

#include "common/base/check.h"
#include "common/motion/wind_csv.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::wind_csv_fuzz {

extern "C" int FUZZ_ENTRY(wind_csv)(const uint8_t* data, size_t size) {
  const auto series = parse_wind_csv(FuzzInput(data, size).take_rest_as_text(), "fuzz");
  if (!series) return 0;
  CHECK(!series->time_s.empty() && series->time_s.size() == series->velocity_mps.size());
  CHECK(series->time_s.front() == 0.0 && std::isfinite(series->time_s.back()));
  for (size_t i = 1; i < series->time_s.size(); ++i) CHECK(series->time_s[i] > series->time_s[i - 1]);
  for (const glm::vec3& velocity : series->velocity_mps)
    for (int i = 0; i < 3; ++i) CHECK(std::abs(velocity[i]) <= static_cast<float>(kMaxWindSpeedMps));
  const glm::vec3 between = series->sample(0.3 * series->duration_s());
  CHECK(std::isfinite(between.x) && std::isfinite(between.y) && std::isfinite(between.z));
  return 0;
}

}  // namespace strandcast::wind_csv_fuzz
