// Motion and wind that a scenario feeds, as functions of time. They are sent in real time on a thread and
// connection of their own, or sample by sample for the steps of a server in lockstep.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "client/app/feed.h"
#include "common/scene/scenario.h"

namespace strandcast {

/// Returns the functions of a feed, from its `from_s` on. Loads its files; errors name them.
Result<FeedPlan> plan_of(const ScenarioFeed& feed);

/// Returns a pose of a head shaken along x with this peak acceleration; the first period builds it up.
Pose shake_motion(double t_s, double peak_mps2, double rate_hz);

/// Feeds in real time until it is destroyed; a connection that is lost comes back.
class LiveFeed {
 public:
  static Result<std::unique_ptr<LiveFeed>> start(FeedPlan plan, const ClientConfig& config);
  ~LiveFeed();
  LiveFeed(const LiveFeed&) = delete;
  LiveFeed& operator=(const LiveFeed&) = delete;

  /// Returns the progress as of the newest second.
  FeedProgress progress() const;

 private:
  LiveFeed(FeedPlan plan, std::vector<std::unique_ptr<SteadyClient>> heads)
      : plan_(std::move(plan)), heads_(std::move(heads)) {}

  const FeedPlan plan_;
  const std::vector<std::unique_ptr<SteadyClient>> heads_;
  std::atomic<bool> stop_{false};
  mutable std::mutex mutex_;  // guards the one below
  FeedProgress progress_;
  std::thread thread_;
};

/// Makes samples for the steps after `begin_tick`, and one for that tick itself, from which times are
/// counted.
class SteppedFeed {
 public:
  SteppedFeed(FeedPlan plan, uint64_t begin_tick, double step_rate_hz)
      : plan_(std::move(plan)),
        begin_tick_(begin_tick),
        next_tick_(begin_tick),
        step_rate_hz_(step_rate_hz) {}

  /// Returns the messages to send before the simulation continues to `tick`.
  std::vector<ClientMessage> samples_up_to(uint64_t tick);

 private:
  const FeedPlan plan_;
  const uint64_t begin_tick_;
  uint64_t next_tick_;
  const double step_rate_hz_;
};

}  // namespace strandcast
