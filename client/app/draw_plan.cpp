#include "client/app/draw_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace strandcast {

double seen_motion_px(const PosedStrands& from, const PosedStrands& to, const CameraDesc& camera,
                      RenderSize size) {
  constexpr size_t kLooks = 4096;
  const size_t count = to.position_m.size();
  if (from.position_m.size() != count) return std::numeric_limits<double>::infinity();
  const glm::mat3 world_from_old(glm::mat3_cast(from.world_from_head.rotation));
  const glm::mat3 world_from_new(glm::mat3_cast(to.world_from_head.rotation));
  float farthest_m = 0.0f;
  for (size_t i = 0; i < count; i += count / kLooks + 1)
    farthest_m = std::max(
        farthest_m, glm::length(world_from_new * to.position_m[i] - world_from_old * from.position_m[i]));
  const double px_per_m =
      0.5 * size.height / (std::tan(0.5 * camera.fov_y_rad) * glm::length(camera.offset_m));
  return static_cast<double>(farthest_m) * px_per_m;
}

RenderSize size_of_step(size_t step, RenderSize window) {
  const auto side = [&](uint32_t whole) {
    return std::max(static_cast<uint32_t>(std::lround(kDrawSteps[step].size_share * whole)), 1u);
  };
  return {side(window.width), side(window.height)};
}

void DrawPlan::set_pixels(uint64_t pixels) {
  if (pixels == pixels_ || pixels == 0) return;
  // As the rows of the table: halving the sides takes a third of the time.
  constexpr double kCostPerPixels = 0.75;
  if (pixels_ != 0) {
    const double ratio = std::pow(static_cast<double>(pixels) / static_cast<double>(pixels_), kCostPerPixels);
    for (Measured& step : measured_)
      for (double& ms : step.ms) ms *= ratio;
  }
  pixels_ = pixels;
}

void DrawPlan::note_drawn(size_t step, double ms, int64_t time_ns) {
  Measured& measured = measured_[step];
  if (!is_fresh(step, time_ns)) measured.ms.clear();
  measured.ms.push_back(ms);
  if (measured.ms.size() > kKept) measured.ms.pop_front();
  measured.time_ns = time_ns;
  last_step_ = step;
  choose(time_ns);
}

void DrawPlan::choose(int64_t time_ns) {
  const auto takes = [&](size_t step) { return expected_ms(step, time_ns); };
  constexpr size_t kLast = kDrawSteps.size() - 1;
  if (takes(moving_step_) > kTooLong * kMovingBudgetMs) {
    while (moving_step_ < kLast && takes(moving_step_) > kMovingBudgetMs) ++moving_step_;
    return;
  }
  for (size_t finer = 0; finer < moving_step_; ++finer)
    if (takes(finer) <= kLeavesRoom * kMovingBudgetMs) {
      moving_step_ = finer;
      return;
    }
}

bool DrawPlan::is_fresh(size_t step, int64_t time_ns) const {
  return !measured_[step].ms.empty() && time_ns - measured_[step].time_ns < kForgetStepNs;
}

double DrawPlan::median_ms(size_t step) const {
  std::vector<double> sorted(measured_[step].ms.begin(), measured_[step].ms.end());
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

double DrawPlan::expected_ms(size_t step, int64_t time_ns) const {
  if (is_fresh(step, time_ns)) return median_ms(step);
  // What was drawn last says how busy this machine is now.
  if (measured_[last_step_].ms.empty()) return 0.0;
  return median_ms(last_step_) * kDrawSteps[step].cost / kDrawSteps[last_step_].cost;
}

double DrawPlan::fair_ms(int64_t time_ns) const {
  return expected_ms(std::min(moving_step_, kCoarsestFairStep), time_ns);
}

}  // namespace strandcast
