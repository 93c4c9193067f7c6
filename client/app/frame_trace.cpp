#include "client/app/frame_trace.h"

#include "common/base/file.h"
#include "common/base/quantile.h"

namespace strandcast {
namespace {

constexpr double kMsPerNs = 1e-6;

struct Stage {
  const char* name;
  int64_t FrameTimes::*from;
  int64_t FrameTimes::*to;
};
constexpr Stage kStages[] = {{"motion received -> sent", &FrameTimes::motion_ns, &FrameTimes::sent_ns},
                             {"sent -> received", &FrameTimes::sent_ns, &FrameTimes::received_ns},
                             {"received -> decoded", &FrameTimes::received_ns, &FrameTimes::decoded_ns},
                             {"motion received -> decoded", &FrameTimes::motion_ns, &FrameTimes::decoded_ns}};

Status save_text(const std::filesystem::path& path, const std::string& text) {
  return save_file(path, std::as_bytes(std::span(text)));
}

}  // namespace

void FrameTrace::add(const FrameTimes& times) {
  if (frames_.size() < kMaxTracedFrames)
    frames_.push_back(times);
  else
    ++left_out_;
}

Status FrameTrace::save(const std::filesystem::path& path) const {
  std::string text = "tick,mode,sim_time_ns,motion_ns,sent_ns,received_ns,decoded_ns,clock_error_ns\n";
  for (const FrameTimes& frame : frames_)
    text += fmt::format("{},{},{},{},{},{},{},{}\n", frame.tick, to_string(frame.mode), frame.sim_time_ns,
                        frame.motion_ns, frame.sent_ns, frame.received_ns, frame.decoded_ns,
                        frame.clock_error_ns);
  return save_text(path, text);
}

std::vector<StageTimes> stage_times(const std::vector<FrameTimes>& frames) {
  std::vector<StageTimes> all;
  for (const Stage& stage : kStages) {
    std::vector<double> times_ms;
    int64_t last_motion_ns = 0;
    for (const FrameTimes& frame : frames) {
      // Of a sample the first frame that has it counts: later ones hold it for as long as no other comes.
      const bool is_old = stage.from == &FrameTimes::motion_ns && frame.motion_ns == last_motion_ns;
      last_motion_ns = frame.motion_ns;
      if (frame.*stage.from == 0 || frame.*stage.to == 0 || is_old) continue;
      times_ms.push_back(static_cast<double>(frame.*stage.to - frame.*stage.from) * kMsPerNs);
    }
    all.push_back({stage.name, times_ms.size(), quantile(times_ms, 0.5), quantile(times_ms, 0.9),
                   quantile(times_ms, 0.99), quantile(times_ms, 1.0)});
  }
  return all;
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
