// Writes tapes (tests/web/tape.h) of what this build's decoders make of strand messages:
//   record_tapes kept FILE                 every kept stream of tests/conformance
//   record_tapes hostile FILE              the fuzzers' inputs for strand decoders and assets
//   record_tapes tiny FILE                 every kernel on strands whose lengths, forces and speeds go down
//                                          to 2^-156
//   record_tapes full FILE                 full quality on a head that turns wildly over its bust, with
//   changes
//                                          of scene and model, and somebody who joins every now and then
//   record_tapes stream FILE SOLVER CODEC STRANDSxVERTICES FRAMES    the server's own solver on the built-in
//                                          walk
//   record_tapes exact FILE QUALITY STRANDSxVERTICES FRAMES    strands that are shared with viewers of every
//                                          instruction set, who must see the same
#include <array>
#include <cmath>
#include <ctime>

#include "common/kernels/step_model.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "common/strands/step/rod_planes.h"
#include "common/strands/tangent/codec.h"
#include "server/report/stream_codec.h"
#include "server/report/stream_recording.h"
#include "server/sim/executor/lanes_executor.h"
#include "tests/conformance/stored_stream.h"
#include "tests/fuzz/strand_chain.h"
#include "tests/support/hair_motion.h"
#include "tests/support/stepped_hair.h"
#include "tests/support/test_grid.h"
#include "tests/web/tape.h"

