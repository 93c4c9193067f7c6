#include "server/scene/sim_clock.h"

#include <algorithm>
#include <cmath>

#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr int64_t kFactorWindowNs = 1'000'000'000;

}  // namespace

SimClock::SimClock(double step_s, int64_t time_ns)
    : step_ns_(step_s * kNsPerS), origin_ns_(time_ns), running_since_ns_(time_ns) {}

int64_t SimClock::due_ns() const {
  return origin_ns_ + static_cast<int64_t>(std::llround(static_cast<double>(next_step_) * step_ns_));
}

std::optional<int64_t> SimClock::take_step(int64_t time_ns) {
  if (is_paused_) {
    if (single_steps_ == 0) return std::nullopt;
    --single_steps_;
    return time_ns;
  }
  if (time_ns < due_ns()) return std::nullopt;
  const auto waiting = static_cast<int64_t>(static_cast<double>(time_ns - due_ns()) / step_ns_) + 1;
  if (waiting > kMaxCatchUpSteps) {
    next_step_ += waiting - kMaxCatchUpSteps;
    dropped_steps_ += static_cast<uint64_t>(waiting - kMaxCatchUpSteps);
  }
  const int64_t step_time_ns = due_ns();
  ++next_step_;
  taken_ns_.push_back(time_ns);
  while (taken_ns_.front() < time_ns - kFactorWindowNs) taken_ns_.pop_front();
  return step_time_ns;
}

uint64_t SimClock::skip(int64_t time_ns) {
  if (is_paused_) return 0;
  uint64_t count = 0;
  for (; due_ns() <= time_ns; ++next_step_, ++count) {
    // A wait longer than the window was slept through.
    if (due_ns() > time_ns - kFactorWindowNs) taken_ns_.push_back(due_ns());
  }
  while (!taken_ns_.empty() && taken_ns_.front() < time_ns - kFactorWindowNs) taken_ns_.pop_front();
  return count;
}

std::optional<int64_t> SimClock::next_due_ns() const {
  if (is_paused_) return std::nullopt;
  return due_ns();
}

void SimClock::pause() {
  is_paused_ = true;
  single_steps_ = 0;
}

void SimClock::resume(int64_t time_ns) {
  if (!is_paused_) return;
  is_paused_ = false;
  single_steps_ = 0;
  origin_ns_ = time_ns;
  next_step_ = 1;
  running_since_ns_ = time_ns;
  taken_ns_.clear();
}

bool SimClock::add_single_steps(uint32_t count) {
  if (!is_paused_) return false;
  single_steps_ += count;
  return true;
}

double SimClock::realtime_factor(int64_t time_ns) const {
  if (is_paused_) return 0.0;
  const double window_ns = static_cast<double>(std::min(time_ns - running_since_ns_, kFactorWindowNs));
  // Within the first step nothing can be said yet.
  if (window_ns < step_ns_) return 1.0;
  const auto taken = std::count_if(taken_ns_.begin(), taken_ns_.end(),
                                   [&](int64_t taken_ns) { return taken_ns > time_ns - kFactorWindowNs; });
  return static_cast<double>(taken) * step_ns_ / window_ns;
}

}  // namespace strandcast
