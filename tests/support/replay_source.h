// A source of states that simulates nothing: plays stored snapshots, one at each call. What a replayed
// recording would be, as far as the hub is concerned.
#pragma once

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "common/base/profile.h"
#include "server/stream/state_source.h"

namespace strandcast::test {

class ReplaySource : public StateSource {
 public:
  ReplaySource(std::shared_ptr<const SceneAsset> asset, std::vector<std::shared_ptr<const Snapshot>> states)
      : asset_(std::move(asset)), states_(std::move(states)) {}

  std::shared_ptr<const SceneAsset> asset() const override { return asset_; }
  Status start(StateSink& sink, const StreamDesc&) override {
    sink_ = &sink;
    play_next();
    return {};
  }
  void stop() override {}
  void set_demand(const SourceDemand& demand) override { is_watched_ = demand.is_watched(); }
  void post(const ControlCommand&, Reply reply, const std::string&) override { refuse(reply); }
  void post(const SetParameter&, Reply reply, const std::string&) override { refuse(reply); }
  SimStats stats() const override {
    SimStats stats;
    stats.tick = stats.published = next_;
    stats.last_step_ns = now_ns();  // it can put the next one at any time
    return stats;
  }
  std::optional<Error> failure() const override { return std::nullopt; }

  /// Puts the next state, and then the last one again and again.
  void play_next() {
    sink_->put(states_[std::min<size_t>(next_, states_.size() - 1)]);
    ++next_;
  }
  bool is_watched() const { return is_watched_; }

 private:
  static void refuse(const Reply& reply) {
    if (reply) reply({true, "A recording cannot be changed."});
  }

  const std::shared_ptr<const SceneAsset> asset_;
  const std::vector<std::shared_ptr<const Snapshot>> states_;
  StateSink* sink_ = nullptr;
  std::atomic<size_t> next_{0};
  std::atomic<bool> is_watched_{false};
};

}  // namespace strandcast::test
