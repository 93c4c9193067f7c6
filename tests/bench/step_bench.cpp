// What the codec "step" takes beside "tangent" on the same frames of the server's own solvers, told all of
// the wind, its mean or nothing: bits a vertex, CPU milliseconds of both sides, and the largest error. One
// thread per side. --classes yes: what every class of strands takes against the first, by both codecs.
// --shared yes: what an encoder takes while the simulation goes on from its viewers' strands. --recorded yes:
// what a second of it takes in a recording, and how long its slowest moment takes to show. --joined yes: how
// far hair is from where it would be without a joiner every second.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/strands/shared_strands.h"
#include "common/strands/strand_codec.h"
#include "common/strands/strand_prefix.h"
#include "server/encode/strand_encode_worker.h"
#include "server/net/strand_class.h"
#include "server/record/recorder.h"
#include "server/report/shared_run.h"
#include "server/report/stream_codec.h"
#include "server/report/stream_recording.h"
#include "server/scene/step_log.h"
#include "server/sim/executor/lanes_executor.h"

namespace strandcast {
namespace {

struct Options {
  StreamSize size{2000, 16};
  std::string solver = "dftl";
  std::string motion;  // a .bvh file; else "active"
  double seconds = 3.0;
  double bound_m = 1e-4;
  MotionPart part = MotionPart::Median;
  bool has_classes = false;
  bool has_shared = false;
  bool has_recorded = false;
  bool has_joined = false;
};

constexpr size_t kStart = 9;

int64_t cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

double largest_error_m(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
  double largest = 0.0;
  for (size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, static_cast<double>(glm::distance(glm::dvec3(a[i]), glm::dvec3(b[i]))));
  return largest;
}

struct ClassCost {
  double bytes_per_s = 0.0;
  double encode_ms = 0.0, decode_ms = 0.0;  // CPU, of a state
};

/// As the server encodes a class and its viewers decode it.
Result<ClassCost> measure_class(const StreamRecording& recording, const std::string& codec, float quantum_m,
                                const StrandClass& row) {
  const StreamShape& shape = recording.shape;
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder(codec));
  ASSIGN_OR_RETURN(const auto decoder, make_strand_decoder(codec, {shape.strand_count, shape.vertex_count}));
  encoder->set_rest_shape(shape.rest_in_head_m);
  decoder->set_rest_shape(shape.rest_in_head_m);
  ClassCost cost;
  double bytes = 0.0, states = 0.0;
  for (size_t i = 0; i < recording.frames.size(); i += row.rate_divisor) {
    Snapshot state = on_lattice(recording.frames[i], quantum_m);
    if (row.strand_share < 1.0f) state = prefix_of(state, prefix_count(shape.strand_count, row.strand_share));
    state = coarsen(state, row.coarsening);
    const int64_t begin_ns = cpu_ns();
    const EncodedFramePtr frame = encoder->encode(state);
    const int64_t encoded_ns = cpu_ns();
    if (frame == nullptr) return make_error(ErrorCode::LimitExceeded, "a frame is too large");
    ASSIGN_OR_RETURN(const auto decoded, decoder->decode(frame->message));
    if (i < kStart * row.rate_divisor) continue;
    bytes += static_cast<double>(frame->message.size());
    cost.encode_ms += static_cast<double>(encoded_ns - begin_ns) * 1e-6;
    cost.decode_ms += static_cast<double>(cpu_ns() - encoded_ns) * 1e-6;
    states += 1.0;
  }
  cost.bytes_per_s = bytes / states * row.frame_rate_hz;
  cost.encode_ms /= states;
  cost.decode_ms /= states;
  return cost;
}

/// Bytes of the classes against the first one, beside what the server expects.
Status compare_classes(const StreamRecording& recording, double bound_m) {
  StrandStreamPlan plan;
  plan.step_rate_hz = 1.0 / kStreamFrameS;
  plan.bound_m = static_cast<float>(bound_m);
  plan.strand_count = recording.shape.strand_count;
  for (const char* codec : {"tangent", "step"}) {
    ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(codec, plan.bound_m));
    ASSIGN_OR_RETURN(const StrandCodecInfo info, strand_codec_info(codec));
    const std::vector<StrandClass> classes = make_strand_classes(plan);
    double first = 0.0;
    for (const StrandClass& row : classes) {
      ASSIGN_OR_RETURN(const ClassCost cost, measure_class(recording, codec, quantum_m, row));
      if (first == 0.0) first = cost.bytes_per_s;
      const double expected =
          expected_bytes_per_s(info.bytes, {classes[0], first / classes[0].frame_rate_hz}, row);
      fmt::print(
          "{:8} {:36} {:>7.3f} Mbit/s {:>6.4f} of the first, expected {:>6.4f}; encode {:>5.2f} ms "
          "decode {:>5.2f} ms\n",
          codec, to_string(row), 8e-6 * cost.bytes_per_s, cost.bytes_per_s / first, expected / first,
          cost.encode_ms, cost.decode_ms);
    }
  }
  return {};
}

