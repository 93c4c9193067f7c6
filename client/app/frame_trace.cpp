#include "client/app/frame_trace.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/replay/clock_offset.h"

namespace strandcast {
namespace {

/// The server's word is not to be trusted with an overflow.
int64_t sane(int64_t time_ns) {
  return time_ns > -kMaxClockNs && time_ns < kMaxClockNs ? time_ns : 0;
}

struct Stage {
  const char* name;
  int64_t FrameTimes::*from;
  int64_t FrameTimes::*to;
};
constexpr Stage kStages[] = {
    {"motion made -> received", &FrameTimes::source_ns, &FrameTimes::motion_ns},
    {"motion received -> simulated", &FrameTimes::motion_ns, &FrameTimes::published_ns},
    {"simulated -> sent", &FrameTimes::published_ns, &FrameTimes::sent_ns},
    {"motion received -> sent", &FrameTimes::motion_ns, &FrameTimes::sent_ns},
    {"sent -> received", &FrameTimes::sent_ns, &FrameTimes::received_ns},
    {"received -> decoded", &FrameTimes::received_ns, &FrameTimes::decoded_ns},
    {"motion received -> decoded", &FrameTimes::motion_ns, &FrameTimes::decoded_ns}};
/// What follows what: together the whole way.
constexpr Stage kWay[] = {{"simulated", &FrameTimes::motion_ns, &FrameTimes::published_ns},
                          {"encoded", &FrameTimes::published_ns, &FrameTimes::sent_ns},
                          {"on its way", &FrameTimes::sent_ns, &FrameTimes::received_ns},
                          {"decoded", &FrameTimes::received_ns, &FrameTimes::decoded_ns},
                          {"presented", &FrameTimes::decoded_ns, &FrameTimes::presented_ns}};

constexpr const char* kColumns =
    "tick,mode,sim_time_ns,source_ns,motion_ns,published_ns,encoded_ns,sent_ns,received_ns,decoded_ns,"
    "presented_ns,clock_error_ns\n";

/// Of every frame that has both times, ms.
std::vector<double> times_ms(const std::vector<FrameTimes>& frames, const Stage& stage) {
  std::vector<double> all;
  const bool is_of_sample = stage.from == &FrameTimes::motion_ns || stage.from == &FrameTimes::source_ns;
  int64_t last_motion_ns = 0;
  for (const FrameTimes& frame : frames) {
    // Of a sample the first frame that has it counts: later ones hold it for as long as no other comes.
    const bool is_old = is_of_sample && frame.motion_ns == last_motion_ns;
    last_motion_ns = frame.motion_ns;
    if (frame.*stage.from == 0 || frame.*stage.to == 0 || is_old) continue;
    all.push_back(static_cast<double>(frame.*stage.to - frame.*stage.from) * kMsPerNs);
  }
  return all;
}

}  // namespace

FrameTrace::~FrameTrace() {
  (void)close();
}

Status FrameTrace::open(const std::filesystem::path& path) {
  const std::lock_guard lock(mutex_);
  file_.open(path, std::ios::trunc);
  file_ << kColumns << std::flush;
  if (file_) return {};
  file_ = std::ofstream();
  return make_error(ErrorCode::BadInput, "cannot write the trace {}", path.string());
}

Status FrameTrace::close() {
  const std::lock_guard lock(mutex_);
  if (!file_.is_open()) return {};
  for (const FrameTimes& frame : frames_) write(frame);
  file_.close();
  if (file_) return {};
  return make_error(ErrorCode::Unavailable, "the trace could not be written: is the disk full?");
}

void FrameTrace::write(const FrameTimes& frame) {
  if (!file_.is_open() || line_count_ >= kMaxFrameLines) return;
  ++line_count_;
  file_ << fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", frame.tick, to_string(frame.mode),
                       frame.sim_time_ns, frame.source_ns, frame.motion_ns, frame.published_ns,
                       frame.encoded_ns, frame.sent_ns, frame.received_ns, frame.decoded_ns,
                       frame.presented_ns, frame.clock_error_ns);
}

void FrameTrace::begin_session() {
  const std::lock_guard lock(mutex_);
  session_frames_ = 0;
}

