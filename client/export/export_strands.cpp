#include "client/export/export_strands.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "client/export/frame_sampler.h"
#include "client/export/strand_writer.h"
#include "common/base/units.h"
#include "common/log/progress.h"

namespace strandcast {
namespace {

using MakeWriter = Result<std::unique_ptr<StrandWriter>> (*)(const ExportOptions&, const StrandSet&);

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

MakeWriter writer_for(const std::string& extension) {
  if (extension == ".usda") return make_usda_writer;
  if (extension == ".usdc" || extension == ".usdz") return make_usdc_writer;
  if (extension == ".abc") return make_abc_writer;
  if (extension == ".ply") return make_ply_writer;
  if (extension == ".csv") return make_csv_writer;
  return nullptr;
}

/// When frames are, and how they are numbered.
struct FramePlan {
  ExportOptions options;
  SampleRange range;
  std::string first_timecode;  // empty: frames are so many seconds after the first state
  std::string remark;          // for a person, empty = none
};

Error other_rate(const FrameRate& rate) {
  return make_error(ErrorCode::BadInput, "the states count {} frames per second: leave --fps out",
                    frame_rate_text(rate.hz()));
}

/// Whether frames are those of the states' timecode: where it is asked for, or of all states where it counts
/// as frames do.
Result<bool> goes_by_timecode(const ExportOptions& options, const TimecodeTrack& track, int64_t first_ns) {
  const std::optional<Timecode> count = track.first();
  const bool is_asked = !options.from_timecode.empty() || !options.to_timecode.empty();
  if (!count && is_asked)
    return make_error(ErrorCode::BadInput, "the states carry no timecode: say seconds after the first state");
  const bool is_of_count = count && (!options.has_fps || options.fps == count->rate);
  if (is_asked && !is_of_count) return other_rate(count->rate);
  const bool is_all = options.from_s == 0.0 && !options.to_s && !options.is_one_frame;
  return is_asked || (is_of_count && is_all && track.is_whole(first_ns));
}

/// Frames at the states' timecode.
Status plan_by_timecode(const TimecodeTrack& track, const FrameRate& rate, FramePlan& plan) {
  std::optional<Timecode> from, to;
  if (!plan.options.from_timecode.empty()) {
    ASSIGN_OR_RETURN(from, parse_timecode(plan.options.from_timecode, rate));
  }
  if (!plan.options.to_timecode.empty()) {
    ASSIGN_OR_RETURN(to, parse_timecode(plan.options.to_timecode, rate));
  }
  if (from && plan.options.to_s) to = advanced(*from, *plan.options.to_s * rate.hz());
  plan.options.to_s = plan.range.to_s = std::nullopt;
  ASSIGN_OR_RETURN(TimecodeTrack::Frames frames, track.frames(from, to));
  if (frames.time_ns.empty())
    return make_error(ErrorCode::BadInput, "no whole frame lies between the states of this range");
  plan.options.fps = plan.range.fps = rate;
  plan.options.first_number = frames.first.frame;
  plan.first_timecode = timecode_text(frames.first);
  const auto count = static_cast<double>(frames.time_ns.size());
  if (to && is_same_count(*to, frames.first) && frames_between(frames.first, *to) + 1.0 > count + 0.5)
    plan.remark = fmt::format("it ends at {}, where timecode jumps or the states end",
                              timecode_text(advanced(frames.first, count - 1.0)));
  plan.range.time_ns = std::move(frames.time_ns);
  return {};
}

/// Frames at the timecode that a running server counts, from its next whole frame or the one asked for.
Status count_on(const CountedState& now, FramePlan& plan) {
  ExportOptions& options = plan.options;
  const FrameRate& rate = now.timecode.rate;
  const bool is_asked = !options.from_timecode.empty() || !options.to_timecode.empty();
  const bool is_of_count = !options.has_fps || options.fps == rate;
  if (is_asked && !is_of_count) return other_rate(rate);
  if (!is_of_count || options.is_one_frame || (options.from_s > 0.0 && !is_asked)) return {};
  const double passed_s = static_cast<double>(*plan.range.first_ns - now.sim_time_ns) / kNsPerS;
  const Timecode first = advanced(now.timecode, passed_s * rate.hz());
  constexpr double kSamePart = 1e-6;  // of a frame
  Timecode from = advanced(first, first.part > kSamePart ? 1.0 - first.part : 0.0);
  if (!options.from_timecode.empty()) {
    ASSIGN_OR_RETURN(from, parse_timecode(options.from_timecode, rate));
  }
  from.part = 0.0;
  const double waited = frames_between(first, from);
  if (waited < -kSamePart)
    return make_error(ErrorCode::BadInput, "it is {} already, {} is over", timecode_text(first),
                      timecode_text(from));
  options.from_s = plan.range.from_s = std::max(0.0, waited) / rate.hz();
  if (options.to_s && !options.from_timecode.empty()) *options.to_s += options.from_s;
  if (!options.to_timecode.empty()) {
    ASSIGN_OR_RETURN(const Timecode to, parse_timecode(options.to_timecode, rate));
    options.to_s = frames_between(first, to) / rate.hz();
    if (*options.to_s < options.from_s)
      return make_error(ErrorCode::BadInput, "the end, {}, is before the beginning, {}", timecode_text(to),
                        timecode_text(from));
  }
  plan.range.to_s = options.to_s;
  options.fps = plan.range.fps = rate;
  options.first_number = from.frame;
  plan.first_timecode = timecode_text(from);
  return {};
}

Result<FramePlan> plan_frames(ExportSource& source, const ExportOptions& options) {
  FramePlan plan{options, {options.fps, options.from_s, options.to_s}, {}, {}};
  const TimecodeTrack& track = source.timecodes();
  ASSIGN_OR_RETURN(plan.range.first_ns, source.skip_to(0.0));
  if (const auto running = source.counted(); running && plan.range.first_ns) {
    RETURN_IF_ERROR(count_on(*running, plan));
    return plan;
  }
  ASSIGN_OR_RETURN(const bool is_by_timecode,
                   goes_by_timecode(options, track, plan.range.first_ns.value_or(0)));
  if (is_by_timecode) RETURN_IF_ERROR(plan_by_timecode(track, track.first()->rate, plan));
  if (!is_by_timecode && track.first() && !options.has_fps)
    plan.options.fps = plan.range.fps = track.first()->rate;
  if (!is_by_timecode && track.first() && !options.is_one_frame)
    plan.remark = fmt::format("frames count from 1, not by timecode ({}): {}", track.text(),
                              options.has_fps && options.fps != track.first()->rate
                                  ? "leave --fps out"
                                  : "--from and --to name a part of it");
  if (is_by_timecode && plan.range.first_ns)
    plan.options.from_s =
        std::max(0.0, static_cast<double>(plan.range.time_ns.front() - *plan.range.first_ns) / kNsPerS);
  if (plan.options.from_s > 0.0) RETURN_IF_ERROR(source.skip_to(plan.options.from_s));
  return plan;
}

/// One export from the first state to the end of the file.
class Export {
 public:
  Export(ExportSource& source, const FramePlan& plan)
      : source_(source),
        options_(plan.options),
        sampler_(plan.range,
                 StrandFill(source.scene().asset->rest_position_m, source.scene().asset->vertex_count)),
        progress_({"export", options_.is_quiet, "frame"}) {
    report_.fps = options_.fps.hz();
    report_.first_timecode = plan.first_timecode;
    if (!plan.remark.empty()) report_.remarks.push_back(plan.remark);
    const ExportOptions& options = options_;
    if (const auto count = static_cast<uint32_t>(plan.range.time_ns.size()); count > 0) {
      progress_.expect(count, count);
    } else if (options.to_s) {
      const auto frames = static_cast<uint32_t>((*options.to_s - options.from_s) * options.fps.hz()) + 1;
      progress_.expect(frames, frames);
    }
  }