namespace strandcast {
namespace {

const std::filesystem::path kTests = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "tests";

std::vector<std::filesystem::path> files_of(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// CPU time of one thread that decodes.
double cpu_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Timings are judged over the whole grid only.
int more_decoders() {
  return on_grid(0, 2);
}

class Player {
 public:
  Player(Tape& tape, const std::string& codec, const StrandStreamLimits& limits,
         std::span<const glm::vec3> rest_in_head_m)
      : tape_(tape), decoder_(std::move(make_strand_decoder(codec, limits, workers_)).value()) {
    decoder_->set_rest_shape(rest_in_head_m);
    for (int i = 0; i < more_decoders(); ++i) {
      others_.push_back(std::move(make_strand_decoder(codec, limits, workers_)).value());
      others_.back()->set_rest_shape(rest_in_head_m);
    }
    tape_.add_decoder(codec, limits, rest_in_head_m);
  }
  bool play(std::span<const std::byte> message) {
    const double begin_ms = cpu_ms();
    const auto decoded = decoder_->decode(message);
    double least_ms = cpu_ms() - begin_ms;
    // What else the machine does makes none of them shorter.
    for (const auto& other : others_) {
      const double again_ms = cpu_ms();
      if (other->decode(message).ok() != decoded.ok()) return false;
      least_ms = std::min(least_ms, cpu_ms() - again_ms);
    }
    tape_.add_message(message, decoded, least_ms);
    return decoded.ok();
  }

 private:
  Tape& tape_;
  WorkerPool workers_{1};
  std::unique_ptr<StrandDecoder> decoder_;
  std::vector<std::unique_ptr<StrandDecoder>> others_;  // that are only timed
};

/// As its first viewer sees a kept stream, and whoever joins.
Status record_kept(Tape& tape) {
  for (const auto& path : files_of(kTests / "conformance/vectors")) {
    if (!path.filename().string().starts_with("strands_")) continue;
    ASSIGN_OR_RETURN(const auto stored, conformance::load_stream(path));
    const StrandStreamLimits limits{stored.stream.strand_count, stored.stream.vertex_count};
    tape.add_name(path.filename().string());
    // Those who joined before `begin` are behind the same frames.
    std::vector<size_t> begins = {0};
    for (size_t i = 0; i < stored.steps.size(); ++i)
      if (!stored.steps[i].keyframe.empty()) begins.push_back(i);
    for (size_t viewer = 0; viewer < begins.size(); ++viewer) {
      Player player(tape, stored.stream.codec, limits, stored.rest_in_head_m);
      for (size_t i = begins[viewer]; i < stored.steps.size(); ++i) {
        const bool joins = viewer > 0 && i == begins[viewer];
        player.play(joins ? stored.steps[i].keyframe : stored.steps[i].frame);
      }
    }
  }
  return {};
}

/// Writes down what the fuzzers' games give to decoders.
class Watcher final : public StrandChainWatcher {
 public:
  explicit Watcher(Tape& tape) : tape_(tape) {}
  void made(const std::string& codec, const StrandStreamLimits& limits,
            std::span<const glm::vec3> rest_in_head_m) override {
    tape_.add_decoder(codec, limits, rest_in_head_m);
  }
  void decoded(std::span<const std::byte> message,
               const Result<std::shared_ptr<const Snapshot>>& result) override {
    tape_.add_message(message, result, 0.0);
  }

 private:
  Tape& tape_;
};

Status record_hostile(Tape& tape) {
  Watcher watcher(tape);
  watch_strand_chains(&watcher);
  for (const StrandCodecInfo& codec : strand_codecs()) {
    tape.add_name("inputs of strand_" + codec.name);
    for (const auto& path : files_of(kTests / "fuzz/corpus" / ("strand_" + codec.name))) {
      ASSIGN_OR_RETURN(const auto bytes, load_file(path, 1 << 20));
      fuzz_strand_chain(codec.name, reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
    }
  }
  watch_strand_chains(nullptr);
  tape.add_name("inputs of scene_asset");
  for (const auto& path : files_of(kTests / "fuzz/corpus/scene_asset")) {
    ASSIGN_OR_RETURN(const auto bytes, load_file(path, 1 << 20));
    // Whole, damaged in every place, and cut off there.
    std::vector<std::vector<std::byte>> payloads = {bytes};
    for (size_t i = 0; i < bytes.size(); i += 1 + bytes.size() / 64) {
      payloads.push_back(bytes);
      payloads.back()[i] ^= std::byte{0x10};
      payloads.emplace_back(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(i));
    }
    for (const auto& payload : payloads) {
      const auto asset = decode_asset_strands(payload);
      const StrandStreamLimits any{4, 4};
      tape.add_decoder("raw", asset ? StrandStreamLimits{asset->strand_count, asset->vertex_count} : any, {});
      tape.add_asset(payload, asset ? Status() : Status(asset.error()));
    }
  }
  return {};
}

constexpr HairMotionDesc kTinyHair = {40, 8, MotionKind::Still, 0.3f, 0.0f};

std::shared_ptr<const StepModel> tiny_model(const StepKernel& kernel,
                                            std::span<const glm::vec3> rest_in_head_m) {
  auto model = std::make_shared<StepModel>();
  model->strand_count = kTinyHair.strand_count;
  model->vertex_count = kTinyHair.vertex_count;
  model->pinned_root_count = 2;
  model->parameters.air_drag_per_s = 5.0;
  model->parameters.max_speed_mps = 30.0;
  model->parameters.s_damping = 0.9;
  model->kernel.shader_path = kernel.shader_path;
  model->kernel.variant = {{"HAS_PINNED_TAIL", 0}};
  if (kernel.fixed.empty()) return model;
  model->kernel.variant["HAS_TWIST"] = 1;
  model->kernel.constants = {{"u_solves", 1u}, {"u_order", 2u}, {"u_bending_damping", 2e-3}};
  step::RodPlanes rods =
      step::natural_rods({rest_in_head_m, kTinyHair.strand_count, kTinyHair.vertex_count, 2, 0, {}, true});
  for (uint32_t s = 0; s < kTinyHair.strand_count; ++s)
    for (const uint32_t row : {2u, 3u}) rods.strand[row * kTinyHair.strand_count + s].w = 1e-3f;
  model->rod_edge = std::move(rods.edge);
  model->rod_strand = std::move(rods.strand);
  return model;
}

constexpr double kTinyForce = 0x1p-120;
std::shared_ptr<const StepScene> tiny_scene(double force) {
  auto scene = std::make_shared<StepScene>();
  scene->gravity_mps2 = {0.0, -9.81 * force, 0.0};
  scene->colliders = {{glm::vec3(0.0f, 0.0f, 1.0f), 0.05f}};
  scene->follicle_limit_rad = 0.5;
  scene->follicle_cosine = 0.87758f;
  scene->follicle_sine = 0.47943f;
  return scene;
}

/// Strand s is 2^(4 s) times as short as hair, and in the later half of the frames all forces are tiny.
Status record_tiny(Tape& tape) {
  constexpr uint64_t kFrames = 60;
  constexpr int64_t kStepNs = 16'666'667;
  std::vector<glm::vec3> rest_in_head_m = HairMotion(kTinyHair).rest_in_head();
  for (size_t i = 0; i < rest_in_head_m.size(); ++i)
    rest_in_head_m[i] *= std::ldexp(1.0f, -4 * static_cast<int>(i % kTinyHair.strand_count));
  for (const StepKernel& kernel : step_kernels()) {
    tape.add_name("tiny " + kernel.shader_path);
    ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder("step"));
    ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m("step", 1e-4f));
    encoder->set_rest_shape(rest_in_head_m);
    Player player(tape, "step", {kTinyHair.strand_count, kTinyHair.vertex_count}, rest_in_head_m);
    const auto model = tiny_model(kernel, rest_in_head_m);
    const std::array scenes = {tiny_scene(1.0), tiny_scene(kTinyForce)};
    std::vector<StepTick> ticks;
    for (uint64_t frame = 1; frame <= kFrames; ++frame) {
      const double force = frame < kFrames / 2 ? 1.0 : kTinyForce;
      const auto& scene = frame < kFrames / 2 ? scenes[0] : scenes[1];
      StepTick tick;
      tick.tick = frame;
      tick.wind_mps = glm::dvec3(0.6, 0.1, 0.2) * force;
      ticks.push_back(tick);
      if (ticks.size() > kMostTrailTicks) ticks.erase(ticks.begin());
      QuantiseInput state;
      state.tick = frame;
      state.sim_time_ns = static_cast<int64_t>(frame) * kStepNs;
      state.strand_count = kTinyHair.strand_count;
      state.vertex_count = kTinyHair.vertex_count;
      state.quantum_m = quantum_m;
      state.position_in_head_m = rest_in_head_m;
      Snapshot snapshot = quantise(state).snapshot;
      snapshot.trail = std::make_shared<StepTrail>(StepTrail{model, scene, ticks});
      if (!player.play(encoder->encode(snapshot)->message))
        return make_error(ErrorCode::Internal, "a frame of {} cannot be sent", kernel.shader_path);
    }
  }
  return {};
}

uint32_t full_strands() {
  return static_cast<uint32_t>(on_grid(150, 400));
}
constexpr uint32_t kFullVertices = 12;

/// A message that followers get, and what who joins there gets instead; empty: nobody does.
struct TapedFrame {
  std::vector<std::byte> frame, keyframe;
};

Result<std::vector<TapedFrame>> full_frames(std::vector<glm::vec3>& rest_in_head_m) {
  constexpr int kFrames = 260;
  constexpr int kJoinEvery = 23;
  ASSIGN_OR_RETURN(SceneDesc scene, built_in_scene_with({"quality=full", "step_rate_hz=30", "substeps=2"}));
  auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  groom.strand_count = full_strands();
  groom.vertex_count = kFullVertices;
  SteppedHair hair(scene);
  hair.move_bust();
  rest_in_head_m = hair.rest_in_head_m();
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder("step"));
  encoder->set_rest_shape(rest_in_head_m);
  const SceneDesc full = scene;
  const auto change = [&](const auto& by) {
    by();
    hair.change(scene);
  };
  std::vector<TapedFrame> frames;
  for (int i = 0; i < kFrames; ++i) {
    // What sliders do, and a server whose steps took too long.
    if (i % 50 == 30) change([&] { scene.hair.wind = 0.3 + 0.01 * i; });
    if (i % 50 == 31) change([&] { scene.solver.parameters["collider_friction"] = 0.1 + 0.001 * i; });
    if (i == 140) change([&] { scene.solver = {"dftl", {{"sag_free", 1.0}}}, scene.volume = {}; });
    if (i == 170) change([&] { scene.solver = full.solver, scene.volume = full.volume; });
    if (i == 180) hair.reset();
    InputFrame input;
    input.has_motion = true;
    const double t_s = i / 30.0;
    input.world_from_head = walking_head(t_s);
    input.world_from_head.rotation =
        glm::angleAxis(0.96 * std::sin(2.0 * std::numbers::pi * 2.2 * t_s), glm::dvec3(0.1, 0.99, 0.05)) *
        input.world_from_head.rotation;
    const Snapshot snapshot = hair.step(input).snapshot;
    TapedFrame taped;
    if (i % kJoinEvery == kJoinEvery - 1 || i == 140 || i == 31) {
      const JoinFrames join = encoder->encode_for_join(snapshot);
      taped = {join.frame->message, join.keyframe->message};
    } else {
      taped.frame = encoder->encode(snapshot)->message;
    }
    frames.push_back(std::move(taped));
  }
  return frames;
}

Status record_full(Tape& tape) {
  std::vector<glm::vec3> rest_in_head_m;
  ASSIGN_OR_RETURN(const auto frames, full_frames(rest_in_head_m));
  constexpr size_t kMostFollowed = 60;
  for (size_t first = 0; first < frames.size(); ++first) {
    if (first > 0 && frames[first].keyframe.empty()) continue;
    tape.add_name(fmt::format("full from {}", first));
    Player player(tape, "step", {full_strands(), kFullVertices}, rest_in_head_m);
    for (size_t i = first; i < std::min(frames.size(), first + (first > 0 ? kMostFollowed : frames.size()));
         ++i)
      if (!player.play(first > 0 && i == first ? frames[i].keyframe : frames[i].frame))
        return make_error(ErrorCode::Internal, "frame {} is refused by who joined at {}", i, first);
  }
  return {};
}

struct StreamWish {
  std::string solver;
  std::string codec;
  StreamSize size;
  int frames = 0;
};

Status record_stream(const StreamWish& wish, Tape& tape) {
  constexpr float kBoundM = 1e-4f;
  ASSIGN_OR_RETURN(const auto executor, make_lanes_executor());
  RecordingDesc desc;
  desc.size = wish.size;
  desc.solver = wish.solver;
  desc.seconds = wish.frames / 60.0;
  desc.executor = executor.get();
  for (const StreamMotion& motion : built_in_stream_motions())
    if (motion.name == "built-in walk") desc.motion = motion;
  ASSIGN_OR_RETURN(const StreamRecording recording, record_strands(desc));
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder(wish.codec));
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(wish.codec, kBoundM));
  encoder->set_rest_shape(recording.shape.rest_in_head_m);
  tape.add_name(fmt::format("{} {} {}", wish.solver, wish.codec, to_string(wish.size)));
  Player player(tape, wish.codec, {wish.size.strand_count, wish.size.vertex_count},
                recording.shape.rest_in_head_m);
  for (const StreamFrame& frame : recording.frames) {
    const EncodedFramePtr encoded = encoder->encode(on_lattice(frame, quantum_m));
    if (encoded == nullptr || !player.play(encoded->message))
      return make_error(ErrorCode::Internal, "a frame of {} cannot be sent", wish.codec);
  }
  return {};
}

