#include "server/report/streaming.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <optional>
#include <set>

#include "common/base/check.h"
#include "common/base/profile.h"
#include "common/base/worker_pool.h"
#include "common/log/progress.h"
#include "server/report/peers/peer_codecs.h"
#include "server/report/report_executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

// The first is what plots and goals are of; the second the built-in scene's.
constexpr StreamSize kFullSizes[] = {{10'000, 16}, {2'000, 16}, {2'228, 32}};
constexpr StreamSize kQuickSizes[] = {{1'000, 16}, {300, 32}};
constexpr double kPartSeconds = kSurveyPartS;
constexpr double kShortestSeconds = 0.2;  // more than kStartFrames
constexpr double kLongestSeconds = 60.0;
constexpr const char* kLatencyCodec = "tangent";
// Strand models that move otherwise than the built-in scene's: a rod with the constants of hair, and springs.
constexpr const char* kOtherSolvers[] = {"direct_rod", "mass_spring"};
// For the progress shown: of a recording in runs of a codec, and of a step of the view in vertices of those.
constexpr double kRecordingCost = 3.0;
constexpr double kViewCostPerPixel = 10.0;
constexpr double kViewCodecShare = 1.0 / 6.0;  // of a run of a codec: few of the steps code strands
constexpr uint32_t kLeastViewSide = 64;
constexpr RenderSize kFullView{1280, 720};
constexpr RenderSize kQuickView{320, 180};
constexpr RenderSize kPlayoutView{640, 360};

struct Clock {
  double wall_ms = 0.0;
  double cpu_ms = 0.0;
};

Clock clock_now() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  return {static_cast<double>(now_ns()) * 1e-6,
          static_cast<double>(cpu.tv_sec) * 1e3 + static_cast<double>(cpu.tv_nsec) * 1e-6};
}

class StageClock {
 public:
  template <class Work>
  auto time(Work work) {
    const Clock begin = clock_now();
    auto result = work();
    const Clock end = clock_now();
    wall_.add_ms(end.wall_ms - begin.wall_ms);
    cpu_.add_ms(end.cpu_ms - begin.cpu_ms);
    return result;
  }
  double wall_ms() const { return wall_.median_ms(); }
  double cpu_ms() const { return cpu_.median_ms(); }

 private:
  StageTimer wall_;
  StageTimer cpu_;
};

/// Distances of all vertices of all frames so far.
struct ErrorSum {
  double largest_m = 0.0;
  double square_sum_m2 = 0.0;
  double count = 0.0;

  void add(const std::vector<glm::vec3>& decoded, const std::vector<glm::vec3>& recorded) {
    CHECK(decoded.size() == recorded.size());
    double largest_m2 = 0.0;
    for (size_t i = 0; i < decoded.size(); ++i) {
      const glm::dvec3 off = glm::dvec3(decoded[i]) - glm::dvec3(recorded[i]);
      // What is not a number misses every bound.
      const double square_m2 = std::isnan(glm::dot(off, off)) ? INFINITY : glm::dot(off, off);
      square_sum_m2 += square_m2;
      largest_m2 = std::max(largest_m2, square_m2);
    }
    count += static_cast<double>(decoded.size());
    largest_m = std::max(largest_m, std::sqrt(largest_m2));
  }
};

Result<StreamSize> parse_size(const std::string& text) {
  StreamSize size;
  const char* end = text.data() + text.size();
  const auto [x, first] = std::from_chars(text.data(), end, size.strand_count);
  const bool has_x = first == std::errc() && x != end && *x == 'x';
  const auto [rest, second] = std::from_chars(has_x ? x + 1 : end, end, size.vertex_count);
  const bool is_whole = has_x && second == std::errc() && rest == end;
  if (!is_whole || size.strand_count == 0 || size.strand_count > kMaxStrandCount ||
      size.vertex_count < kMinVertexCount || size.vertex_count > kMaxVertexCount)
    return make_error(ErrorCode::BadInput,
                      "--size is '{}' (allowed: STRANDSxVERTICES, at most {} strands of {} to {} vertices)",
                      text.substr(0, 32), kMaxStrandCount, kMinVertexCount, kMaxVertexCount);
  return size;
}

StreamSize built_in_size() {
  const SceneDesc scene = built_in_scene();
  const auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  return {groom.strand_count, groom.vertex_count};
}

/// Even, as H.264 takes them.
Result<RenderSize> parse_view(const std::string& text) {
  RenderSize size{0, 0};
  int read = 0;
  const bool is_whole = std::sscanf(text.c_str(), "%5ux%5u%n", &size.width, &size.height, &read) == 2 &&
                        static_cast<size_t>(read) == text.size();
  if (!is_whole || size.width % 2 != 0 || size.height % 2 != 0 ||
      std::min(size.width, size.height) < kLeastViewSide || size.width > kMaxPictureWidth ||
      size.height > kMaxPictureHeight)
    return make_error(ErrorCode::BadInput, "--view is '{}' (allowed: WIDTHxHEIGHT, even, {} to {} x {})",
                      text.substr(0, 32), kLeastViewSide, kMaxPictureWidth, kMaxPictureHeight);
  return size;
}

struct Plan {
  std::vector<StreamMotion> motions;
  std::vector<std::string> clip_notes;
  std::vector<std::string> solvers;
  std::vector<StreamCase> cases;
  StreamViewDesc view;
  size_t view_motion = 0;  // index
  StreamPlayoutDesc playout;
  std::optional<size_t> playout_clip;  // a captured head beside it
  StreamSize view_strands;
  std::vector<StreamSize> sizes;
  double seconds = 0.0;
};

/// What can be refused at once comes before files are looked for.
Status plan_settings(const StreamingOptions& options, Plan& plan) {
  for (const std::string& text : options.sizes) {
    ASSIGN_OR_RETURN(const StreamSize size, parse_size(text));
    plan.sizes.push_back(size);
  }
  if (plan.sizes.empty() && options.is_quick)
    plan.sizes.assign(std::begin(kQuickSizes), std::end(kQuickSizes));
  if (plan.sizes.empty()) plan.sizes.assign(std::begin(kFullSizes), std::end(kFullSizes));
  plan.seconds = kPartSeconds;
  if (options.seconds != 0.0) plan.seconds = options.seconds;
  if (!(plan.seconds >= kShortestSeconds && plan.seconds <= kLongestSeconds))
    return make_error(ErrorCode::BadInput, "--seconds is {:g} (allowed: {:g} to {:g})", plan.seconds,
                      kShortestSeconds, kLongestSeconds);
  for (const std::string& solver : options.solvers)
    if (std::find(plan.solvers.begin(), plan.solvers.end(), solver) == plan.solvers.end())
      plan.solvers.push_back(solver);
  if (plan.solvers.empty()) {
    plan.solvers = {built_in_scene().solver.name};
    if (!options.is_quick)
      plan.solvers.insert(plan.solvers.end(), std::begin(kOtherSolvers), std::end(kOtherSolvers));
  }
  for (const std::string& solver : plan.solvers)
    if (const auto row = find_solver(solver); !row) return row.error();
  plan.view_strands = options.sizes.empty() ? built_in_size() : plan.sizes.front();
  plan.view.size = options.is_quick ? kQuickView : kFullView;
  if (options.view.empty()) return {};
  ASSIGN_OR_RETURN(plan.view.size, parse_view(options.view));
  return {};
}

Status check_recordings(const std::vector<StreamMotion>& motions, const Plan& plan) {
  for (const StreamSize& size : plan.sizes)
    for (const StreamMotion& motion : motions)
      RETURN_IF_ERROR(check_recording({motion, size, plan.seconds, "", nullptr}));
  return {};
}

Status plan_motions(const StreamingOptions& options, Plan& plan) {
  for (const std::filesystem::path& path : options.motions) {
    ASSIGN_OR_RETURN(StreamMotion motion, load_stream_motion(path, options.motion_file));
    plan.motions.push_back(std::move(motion));
  }
  if (plan.motions.empty()) plan.motions = built_in_stream_motions();
  RETURN_IF_ERROR(check_recordings(plan.motions, plan));
  if (options.clips.empty()) return {};
  ASSIGN_OR_RETURN(FoundClips found, find_stream_clips(options.clips, options.motion_file));
  plan.clip_notes = std::move(found.notes);
  for (StreamMotion& clip : found.motions) {
    if (clip.duration_s >= plan.seconds)
      plan.motions.push_back(std::move(clip));
    else
      plan.clip_notes.push_back(
          fmt::format("{} is left out: it lasts {:.1f} s.", clip.name, clip.duration_s));
  }
  return {};
}

/// Walking where there is any; nothing when no other captured head than that of the view is there.
std::optional<size_t> captured_clip(const Plan& plan, const std::vector<MotionLevel>& levels) {
  std::optional<size_t> found;
  for (size_t i = 0; i < plan.motions.size(); ++i) {
    const bool is_captured = std::isfinite(plan.motions[i].duration_s);
    if (!is_captured || i == plan.view_motion) continue;
    if (!found || (levels[i] == MotionLevel::Active && levels[*found] != MotionLevel::Active)) found = i;
  }
  return found;
}

Result<Plan> make_plan(const StreamingOptions& options) {
  Plan plan;
  RETURN_IF_ERROR(plan_settings(options, plan));
  RETURN_IF_ERROR(plan_motions(options, plan));
  std::vector<MotionLevel> levels;
  for (const StreamMotion& motion : plan.motions) levels.push_back(survey_motion(motion, plan.seconds).level);
  plan.cases = stream_cases(levels, plan.solvers, plan.sizes);
  // Walking where there is any.
  const auto walk = std::find(levels.begin(), levels.end(), MotionLevel::Active);
  if (walk != levels.end()) plan.view_motion = static_cast<size_t>(walk - levels.begin());
  plan.playout_clip = captured_clip(plan, levels);
  plan.playout.size = {std::min(plan.view.size.width, kPlayoutView.width),
                       std::min(plan.view.size.height, kPlayoutView.height)};
  return plan;
}

/// Our codecs at every bound; peers at the goals' bound, and at the others where a curve is drawn.
std::vector<StreamCodecRow> codecs_for(const StreamCase& one) {
  std::vector<StreamCodecRow> codecs;
  if (one.has_peers) codecs = bound_free_stream_codecs();
  for (const double bound_m : kStreamBoundsM) {
    for (StreamCodecRow& row : own_stream_codecs(bound_m)) codecs.push_back(std::move(row));
    if (bound_m == kGoalBoundM) codecs.push_back(exact_stream_codec(bound_m));
    if (!one.has_peers || (bound_m != kGoalBoundM && !one.has_curve_of_peers)) continue;
    for (StreamCodecRow& row : peer_stream_codecs(bound_m)) codecs.push_back(std::move(row));
  }
  return codecs;
}

class StreamingRun {
 public:
  StreamingRun(StreamingReport& report, Executor* executor, const Plan& plan)
      : report_(report), executor_(executor), plan_(plan), progress_({"streaming"}) {
    const uint32_t playouts = plan.playout_clip ? 2 : 1;
    progress_.expect(playouts, playouts * playout_cost());
    progress_.expect(1 + view_step_count(),
                     kRecordingCost * codec_cost(plan.view_strands) + view_cost() * view_step_count());
    for (const StreamCase& one : plan.cases) {
      const size_t codecs = codecs_for(one).size();
      progress_.expect(static_cast<uint32_t>(1 + codecs),
                       (kRecordingCost + static_cast<double>(codecs)) * codec_cost(one.size));
    }
  }

  Status add(const StreamCase& one) {
    const StreamMotion& motion = plan_.motions[one.motion];
    const std::string name =
        fmt::format("{}, {} part, {}, {}", motion.name, to_string(one.part), one.solver, to_string(one.size));
    progress_.begin_run(name + ": recording");
    auto recorded = record_strands({motion, one.size, report_.seconds, one.solver, executor_, one.part});
    if (!recorded) return at(motion.name, recorded.error());
    progress_.end_run(kRecordingCost * codec_cost(one.size));
    StreamRecording& recording = *recorded;
    for (const StreamCodecRow& codec : codecs_for(one)) {
      progress_.begin_run(fmt::format("{}: {}", name, codec.name));
      const StepTrail* trail = recording.frames.back().published.trail.get();
      const bool is_stepped = trail != nullptr && trail->model != nullptr;
      if (codec.name != kExactCodec || is_stepped) {
        ASSIGN_OR_RETURN(StreamingRow row, measure_codec(codec, recording));
        report_.rows.push_back(std::move(row));
      }
      progress_.end_run(codec_cost(one.size));
    }
    // Walking on the first size, or whatever comes first.
    const bool is_walk = recording.motion_level == MotionLevel::Active;
    if (report_.latency.stages.empty() || (is_walk && !has_walk_latency_)) {
      ASSIGN_OR_RETURN(report_.latency, measure_latency(recording, kLatencyCodec, kGoalBoundM));
      has_walk_latency_ = is_walk;
    }
    recording.frames.clear();
    report_.recordings.push_back(std::move(recording));
    return {};
  }

  /// In the built-in scene's strands or, where sizes were asked for, in the first.
  Status add_view() {
    progress_.begin_run("view: recording");
    const RecordingDesc desc{plan_.motions[plan_.view_motion], plan_.view_strands, report_.seconds,
                             report_.solver, executor_};
    ASSIGN_OR_RETURN(const StreamRecording recording, record_strands(desc));
    progress_.end_run(kRecordingCost * codec_cost(plan_.view_strands));
    uint32_t left = view_step_count();
    const auto on_progress = [&](const std::string& doing) {
      if (left == 0) return;
      --left;
      progress_.begin_run("view: " + doing);
      progress_.end_run(view_cost());
    };
    ASSIGN_OR_RETURN(report_.view, measure_view(plan_.view, recorded_scene(desc), recording, on_progress));
    while (left > 0) on_progress("done");
    RETURN_IF_ERROR(add_playout(desc, recording));
    return add_captured_playout(desc);
  }

 private:
  Status add_playout(const RecordingDesc& desc, const StreamRecording& recording) {
    progress_.begin_run("playout: " + desc.motion.name);
    ASSIGN_OR_RETURN(const std::vector<PlayoutRow> rows,
                     measure_playout(plan_.playout, recorded_scene(desc), recording));
    report_.playout.insert(report_.playout.end(), rows.begin(), rows.end());
    progress_.end_run(playout_cost());
    return {};
  }

  Status add_captured_playout(RecordingDesc desc) {
    if (!plan_.playout_clip) {
      report_.playout_note =
          "No captured head was there to show between states, too (--clips FOLDER brings some).";
      return {};
    }
    desc.motion = plan_.motions[*plan_.playout_clip];
    ASSIGN_OR_RETURN(const StreamRecording recording, record_strands(desc));
    return add_playout(desc, recording);
  }

  double playout_cost() const {
    return kViewCostPerPixel * static_cast<double>(plan_.playout.size.width) * plan_.playout.size.height;
  }
  double codec_cost(const StreamSize& size) const {
    return static_cast<double>(size.vertices()) * report_.seconds / kStreamFrameS;
  }
  double view_cost() const {
    return kViewCostPerPixel * static_cast<double>(plan_.view.size.width) * plan_.view.size.height +
           kViewCodecShare * codec_cost(plan_.view_strands);
  }

  StreamingReport& report_;
  Executor* executor_;
  const Plan& plan_;
  Progress progress_;
  bool has_walk_latency_ = false;
};

}  // namespace

std::vector<StreamCase> stream_cases(const std::vector<MotionLevel>& motion_levels,
                                     const std::vector<std::string>& solvers,
                                     const std::vector<StreamSize>& sizes) {
  std::vector<StreamCase> cases;
  for (const std::string& solver : solvers)
    for (size_t size = 0; size < sizes.size(); ++size) {
      const bool is_first = solver == solvers.front();
      if (!is_first && size > 0) continue;
      std::set<MotionLevel> seen;
      for (size_t motion = 0; motion < motion_levels.size(); ++motion)
        for (const MotionPart part : kMotionParts)
          cases.push_back({motion, solver, sizes[size], part, is_first,
                           is_first && seen.insert(motion_levels[motion]).second});
    }
  return cases;
}

Result<StreamingRow> measure_codec(const StreamCodecRow& codec, const StreamRecording& recording) {
  const auto named = [&](const Error& error) { return at(codec.name, error); };
  auto made = codec.make(recording.shape);
  if (!made) return named(made.error());
  StreamCodec& stream = **made;
  StageClock encode;
  StageClock decode;
  ErrorSum errors;
  double bytes = 0.0;
  double start_bytes = 0.0;
  // The last frame is kept for somebody who joins.
  const size_t count = recording.frames.size() - 1;
  CHECK(count > kStartFrames);
  for (size_t i = 0; i < count; ++i) {
    const StreamFrame& frame = recording.frames[i];
    if (auto status = stream.take(frame); !status) return named(status.error());
    auto message = encode.time([&] { return stream.encode(); });
    if (!message) return named(message.error());
    if (auto status = decode.time([&] { return stream.decode(*message); }); !status)
      return named(status.error());
    errors.add(stream.decoded(), stream.meant(frame));
    (i < kStartFrames ? start_bytes : bytes) += static_cast<double>(message->size());
  }
  auto join_bytes = stream.join_bytes(recording.frames.back());
  if (!join_bytes) return named(join_bytes.error());

  StreamingRow row;
  row.motion = recording.motion_name;
  row.moved_by = recording.moved_by;
  row.motion_level = recording.motion_level;
  row.part = recording.part;
  row.size = {recording.shape.strand_count, recording.shape.vertex_count};
  row.solver = recording.solver;
  row.codec = codec.name;
  if (codec.wind) row.wind = to_string(*codec.wind);
  row.is_ours = codec.is_ours;
  row.is_temporal = codec.is_temporal;
  row.is_bound_free = codec.is_bound_free;
  row.bound_m = codec.bound_m;
  const double bits_per_byte = 8.0 / static_cast<double>(row.size.vertices());
  row.bits = bytes / static_cast<double>(count - kStartFrames) * bits_per_byte;
  row.all_bits = (start_bytes + bytes) / static_cast<double>(count) * bits_per_byte;
  row.join_bits = static_cast<double>(*join_bytes) * bits_per_byte;
  row.max_error_m = errors.largest_m;
  row.rms_error_m = std::sqrt(errors.square_sum_m2 / errors.count);
  row.encode_cpu_ms = encode.cpu_ms();
  row.encode_wall_ms = encode.wall_ms();
  row.decode_cpu_ms = decode.cpu_ms();
  row.decode_wall_ms = decode.wall_ms();
  return row;
}

Result<StreamingReport> measure_streaming(const StreamingOptions& options,
                                          const std::function<Status(const StreamingReport&)>& on_recording) {
  ASSIGN_OR_RETURN(const Plan plan, make_plan(options));
  ASSIGN_OR_RETURN(const auto executor, open_report_executor(options.device));
  StreamingReport report;
  report.is_quick = options.is_quick;
  report.device = executor ? executor->info().name : "the processor, in double precision";
  report.solver = plan.solvers.front();
  report.clip_notes = plan.clip_notes;
  report.processors = shared_workers().size();
  report.seconds = plan.seconds;
  StreamingRun run(report, executor.get(), plan);
  RETURN_IF_ERROR(run.add_view());
  for (const StreamCase& one : plan.cases) {
    RETURN_IF_ERROR(run.add(one));
    RETURN_IF_ERROR(on_recording(report));
  }
  return report;
}

}  // namespace strandcast