  Status run(const std::atomic<bool>& stop) {
    while (!stop && !sampler_.is_done() && !is_whole_) {
      auto state = source_.next();
      if (!state && (report_.frame_count == 0 || options_.is_whole)) return state.error();
      if (!state) report_.remarks.push_back(fmt::format("it ends early: {}", state.error().to_string()));
      if (!state || *state == nullptr) break;
      const SceneAsset& asset = *source_.scene().asset;
      if ((*state)->strand_count < asset.strand_count) ++thin_states_;
      if (sampler_.add(*state) == FrameSampler::Outcome::WentBack) {
        report_.remarks.emplace_back("it ends where the simulation was reset");
        break;
      }
      RETURN_IF_ERROR(write_frames());
    }
    if (stop && options_.is_whole && !sampler_.is_done())
      return make_error(ErrorCode::Unavailable, "stopped: nothing is left of it");
    sampler_.finish();
    return write_frames();
  }

  Result<ExportReport> finish() {
    if (!writer_)
      return make_error(ErrorCode::BadInput,
                        "there is no state {:.6g} s after the first one: nothing to export", options_.from_s);
    ASSIGN_OR_RETURN(const WrittenBytes written, writer_->finish());
    report_.fps = options_.fps.hz();
    report_.file_count = written.files;
    report_.bytes = written.bytes;
    report_.last_path = written.last_path;
    report_.strand_count = strands_->strand_count();
    report_.vertex_count = strands_->vertex_count();
    add_remarks();
    return std::move(report_);
  }