/// A head that walks, dances and shakes, ten seconds each.
InputFrame turned_head(int frame) {
  constexpr int kPartFrames = 600;
  struct Part {
    double most_rad, per_s;
  };
  constexpr std::array<Part, 3> kParts = {{{0.0, 0.0}, {0.5, 0.9}, {0.96, 2.2}}};
  const double t_s = frame / 60.0;
  const Part& part = kParts[static_cast<size_t>(frame / kPartFrames) % kParts.size()];
  InputFrame input;
  input.has_motion = true;
  input.world_from_head = walking_head(t_s);
  input.world_from_head.rotation =
      glm::angleAxis(part.most_rad * std::sin(2.0 * std::numbers::pi * part.per_s * t_s),
                     glm::dvec3(0.0, 1.0, 0.0)) *
      input.world_from_head.rotation;
  input.joints = {{kJoint}, {lifted_joint(t_s)}};
  return input;
}

/// Viewers of a stream, one for each instruction set of this processor.
class Audience {
 public:
  Audience(const StrandStreamLimits& limits, std::span<const glm::vec3> rest_in_head_m) {
    for (const simd::InstructionSet set : simd::instruction_sets()) {
      viewers_.push_back(tangent::make_step_decoder(limits, workers_, set));
      viewers_.back()->set_rest_shape(rest_in_head_m);
    }
  }
  /// What all of them decode it to.
  Result<std::shared_ptr<const Snapshot>> see(std::span<const std::byte> message) {
    ASSIGN_OR_RETURN(const auto seen, viewers_.front()->decode(message));
    for (size_t i = 1; i < viewers_.size(); ++i) {
      ASSIGN_OR_RETURN(const auto other, viewers_[i]->decode(message));
      if (other->lattice != seen->lattice)
        return make_error(ErrorCode::Internal, "instruction set {} sees other strands", i);
    }
    return seen;
  }
  size_t size() const { return viewers_.size(); }