/// As a recorder asks for keyframes, of strands that are shared or not.
Status measure_recorded(const StreamRecording& recording, double bound_m, bool shares) {
  const StreamShape& shape = recording.shape;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m("step", static_cast<float>(bound_m)));
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder("step"));
  ASSIGN_OR_RETURN(const auto decoder, make_strand_decoder("step", {shape.strand_count, shape.vertex_count}));
  encoder->set_rest_shape(shape.rest_in_head_m);
  decoder->set_rest_shape(shape.rest_in_head_m);
  SharedRun shared(quantum_m);
  StepLog costs;
  SeekCost cost(true);
  double keyframe_bytes = 0.0, delta_bytes = 0.0, keyframes = 0.0, exact = 0.0;
  int64_t seek_ns = 0, longest_ns = 0, keyframe_ns = 0, begin_ns = 0;
  bool is_due = false;
  for (const StreamFrame& frame : recording.frames) {
    Snapshot state = shared.published(frame);
    shared.step(state);
    encoder->set_state(shared.copy());
    shared.put_strands(state);
    EncodedFramePtr written = is_due ? encoder->encode_for_join(state).keyframe : encoder->encode(state);
    const auto update = encoder->take_shared(SharedStates::Told);
    if (shares) shared.follow(update, state);
    const int64_t decode_ns = cpu_ns();
    ASSIGN_OR_RETURN(const auto decoded, decoder->decode(written->message));
    seek_ns += cpu_ns() - decode_ns;
    const bool is_keyframe = written->header.opcode == Opcode::StrandKeyframe;
    (is_keyframe ? keyframe_bytes : delta_bytes) += static_cast<double>(written->message.size());
    keyframes += is_keyframe ? 1.0 : 0.0;
    exact += is_exact(*written) ? 1.0 : 0.0;
    if (is_keyframe) {
      cost = SeekCost(true);
      seek_ns = 0;
      keyframe_ns = state.sim_time_ns;
      if (keyframes == 2.0) {  // the first was before any step
        begin_ns = keyframe_ns;
        keyframe_bytes = delta_bytes = exact = 0.0;
        longest_ns = 0;
      }
    } else {
      costs.set_model(state.trail->model);
      costs.set_scene(*state.trail->scene);
      cost.add({is_exact(*written), decoded->plane_size(), costs.step_cost() * state.trail->scene->substeps});
    }
    longest_ns = std::max(longest_ns, seek_ns);
    is_due = cost.is_keyframe_due(state.sim_time_ns - keyframe_ns);
  }
  const double seconds =
      static_cast<double>(recording.frames.back().published.sim_time_ns - begin_ns) / kNsPerS;
  fmt::print(
      "{}: {:.1f} s, {:.0f} exact frames; a second: {:.1f} kB of keyframes (each {:.1f} kB), {:.1f} kB of "
      "deltas; the slowest moment takes {:.0f} ms of processor time\n",
      shares ? "shared" : "apart", seconds, exact, 1e-3 * keyframe_bytes / seconds,
      1e-3 * keyframe_bytes / std::max(keyframes - 2.0, 1.0), 1e-3 * delta_bytes / seconds,
      static_cast<double>(longest_ns) * 1e-6);
  return {};
}