void FrameTrace::add(const FrameTimes& times) {
  const std::lock_guard lock(mutex_);
  frames_.push_back(times);
  frames_.back().motion_ns = sane(times.motion_ns);
  frames_.back().sent_ns = sane(times.sent_ns);
  ++session_frames_;
  if (frames_.size() <= kept_frames_) return;
  write(frames_.front());
  frames_.pop_front();
  session_frames_ = std::min(session_frames_, frames_.size());
}

void FrameTrace::note_states(std::span<const StateTime> states) {
  std::map<int64_t, const StateTime*> state_at;
  for (const StateTime& state : states) state_at.emplace(state.sim_time_ns, &state);
  const std::lock_guard lock(mutex_);
  const size_t count = std::min(session_frames_, kRecentFrames);
  for (auto frame = frames_.rbegin(); frame != frames_.rbegin() + static_cast<std::ptrdiff_t>(count);
       ++frame) {
    const auto found = state_at.find(frame->sim_time_ns);
    if (found == state_at.end() || frame->published_ns != 0) continue;
    const StateTime& state = *found->second;
    // Strands carry it; pictures do not.
    if (frame->motion_ns == 0) frame->motion_ns = sane(state.motion_ns);
    frame->source_ns = sane(state.source_ns);
    frame->published_ns = sane(state.published_ns);
    frame->encoded_ns = sane(state.encoded_ns);
  }
}

void FrameTrace::note_presented(StreamMode mode, int64_t sim_time_ns, int64_t time_ns) {
  const std::lock_guard lock(mutex_);
  const size_t count = std::min(session_frames_, kRecentFrames);
  for (auto frame = frames_.rbegin(); frame != frames_.rbegin() + static_cast<std::ptrdiff_t>(count);
       ++frame) {
    if (frame->mode != mode || frame->sim_time_ns > sim_time_ns) continue;
    const bool is_of_it = frame->sim_time_ns > sim_time_ns - kShownStateNs;
    if (is_of_it && frame->presented_ns == 0) frame->presented_ns = time_ns;
    return;
  }
}

std::vector<FrameTimes> FrameTrace::frames() const {
  const std::lock_guard lock(mutex_);
  return {frames_.begin(), frames_.end()};
}

std::vector<FrameTimes> FrameTrace::decoded_since(int64_t time_ns) const {
  const std::lock_guard lock(mutex_);
  auto first = frames_.end();
  while (first != frames_.begin() && std::prev(first)->decoded_ns >= time_ns) --first;
  return {first, frames_.end()};
}

std::vector<StageTimes> stage_times(const std::vector<FrameTimes>& frames) {
  std::vector<StageTimes> all;
  for (const Stage& stage : kStages) {
    const std::vector<double> ms = times_ms(frames, stage);
    all.push_back(
        {stage.name, ms.size(), quantile(ms, 0.5), quantile(ms, 0.9), quantile(ms, 0.99), quantile(ms, 1.0)});
  }
  return all;
}

std::vector<WayPart> way_parts(const std::vector<FrameTimes>& frames) {
  std::vector<WayPart> parts;
  for (const Stage& stage : kWay)
    if (const std::vector<double> ms = times_ms(frames, stage); !ms.empty())
      // Clocks agree within half a round trip: less than nothing is nothing.
      parts.push_back({stage.name, std::max(quantile(ms, 0.5), 0.0)});
  return parts;
}

std::string to_table(const std::vector<StageTimes>& stages) {
  std::string text = fmt::format("{:<28}{:>9}{:>11}{:>11}{:>11}{:>11}\n", "", "frames", "median ms", "p90 ms",
                                 "p99 ms", "most ms");
  for (const StageTimes& stage : stages) {
    if (stage.count == 0) {
      text += fmt::format("{:<28}{:>9}   nothing to measure\n", stage.stage, 0);
      continue;
    }
    text += fmt::format("{:<28}{:>9}{:>11.2f}{:>11.2f}{:>11.2f}{:>11.2f}\n", stage.stage, stage.count,
                        stage.median_ms, stage.p90_ms, stage.p99_ms, stage.most_ms);
  }
  return text;
}

std::string to_csv(const std::vector<StageTimes>& stages) {
  std::string text = "stage,frames,median_ms,p90_ms,p99_ms,most_ms\n";
  for (const StageTimes& stage : stages)
    text += fmt::format("{},{},{:.4f},{:.4f},{:.4f},{:.4f}\n", stage.stage, stage.count, stage.median_ms,
                        stage.p90_ms, stage.p99_ms, stage.most_ms);
  return text;
}

}  // namespace strandcast
