#include "common/replay/playout_clock.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/quantile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr double kLatenessQuantile = 0.95;
/// A stream that has become slower shows in as many frames.
constexpr size_t kRecentFrames = 8;

}  // namespace

uint32_t frames_behind(double sim_frame_ns, double client_frame_ns, uint32_t now_behind) {
  const double sim_hz = kNsPerS / sim_frame_ns;
  const bool is_slow = now_behind > 1 ? sim_hz < kLinearAboveHz : sim_hz < kCubicBelowHz;
  return is_slow && client_frame_ns <= kMostCubicDelayNs ? 2 : 1;
}

void PlayoutClock::add(int64_t receive_time_ns, int64_t sim_time_ns) {
  if (!samples_.empty()) {
    const Sample& last = samples_.back();
    const bool goes_back = sim_time_ns <= last.sim_time_ns || receive_time_ns < last.receive_time_ns;
    if (goes_back || receive_time_ns - last.receive_time_ns > kPlayoutGapNs) samples_.clear();
  }
  samples_.push_back({receive_time_ns, sim_time_ns});
  if (samples_.size() > kPlayoutWindow) samples_.pop_front();
  if (has_value()) fit();
}

void PlayoutClock::fit() {
  const Sample& first = samples_.front();
  const auto count = static_cast<double>(samples_.size());
  mean_receive_ns_ = mean_sim_ns_ = 0.0;
  for (const Sample& sample : samples_) {
    mean_receive_ns_ += static_cast<double>(sample.receive_time_ns - first.receive_time_ns) / count;
    mean_sim_ns_ += static_cast<double>(sample.sim_time_ns - first.sim_time_ns) / count;
  }
  // Regression of receive time on simulation time: the latter is exact, the former carries the noise.
  double covariance = 0.0;
  double variance = 0.0;
  for (const Sample& sample : samples_) {
    const double dr = static_cast<double>(sample.receive_time_ns - first.receive_time_ns) - mean_receive_ns_;
    const double ds = static_cast<double>(sample.sim_time_ns - first.sim_time_ns) - mean_sim_ns_;
    covariance += dr * ds;
    variance += ds * ds;
  }
  // Frames received in one burst would make the slope infinite; nothing runs faster than this.
  constexpr double kFastestSimPerClient = 16.0;
  const double client_per_sim = std::max(covariance / variance, 1.0 / kFastestSimPerClient);
  sim_per_client_ = 1.0 / client_per_sim;

  std::vector<double> lateness_ns;
  for (const Sample& sample : samples_) {
    const double dr = static_cast<double>(sample.receive_time_ns - first.receive_time_ns) - mean_receive_ns_;
    const double ds = static_cast<double>(sample.sim_time_ns - first.sim_time_ns) - mean_sim_ns_;
    lateness_ns.push_back(std::max(0.0, dr - ds * client_per_sim));
  }
  const double late_ns = quantile(std::move(lateness_ns), kLatenessQuantile);
  // Half the states may come from now on: a mean would take the whole window to know.
  std::vector<double> recent_ns;
  for (size_t i = samples_.size() - std::min(samples_.size() - 1, kRecentFrames); i < samples_.size(); ++i)
    recent_ns.push_back(static_cast<double>(samples_[i].sim_time_ns - samples_[i - 1].sim_time_ns));
  const double mean_ns = static_cast<double>(samples_.back().sim_time_ns - first.sim_time_ns) / (count - 1.0);
  const double sim_frame_ns = std::max(mean_ns, median(std::move(recent_ns)));
  const double frame_ns = std::min(sim_frame_ns * client_per_sim, static_cast<double>(kPlayoutGapNs));
  frames_behind_ = std::min(frames_behind(sim_frame_ns, frame_ns, frames_behind_), most_frames_behind_);
  delay_ns_ = static_cast<int64_t>(frames_behind_ * frame_ns) +
              std::min(static_cast<int64_t>(late_ns), kMaxPlayoutDelayNs);
}

int64_t PlayoutClock::sim_time_at(int64_t client_time_ns) const {
  if (samples_.empty()) return 0;
  const Sample& first = samples_.front();
  const double receive =
      static_cast<double>(client_time_ns - delay_ns_ - first.receive_time_ns) - mean_receive_ns_;
  return first.sim_time_ns + static_cast<int64_t>(mean_sim_ns_ + receive * sim_per_client_);
}

int64_t PlayoutCursor::advance(int64_t client_time_ns, int64_t wanted_ns) {
  const auto elapsed_ns = static_cast<double>(std::max<int64_t>(client_time_ns - client_time_ns_, 0));
  const double moved_ns = static_cast<double>(wanted_ns) - static_cast<double>(wanted_ns_);
  const double behind_ns = static_cast<double>(wanted_ns) - shown_ns_;
  client_time_ns_ = client_time_ns;
  wanted_ns_ = wanted_ns;
  if (!is_started_ || std::abs(behind_ns) > static_cast<double>(kCatchUpLimitNs)) {
    is_started_ = true;
    shown_ns_ = static_cast<double>(wanted_ns);
    return wanted_ns;
  }
  // What the clock itself moved by in this time is the normal pace; a jump of its fit is a difference to
  // catch up.
  const double pace_ns = moved_ns < 0.0 ? elapsed_ns : std::min(moved_ns, 2.0 * elapsed_ns);
  const double correction_ns =
      std::clamp((behind_ns - pace_ns) * elapsed_ns / static_cast<double>(kCatchUpTimeNs),
                 -kCatchUpRate * pace_ns, kCatchUpRate * elapsed_ns);
  shown_ns_ += pace_ns + correction_ns;
  return static_cast<int64_t>(shown_ns_);
}

}  // namespace strandcast