/// Hair whose viewers somebody joins every second, beside hair that nobody joins.
Status measure_joined(const StreamRecording& recording, double bound_m) {
  constexpr size_t kEvery = 60;
  const StreamShape& shape = recording.shape;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m("step", static_cast<float>(bound_m)));
  std::array<SharedRun, 2> runs = {SharedRun(quantum_m), SharedRun(quantum_m)};
  std::vector<std::unique_ptr<StrandEncoder>> encoders;
  for (size_t i = 0; i < runs.size(); ++i) {
    ASSIGN_OR_RETURN(auto encoder, make_strand_encoder("step"));
    encoder->set_rest_shape(shape.rest_in_head_m);
    encoders.push_back(std::move(encoder));
  }
  for (size_t frame = 0; frame < recording.frames.size(); ++frame) {
    const bool is_join = frame > 0 && frame % kEvery == 0;
    for (size_t i = 0; i < runs.size(); ++i) {
      Snapshot state = runs[i].published(recording.frames[frame]);
      runs[i].step(state);
      encoders[i]->set_state(runs[i].copy());
      runs[i].put_strands(state);
      if (i == 0 && is_join)
        encoders[i]->encode_for_join(state);
      else
        encoders[i]->encode(state);
      if (i == 0 || !runs[i].is_active()) runs[i].follow(encoders[i]->take_shared(), state);
    }
    if (!is_join || frame == kEvery) continue;
    const std::vector<glm::vec3>&with = runs[0].in_head_m(), &without = runs[1].in_head_m();
    double sum_m2 = 0.0;
    for (size_t i = 0; i < with.size(); ++i) sum_m2 += std::pow(glm::distance(with[i], without[i]), 2);
    fmt::print("{} joiners: hair {:.4f} mm (rms) and {:.3f} mm (most) from where it would be\n",
               frame / kEvery - 1, 1e3 * std::sqrt(sum_m2 / static_cast<double>(with.size())),
               1e3 * largest_error_m(with, without));
  }
  return {};
}

Status measure_shared(const StreamRecording& recording, double bound_m) {
  const StreamShape& shape = recording.shape;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m("step", static_cast<float>(bound_m)));
  ASSIGN_OR_RETURN(const auto told, make_strand_encoder("step"));
  ASSIGN_OR_RETURN(const auto alone, make_strand_encoder("step"));
  told->set_rest_shape(shape.rest_in_head_m);
  alone->set_rest_shape(shape.rest_in_head_m);
  SharedRun shared(quantum_m);
  int64_t told_ns = 0, alone_ns = 0, copy_ns = 0, step_ns = 0;
  double frames = 0.0;
  for (const StreamFrame& frame : recording.frames) {
    Snapshot state = shared.published(frame);
    const bool is_shared = shared.is_active();
    const int64_t begin_ns = cpu_ns();
    shared.step(state);
    const int64_t stepped_ns = cpu_ns();
    told->set_state(shared.copy());
    const int64_t copied_ns = cpu_ns();
    shared.put_strands(state);
    const int64_t told_begin_ns = cpu_ns();
    const EncodedFramePtr by_told = told->encode(state);
    const int64_t alone_begin_ns = cpu_ns();
    const EncodedFramePtr by_alone = alone->encode(state);
    const int64_t end_ns = cpu_ns();
    if (by_told->message != by_alone->message) return make_error(ErrorCode::Internal, "frames differ");
    const auto update = told->take_shared();
    alone->take_shared();
    shared.follow(update, state);
    if (!is_shared || update != nullptr) continue;
    frames += 1.0;
    step_ns += stepped_ns - begin_ns;
    copy_ns += copied_ns - stepped_ns;
    told_ns += alone_begin_ns - told_begin_ns;
    alone_ns += end_ns - alone_begin_ns;
  }
  const auto ms = [&](int64_t ns) { return static_cast<double>(ns) * 1e-6 / frames; };
  fmt::print(
      "{:.0f} exact frames, CPU of each: the encoder {:.2f} ms by steps of its own, {:.2f} ms with the "
      "simulation's state, whose copy takes {:.2f} ms: {:.3f} of it; the simulation's step {:.2f} ms\n",
      frames, ms(alone_ns), ms(told_ns), ms(copy_ns), ms(told_ns + copy_ns) / ms(alone_ns), ms(step_ns));
  return {};
}

