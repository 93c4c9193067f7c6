#include "server/app/frame_stages.h"

#include <algorithm>
#include <utility>

#include "common/base/units.h"
#include "server/net/metrics.h"

namespace strandcast {
namespace {

double ms_between(int64_t from_ns, int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * kMsPerNs;
}

}  // namespace

FrameStages::~FrameStages() {
  while (!open_.empty()) close_row();
}

Status FrameStages::open_trace(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  trace_.open(path, std::ios::trunc);
  trace_ << "tick,sim_time_ns,source_ns,motion_ns,published_ns,encoded_ns\n";
  if (trace_) return {};
  return make_error(ErrorCode::BadInput, "cannot write the trace {}", path.string());
}

/// The oldest state is as complete as it gets.
void FrameStages::close_row() {
  const StateTime& row = open_.front().times;
  if (trace_.is_open() && trace_lines_ < kMaxTraceLines) {
    ++trace_lines_;
    trace_ << fmt::format("{},{},{},{},{},{}\n", row.tick, row.sim_time_ns, row.source_ns, row.motion_ns,
                          row.published_ns, row.encoded_ns);
  }
  open_.pop_front();
}

void FrameStages::note_state(const SnapshotInfo& state, int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  // A state that is published once more is no other.
  if (!open_.empty() && open_.back().times.sim_time_ns == state.sim_time_ns) return;
  while (open_.size() >= kMaxOpenStates) close_row();
  const int64_t motion_ns = state.motion_time_ns;
  const int64_t source_ns = source_times_ && motion_ns != 0 ? source_times_(motion_ns) : 0;
  open_.push_back({{state.tick, state.sim_time_ns, source_ns, motion_ns, time_ns, 0, state.timecode}, false});
  if (state.motion_time_ns == 0 || state.motion_time_ns == last_motion_ns_) return;
  last_motion_ns_ = state.motion_time_ns;
  motion_to_state_.add_ms(ms_between(state.motion_time_ns, time_ns));
}

void FrameStages::note_encoded(int64_t sim_time_ns, int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  const auto row = std::find_if(open_.rbegin(), open_.rend(),
                                [&](const Row& one) { return one.times.sim_time_ns == sim_time_ns; });
  if (row == open_.rend() || row->times.encoded_ns != 0) return;
  row->times.encoded_ns = time_ns;
  state_to_frame_.add_ms(ms_between(row->times.published_ns, time_ns));
}

std::vector<StateTime> FrameStages::take_states(int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  std::vector<StateTime> states;
  for (Row& row : open_) {
    const int64_t age_ns = time_ns - row.times.published_ns;
    if (row.times.encoded_ns == 0 && age_ns < kFramePatienceNs) break;
    if (std::exchange(row.is_taken, true) || age_ns > kToldStateNs) continue;
    states.push_back(row.times);
  }
  return states;
}

std::string FrameStages::metrics() const {
  const std::lock_guard lock(mutex_);
  return format_histogram("motion_to_state_ms",
                          "From the arrival of a motion sample to the first published state that has it.",
                          motion_to_state_) +
         format_histogram("state_to_frame_ms",
                          "From a state that was published to its first encoded frame of strands.",
                          state_to_frame_);
}

}  // namespace strandcast
