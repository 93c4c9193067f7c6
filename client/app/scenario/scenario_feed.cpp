#include "client/app/scenario/scenario_feed.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "client/app/ctl_commands.h"
#include "common/base/thread_name.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr uint64_t kMostSamples = kMaxSamplesPerMessage;

}  // namespace

Pose shake_motion(double t_s, double peak_mps2, double rate_hz) {
  const double omega = 2.0 * std::numbers::pi * rate_hz;
  const double begun = std::clamp(t_s * rate_hz, 0.0, 1.0);
  const double envelope = begun * begun * (3.0 - 2.0 * begun);
  return {{envelope * peak_mps2 / (omega * omega) * std::sin(omega * t_s), 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
}

Result<FeedPlan> plan_of(const ScenarioFeed& feed) {
  FeedOptions options;
  const bool is_own_motion = feed.motion == "shake" || feed.motion == "still";
  const bool is_own_wind = feed.wind == "steady";
  options.motion = is_own_motion ? "none" : feed.motion;
  options.wind = is_own_wind ? "none" : feed.wind;
  options.wind_mps = feed.wind_mps;
  options.gust_intensity = static_cast<float>(feed.gust_intensity);
  options.is_looped = true;
  FeedPlan plan;
  if (options.motion != "none" || options.wind != "none") {
    ASSIGN_OR_RETURN(plan, make_feed_plan(options));
  }
  if (feed.motion == "shake")
    plan.motion = [peak = feed.shake_mps2, rate = feed.shake_hz](double t_s) {
      return shake_motion(t_s, peak, rate);
    };
  if (feed.motion == "still") plan.motion = [](double) { return Pose(); };
  if (is_own_wind) plan.wind = [wind_mps = feed.wind_mps](double) { return wind_mps; };
  if (feed.from_s <= 0.0) return plan;
  const auto later = [from_s = feed.from_s](auto function) {
    return [function, from_s](double t_s) { return function(t_s + from_s); };
  };
  if (plan.motion) plan.motion = later(plan.motion);
  if (plan.joints) plan.joints = later(plan.joints);
  if (plan.wind) plan.wind = later(plan.wind);
  return plan;
}

Result<std::unique_ptr<LiveFeed>> LiveFeed::start(FeedPlan plan, const ClientConfig& config) {
  const std::atomic<bool> never{false};
  ASSIGN_OR_RETURN(auto heads, connect_heads(config, never, kCommandPatience));
  std::unique_ptr<LiveFeed> live(new LiveFeed(std::move(plan), std::move(heads)));
  live->thread_ = std::thread([self = live.get()] {
    name_thread("feed");
    // The end of the connection shows in what is expected of the server.
    (void)feed(self->heads_, self->plan_, self->stop_, [self](const FeedProgress& progress) {
      const std::lock_guard lock(self->mutex_);
      self->progress_ = progress;
    });
  });
  return live;
}

LiveFeed::~LiveFeed() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

FeedProgress LiveFeed::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::vector<ClientMessage> SteppedFeed::samples_up_to(uint64_t tick) {
  std::vector<ClientMessage> messages;
  while (next_tick_ <= tick) {
    const uint64_t end = std::min(tick + 1, next_tick_ + kMostSamples);
    MotionSamples motion;
    WindSamples wind;
    if (plan_.joints) motion.joint_names = plan_.joint_names;
    for (; next_tick_ < end; ++next_tick_) {
      const int64_t time_ns = std::llround(static_cast<double>(next_tick_) / step_rate_hz_ * kNsPerS);
      const double t_s = static_cast<double>(next_tick_ - begin_tick_) / step_rate_hz_;
      if (plan_.motion) motion.samples.push_back({time_ns, plan_.motion(t_s)});
      if (plan_.motion && plan_.joints) {
        const std::vector<glm::dvec3> places = plan_.joints(t_s);
        motion.samples.back().joint_m.assign(places.begin(), places.end());
      }
      if (plan_.wind) wind.samples.push_back({time_ns, plan_.wind(t_s)});
    }
    if (!motion.samples.empty()) messages.emplace_back(std::move(motion));
    if (!wind.samples.empty()) messages.emplace_back(std::move(wind));
  }
  return messages;
}

}  // namespace strandcast