Status run(const Options& options) {
  ASSIGN_OR_RETURN(const auto executor, make_lanes_executor());
  RecordingDesc desc;
  desc.size = options.size;
  desc.seconds = options.seconds;
  desc.solver = options.solver;
  desc.executor = executor.get();
  desc.part = options.part;
  if (options.motion.find('.') == std::string::npos) {
    for (const StreamMotion& motion : built_in_stream_motions())
      if (motion.name == (options.motion.empty() ? "built-in walk" : options.motion)) desc.motion = motion;
  } else {
    ASSIGN_OR_RETURN(desc.motion, load_stream_motion(options.motion, {}));
  }
  ASSIGN_OR_RETURN(const StreamRecording recording, record_strands(desc));
  if (options.has_recorded) {
    RETURN_IF_ERROR(measure_recorded(recording, options.bound_m, false));
    return measure_recorded(recording, options.bound_m, true);
  }
  if (options.has_joined) return measure_joined(recording, options.bound_m);
  if (options.has_shared) return measure_shared(recording, options.bound_m);
  if (options.has_classes) return compare_classes(recording, options.bound_m);
  for (const StreamCodecRow& row : own_stream_codecs(options.bound_m)) {
    if (row.name != "tangent" && row.name != "step") continue;
    ASSIGN_OR_RETURN(const auto codec, row.make(recording.shape));
    double bytes = 0.0, encode_ms = 0.0, decode_ms = 0.0, error_m = 0.0;
    size_t first_bytes = 0;
    std::string start;
    for (size_t i = 0; i < recording.frames.size(); ++i) {
      RETURN_IF_ERROR(codec->take(recording.frames[i]));
      const int64_t begin_ns = cpu_ns();
      ASSIGN_OR_RETURN(const auto message, codec->encode());
      const int64_t encoded_ns = cpu_ns();
      RETURN_IF_ERROR(codec->decode(message));
      const int64_t decoded_ns = cpu_ns();
      if (i == 0) first_bytes = message.size();
      if (i > 0 && i < kStart)
        start += fmt::format(" {:.2f}", 8.0 * static_cast<double>(message.size()) /
                                            static_cast<double>(recording.shape.plane_size()));
      error_m = std::max(error_m, largest_error_m(codec->decoded(), recording.frames[i].position_in_head_m));
      if (i < kStart) continue;
      bytes += static_cast<double>(message.size());
      encode_ms += static_cast<double>(encoded_ns - begin_ns) * 1e-6;
      decode_ms += static_cast<double>(decoded_ns - encoded_ns) * 1e-6;
    }
    const int64_t join_ns = cpu_ns();
    ASSIGN_OR_RETURN(const size_t join_bytes, codec->join_bytes(recording.frames.back()));
    const double join_ms = static_cast<double>(cpu_ns() - join_ns) * 1e-6;
    const auto frames = static_cast<double>(recording.frames.size() - kStart);
    const auto vertices = static_cast<double>(recording.shape.plane_size());
    fmt::print(
        "{:12} {:>7.4f} bits/vertex {:>8.3f} Mbit/s encode {:>6.2f} ms decode {:>6.2f} ms error {:.4f} mm "
        "keyframe {:.1f} bits/vertex, then{}; join {:.1f} bits/vertex {:.1f} ms\n",
        row.wind ? fmt::format("{} {}", row.name, to_string(*row.wind)) : row.name,
        8.0 * bytes / frames / vertices, 8.0 * bytes / frames * 60e-6, encode_ms / frames, decode_ms / frames,
        1e3 * error_m, 8.0 * static_cast<double>(first_bytes) / vertices, start,
        8.0 * static_cast<double>(join_bytes) / vertices, join_ms);
  }
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  using namespace strandcast;
  Options options;
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string_view name = argv[i];
    const std::string value = argv[i + 1];
    if (name == "--solver") options.solver = value;
    if (name == "--motion") options.motion = value;
    if (name == "--seconds") options.seconds = std::stod(value);
    if (name == "--bound-mm") options.bound_m = 1e-3 * std::stod(value);
    if (name == "--classes") options.has_classes = value == "yes";
    if (name == "--shared") options.has_shared = value == "yes";
    if (name == "--joined") options.has_joined = value == "yes";
    if (name == "--recorded") options.has_recorded = value == "yes";
    if (name == "--part" && value == "wildest") options.part = MotionPart::Wildest;
    if (name == "--size" &&
        std::sscanf(value.c_str(), "%ux%u", &options.size.strand_count, &options.size.vertex_count) != 2)
      return 2;
  }
  if (const Status status = run(options); !status) {
    fmt::print(stderr, "{}\n", status.error().to_string());
    return 2;
  }
  return 0;
}