 private:
  WorkerPool workers_{1};
  std::vector<std::unique_ptr<StrandDecoder>> viewers_;
};

/// In full quality a shoulder goes up and down. Somebody joins now and then. No other frame after the first
/// second may be corrected.
Status record_exact(const std::string& quality, const StreamSize& size, int frames, Tape& tape) {
  constexpr int kSettledFrames = 60;
  constexpr int kJoinEvery = 1201;
  constexpr double kMostKbps = 45.0;
  ASSIGN_OR_RETURN(SceneDesc scene, built_in_scene_with({"quality=" + quality}));
  auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  groom.strand_count = size.strand_count;
  groom.vertex_count = size.vertex_count;
  if (quality == kFullQuality) {
    scene.body.capsules = {{kJoint, kJoint}};
    scene.body.joint_offset_m = glm::dvec3(0.0);
  }
  SteppedHair hair(scene);
  hair.move_bust();
  ASSIGN_OR_RETURN(const auto encoder, make_strand_encoder("step"));
  encoder->set_rest_shape(hair.rest_in_head_m());
  const StrandStreamLimits limits{size.strand_count, size.vertex_count};
  Audience audience(limits, hair.rest_in_head_m());
  tape.add_name(fmt::format("exact {} {}", quality, to_string(size)));
  tape.add_decoder("step", limits, hair.rest_in_head_m());
  int exact = 0, corrected = 0;
  double bytes = 0.0;
  for (int i = 0; i < frames; ++i) {
    const SteppedState state = hair.step(turned_head(i));
    encoder->set_state(state.shared);
    const bool joins = i % kJoinEvery == kJoinEvery - 1;
    const EncodedFramePtr frame =
        joins ? encoder->encode_for_join(state.snapshot).frame : encoder->encode(state.snapshot);
    if (const auto update = encoder->take_shared()) hair.share(*update);
    const auto seen = audience.see(frame->message);
    RETURN_IF_ERROR(seen);
    tape.add_message(frame->message, seen, 0.0);
    if (i < kSettledFrames || joins) continue;
    bytes += static_cast<double>(frame->message.size());
    (is_exact(*frame) ? exact : corrected) += 1;
  }
  const double kbps = 8e-3 * 60.0 * bytes / std::max(exact + corrected, 1);
  fmt::print("{} {}: {} exact frames, {} corrected, {:.1f} kbit/s, the same for {} instruction sets\n",
             quality, to_string(size), exact, corrected, kbps, audience.size());
  if (corrected == 0 && kbps <= kMostKbps) return {};
  return make_error(ErrorCode::Internal, "{} frames are corrected, {:.1f} kbit/s are sent", corrected, kbps);
}

