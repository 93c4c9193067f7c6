#include "client/app/recording_player.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr size_t kKeptStates = 64;              // behind a moment: arrow keys go back without decoding
constexpr int64_t kDecodeOnNs = 1'000'000'000;  // farther ahead a keyframe is nearer
constexpr uint64_t kKeptBytes = 64ull << 20;

}  // namespace

Result<std::unique_ptr<RecordingPlayer>> RecordingPlayer::open(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(auto states, RecordedStates::open(path));
  return std::unique_ptr<RecordingPlayer>(new RecordingPlayer(std::move(states)));
}

RecordingPlayer::RecordingPlayer(std::unique_ptr<RecordedStates> states) : states_(std::move(states)) {
  blend_.set_fill(StrandFill(asset()->rest_position_m, asset()->vertex_count));
}

double RecordingPlayer::length_s() const {
  return static_cast<double>(std::max<int64_t>(0, states_->last_ns() - states_->first_ns())) / kNsPerS;
}

int64_t RecordingPlayer::sim_time_ns(double time_s) const {
  return states_->first_ns() + std::llround(std::clamp(time_s, 0.0, length_s()) * kNsPerS);
}

/// Keeps states around this moment: those before and two after it, where there are.
Status RecordingPlayer::reach(int64_t sim_time_ns) {
  const bool is_before = kept_.empty() || sim_time_ns < kept_.front()->sim_time_ns;
  const bool is_far = !kept_.empty() && sim_time_ns > kept_.back()->sim_time_ns + kDecodeOnNs;
  if (is_before || is_far) {
    kept_.clear();
    blend_.leave();
    is_at_end_ = false;
    RETURN_IF_ERROR(states_->seek(sim_time_ns));
  }
  const auto is_reached = [&] {
    return kept_.size() >= 2 && kept_[kept_.size() - 2]->sim_time_ns > sim_time_ns;
  };
  while (!is_at_end_ && !is_reached()) {
    ASSIGN_OR_RETURN(auto state, states_->next());
    is_at_end_ = state == nullptr;
    if (is_at_end_) break;
    // A state that is told twice, or a simulation that began anew.
    if (!kept_.empty() && state->sim_time_ns <= kept_.back()->sim_time_ns) {
      if (state->sim_time_ns == kept_.back()->sim_time_ns) continue;
      is_at_end_ = true;
      break;
    }
    kept_.push_back(std::move(state));
    const uint64_t state_bytes = kept_.back()->lattice.size() * sizeof(int32_t);
    const size_t most = std::clamp<size_t>(kKeptBytes / std::max<uint64_t>(1, state_bytes), 4, kKeptStates);
    if (kept_.size() > most) kept_.pop_front();
  }
  if (kept_.empty()) return make_error(ErrorCode::BadInput, "there is no state that can be decoded");
  return {};
}

Result<PosedStrands> RecordingPlayer::strands_at(double time_s) {
  const int64_t at_ns = sim_time_ns(time_s);
  RETURN_IF_ERROR(reach(at_ns));
  const auto later = std::find_if(kept_.begin(), kept_.end(),
                                  [at_ns](const auto& state) { return state->sim_time_ns > at_ns; });
  if (later == kept_.begin()) return blend_.at(*kept_.front());
  if (later == kept_.end() || (*std::prev(later))->sim_time_ns == at_ns) return blend_.at(**std::prev(later));
  return blend_.between(kept_, static_cast<size_t>(later - kept_.begin()), at_ns);
}

Result<double> RecordingPlayer::time_beside(double time_s, Direction direction) {
  const int64_t at_ns = sim_time_ns(time_s);
  RETURN_IF_ERROR(reach(at_ns));
  // The state before has to be among those that are kept.
  if (direction == Direction::Back && kept_.front()->sim_time_ns >= at_ns && at_ns > states_->first_ns()) {
    RETURN_IF_ERROR(reach(at_ns - kDecodeOnNs / 4));
    RETURN_IF_ERROR(reach(at_ns));
  }
  int64_t beside_ns = at_ns;
  for (const auto& state : kept_) {
    const int64_t time_ns = state->sim_time_ns;
    if (direction == Direction::Back && time_ns < at_ns) beside_ns = time_ns;
    if (direction == Direction::On && time_ns > at_ns) {
      beside_ns = time_ns;
      break;
    }
  }
  return static_cast<double>(beside_ns - states_->first_ns()) / kNsPerS;
}

}  // namespace strandcast
