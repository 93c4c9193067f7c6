// RecordingPlayer: the strands of a recording at any moment, for whoever plays or scrubs. Decodes on from
// where it is when that is not far, else from the keyframe before. One thread.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>

#include "client/app/recorded_states.h"
#include "common/replay/state_blend.h"

namespace strandcast {

class RecordingPlayer {
 public:
  /// The errors of RecordedStates::open().
  static Result<std::unique_ptr<RecordingPlayer>> open(const std::filesystem::path& path);

  double length_s() const;
  /// Strands `time_s` after the first state, between 0 and length_s(): between states as viewers show them.
  Result<PosedStrands> strands_at(double time_s);
  enum class Direction { Back, On };
  /// When the next or the last state beside `time_s` is, or `time_s` where there is none.
  Result<double> time_beside(double time_s, Direction direction);

  const std::shared_ptr<const SceneAsset>& asset() const { return states_->scene().asset; }
  /// As it was recorded for the newest decoded state.
  const LookChange& look() const { return states_->look(); }
  std::vector<std::string> remarks() const { return states_->remarks(); }
  /// Simulated time of a moment, ns.
  int64_t sim_time_ns(double time_s) const;

 private:
  explicit RecordingPlayer(std::unique_ptr<RecordedStates> states);
  Status reach(int64_t sim_time_ns);

  std::unique_ptr<RecordedStates> states_;
  StateBlend blend_;
  std::deque<std::shared_ptr<const Snapshot>> kept_;  // around the last moment, oldest first
  bool is_at_end_ = false;
};

}  // namespace strandcast
