// BakedStates: states of a server of its own in lockstep. A feed drives it step by step, so that no state is
// missed, however slow the machine is. One thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/app/scenario/scenario_feed.h"
#include "client/app/scenario/server_process.h"
#include "client/app/viewer_session.h"
#include "client/export/export_source.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

/// Motion that a bake sends to its server, and the times of the states that it takes.
struct BakeFeed {
  FeedPlan plan;        // in motion time, from 0
  double lead_s = 0.0;  // in which the motion sets in, before the first state
  double fps = 30.0;    // of the frames that are made of the states
};

/// Returns how many steps lie between the states that frames are made of: all from one to the next where that
/// is a whole number, else one.
uint64_t steps_between(double step_rate_hz, double fps);

/// Returns the plan with `lead_s` before its start: the head comes from rest, and reaches the place and the
/// speed that the plan begins with.
FeedPlan with_lead(FeedPlan plan, double lead_s);

class BakedStates : public ExportSource {
 public:
  /// Starts the program with these words for hair and scene, and waits for its hair; `stop` ends every wait.
  /// Returns the server's own error if it does not start.
  static Result<std::unique_ptr<BakedStates>> start(const std::filesystem::path& program,
                                                    std::vector<std::string> words,
                                                    const std::atomic<bool>& stop);
  ~BakedStates() override;

  /// Begins with the first state of a feed. Call it once, before next().
  void begin(const BakeFeed& feed);

  const ExportScene& scene() const override { return scene_; }
  /// Simulates on, and returns the next state, its time that of the motion. Unavailable when stopped, or when
  /// the server has ended.
  Result<std::shared_ptr<const Snapshot>> next() override;
  std::vector<std::string> remarks() const override;
  /// Returns what the server says of the hair before it moves: what was left out, guessed and fitted.
  std::vector<std::string> hair_notes() const;
  /// Returns the scene that the server simulates.
  const SceneDesc& simulated() const { return simulated_; }

 private:
  explicit BakedStates(const std::atomic<bool>& stop) : stop_(stop) {}
  Status open(const std::filesystem::path& program, std::vector<std::string> words);
  Status connect();
  Status await_scene();
  Status take_steps();
  Status pump(std::chrono::milliseconds timeout);
  Error ended(const Error& error);

  const std::atomic<bool>& stop_;
  std::filesystem::path folder_;  // of the server's files; removed at the end
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<ViewerClient> client_;    // that steps and feeds
  std::unique_ptr<ViewerSession> session_;  // that gets the strands
  std::unique_ptr<SteppedFeed> feed_;
  SceneDesc simulated_;
  ExportScene scene_;
  std::deque<std::shared_ptr<const Snapshot>> waiting_;
  uint64_t first_tick_ = 0;          // of the first state that is given
  std::optional<int64_t> first_ns_;  // its simulated time
  uint64_t stride_ = 1;              // from one to the next
  uint64_t asked_tick_ = 0, done_tick_ = 0, seen_tick_ = 0;
  int64_t done_ns_ = 0;  // when the steps were done
  uint64_t lost_ = 0;
};

}  // namespace strandcast