 private:
  Status write_frames() {
    while (!is_whole_) {
      const std::optional<SampledFrame> frame = sampler_.next();
      if (!frame) return {};
      RETURN_IF_ERROR(write(*frame));
      is_whole_ = options_.is_one_frame;
    }
    return {};
  }

  Status write(const SampledFrame& frame) {
    if (!writer_) {
      strands_.emplace(source_.scene(), options_, frame.strands);
      if (strands_->strand_count() == 0)
        return make_error(ErrorCode::BadInput, "none of {} strands has a length", strands_->left_out_count());
      ASSIGN_OR_RETURN(writer_, writer_for(extension_of(options_.path))(options_, *strands_));
      report_.first_s = frame.time_s;
      if (options_.has_head && strands_->head_triangles().empty())
        report_.remarks.emplace_back("the scene shows no head: there is none in the file");
    }
    progress_.begin_run(options_.path.string());
    const std::vector<glm::dvec3> points = strands_->points(frame.strands);
    if (strands_->collapsed_count(points) > 0) ++collapsed_frames_;
    RETURN_IF_ERROR(writer_->write({options_.first_number + static_cast<int64_t>(frame.index), frame.time_s,
                                    points, frame.strands.world_from_head}));
    progress_.end_run(1.0);
    ++report_.frame_count;
    return {};
  }

  void add_remarks() {
    std::vector<std::string>& remarks = report_.remarks;
    if (strands_->left_out_count() > 0)
      remarks.push_back(
          fmt::format("{} strands of no length are left out of all frames", strands_->left_out_count()));
    if (collapsed_frames_ > 0)
      remarks.push_back(fmt::format(
          "in {} frames strands lost their length: programs may refuse these curves", collapsed_frames_));
    if (thin_states_ > 0)
      remarks.push_back(
          fmt::format("{} states came with fewer strands, the others were filled in: the link was too "
                      "slow for all",
                      thin_states_));
    for (std::string& remark : source_.remarks()) remarks.push_back(std::move(remark));
  }

  ExportSource& source_;
  const ExportOptions options_;
  FrameSampler sampler_;
  std::optional<StrandSet> strands_;  // once the first frame is there; the writer refers to it
  std::unique_ptr<StrandWriter> writer_;
  Progress progress_;
  ExportReport report_;
  bool is_whole_ = false;
  uint64_t collapsed_frames_ = 0;
  uint64_t thin_states_ = 0;
};

}  // namespace

Status check_export(const ExportOptions& options) {
  const std::string extension = extension_of(options.path);
  const auto fail = [&](ErrorCode code, std::string_view sentence) {
    return at(options.path.string(), make_error(code, "{}", sentence));
  };
  if (writer_for(extension) == nullptr)
    return fail(ErrorCode::BadInput,
                "the extension says the format; known are .usda, .usdc, .usdz, .abc, .ply and .csv");
  if (options.has_head && extension == ".csv")
    return fail(ErrorCode::BadInput, "a table has no head: leave --head out, or export USD, .abc or .ply");
  if (!std::isfinite(options.from_s) || options.from_s < 0.0)
    return make_error(ErrorCode::BadInput, "the beginning is {} s, it has to be 0 or later", options.from_s);
  if (options.to_s && !(*options.to_s >= options.from_s))
    return make_error(ErrorCode::BadInput, "the end, {} s, is before the beginning, {} s", *options.to_s,
                      options.from_s);
  return {};
}

Result<ExportReport> export_strands(ExportSource& source, const ExportOptions& options,
                                    const std::atomic<bool>& stop) {
  RETURN_IF_ERROR(check_export(options));
  ASSIGN_OR_RETURN(const FramePlan plan, plan_frames(source, options));
  Export run(source, plan);
  RETURN_IF_ERROR(run.run(stop));
  return run.finish();
}

}  // namespace strandcast