Result<StreamSize> size_of(const std::string& text) {
  StreamSize size{};
  if (std::sscanf(text.c_str(), "%ux%u", &size.strand_count, &size.vertex_count) == 2) return size;
  return make_error(ErrorCode::BadInput, "\"{}\" is no size", text);
}

Status record(const std::vector<std::string>& arguments) {
  Tape tape;
  if (arguments.size() == 2 && arguments[0] == "kept") {
    RETURN_IF_ERROR(record_kept(tape));
  } else if (arguments.size() == 2 && arguments[0] == "hostile") {
    RETURN_IF_ERROR(record_hostile(tape));
  } else if (arguments.size() == 2 && arguments[0] == "tiny") {
    RETURN_IF_ERROR(record_tiny(tape));
  } else if (arguments.size() == 2 && arguments[0] == "full") {
    RETURN_IF_ERROR(record_full(tape));
  } else if (arguments.size() == 6 && arguments[0] == "stream") {
    ASSIGN_OR_RETURN(const StreamSize size, size_of(arguments[4]));
    RETURN_IF_ERROR(record_stream({arguments[2], arguments[3], size, std::atoi(arguments[5].c_str())}, tape));
  } else if (arguments.size() == 5 && arguments[0] == "exact") {
    ASSIGN_OR_RETURN(const StreamSize size, size_of(arguments[3]));
    RETURN_IF_ERROR(record_exact(arguments[2], size, std::atoi(arguments[4].c_str()), tape));
  } else {
    return make_error(ErrorCode::BadInput,
                      "usage: record_tapes kept|hostile|tiny|full|stream|exact FILE ...");
  }
  return tape.save(arguments[1]);
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  const strandcast::Status status = strandcast::record({argv + 1, argv + argc});
  if (!status) fmt::print(stderr, "{}\n", status.error().to_string());
  return status ? 0 : 2;
}
