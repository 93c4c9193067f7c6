// RecordingPlayer: strands of a recording at any moment, for playing and seeking. It decodes forward from its
// position if that is near, otherwise from the preceding keyframe. One thread.
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
  /// Opens a recording; returns the errors of RecordedStates::open().
  static Result<std::unique_ptr<RecordingPlayer>> open(const std::filesystem::path& path);

  double length_s() const;
  /// Returns the strands `time_s` after the first state (0 .. length_s()), interpolated between states as
  /// viewers do.
  Result<PosedStrands> strands_at(double time_s);
  enum class Direction { Back, On };
  /// Returns the time of the next or previous state beside `time_s`, or `time_s` if there is none.
  Result<double> time_beside(double time_s, Direction direction);

  const std::shared_ptr<const SceneAsset>& asset() const { return states_->scene().asset; }
  /// Returns look and camera as recorded for the newest decoded state.
  const LookChange& look() const { return states_->look(); }
  std::vector<std::string> remarks() const { return states_->remarks(); }
  /// Returns the simulated time of a moment, ns.
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
