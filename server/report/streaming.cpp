#include "server/report/streaming.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <charconv>
#include <cmath>
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

constexpr StreamSize kFullSizes[] = {{10'000, 16}, {2'228, 32}};
constexpr StreamSize kQuickSizes[] = {{1'000, 16}, {300, 32}};
constexpr double kPartSeconds = kSurveyPartS;
constexpr double kShortestSeconds = 0.2;  // more than kStartFrames
constexpr double kLongestSeconds = 60.0;
constexpr const char* kLatencyCodec = "tangent";

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

struct Plan {
  std::vector<StreamMotion> motions;
  std::vector<StreamSize> sizes;
  double seconds = 0.0;
};

Result<Plan> make_plan(const StreamingOptions& options) {
  Plan plan;
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
  for (const std::filesystem::path& path : options.motions) {
    ASSIGN_OR_RETURN(StreamMotion motion, load_stream_motion(path, options.motion_file));
    plan.motions.push_back(std::move(motion));
  }
  if (plan.motions.empty()) plan.motions = built_in_stream_motions();
  if (!options.solver.empty()) {
    if (const auto row = find_solver(options.solver); !row) return row.error();
  }
  for (const StreamSize& size : plan.sizes)
    for (const StreamMotion& motion : plan.motions)
      RETURN_IF_ERROR(check_recording({motion, size, plan.seconds, options.solver, nullptr}));
  return plan;
}

/// Our codecs at every bound; peers at the goals' bound, and at the others where a curve is drawn.
std::vector<StreamCodecRow> codecs_for(bool has_curve) {
  std::vector<StreamCodecRow> codecs = bound_free_stream_codecs();
  for (const double bound_m : kStreamBoundsM) {
    for (StreamCodecRow& row : own_stream_codecs(bound_m)) codecs.push_back(std::move(row));
    if (bound_m != kGoalBoundM && !has_curve) continue;
    for (StreamCodecRow& row : peer_stream_codecs(bound_m)) codecs.push_back(std::move(row));
  }
  return codecs;
}

class StreamingRun {
 public:
  StreamingRun(StreamingReport& report, Executor* executor, const StreamingOptions& options)
      : report_(report), executor_(executor), solver_(options.solver), progress_({"streaming"}) {}

  Status add(const StreamMotion& motion, const StreamSize& size, MotionPart part) {
    const std::string name = fmt::format("{}, {} part, {}", motion.name, to_string(part), to_string(size));
    progress_.expect(1, 0.0);
    progress_.begin_run(name + ": recording");
    auto recorded = record_strands({motion, size, report_.seconds, solver_, executor_, part});
    if (!recorded) return at(motion.name, recorded.error());
    progress_.end_run(0.0);
    StreamRecording& recording = *recorded;
    const bool has_curve =
        seen_.insert({recording.motion_level, size.strand_count, size.vertex_count}).second;
    const std::vector<StreamCodecRow> codecs = codecs_for(has_curve);
    const auto cost = static_cast<double>(size.vertices() * recording.frames.size());
    progress_.expect(static_cast<uint32_t>(codecs.size()), cost * static_cast<double>(codecs.size()));
    for (const StreamCodecRow& codec : codecs) {
      progress_.begin_run(fmt::format("{}: {}", name, codec.name));
      ASSIGN_OR_RETURN(StreamingRow row, measure_codec(codec, recording));
      report_.rows.push_back(std::move(row));
      progress_.end_run(cost);
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

 private:
  StreamingReport& report_;
  Executor* executor_;
  std::string solver_;
  Progress progress_;
  std::set<std::tuple<MotionLevel, uint32_t, uint32_t>> seen_;
  bool has_walk_latency_ = false;
};

}  // namespace

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
    errors.add(stream.decoded(), frame.position_in_head_m);
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
  row.codec = codec.name;
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
  report.solver = options.solver.empty() ? built_in_scene().solver.name : options.solver;
  report.processors = shared_workers().size();
  report.seconds = plan.seconds;
  StreamingRun run(report, executor.get(), options);
  for (const StreamSize& size : plan.sizes)
    for (const StreamMotion& motion : plan.motions) {
      for (const MotionPart part : kMotionParts) {
        RETURN_IF_ERROR(run.add(motion, size, part));
        RETURN_IF_ERROR(on_recording(report));
      }
    }
  return report;
}

}  // namespace strandcast
