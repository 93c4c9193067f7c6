// The promise of the "step" codec over a hundred thousand frames (a few thousand on the small grid) of hair
// that whatever a server may do befalls: every vertex of every frame within the bound, the same state on both
// sides and with joiners, and damage and losses never past the next keyframe.
#include <algorithm>
#include <cstring>
#include <random>

#include "common/scene/scene_file.h"
#include "common/strands/strand_payload.h"
#include "tests/support/stepped_hair.h"
#include "tests/support/test_grid.h"

namespace strandcast::step_soak_test {
namespace {

constexpr float kBoundM = SteppedHair::kBoundM;
constexpr uint32_t kStrands = 64;
constexpr uint32_t kVertices = 8;
constexpr int kSoakFrames = 2'000;

class Chance {
 public:
  explicit Chance(uint32_t seed) : random_(seed) {}
  /// 0 .. count - 1.
  size_t below(size_t count) { return random_() % count; }
  int from_to(int least, int most) { return least + static_cast<int>(below(most - least + 1)); }
  bool once_in(size_t count) { return below(count) == 0; }
  double between(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(random_);
  }
  glm::dvec3 vector(double most) {
    return {between(-most, most), between(-most, most), between(-most, most)};
  }

 private:
  std::mt19937 random_;
};

/// A head that drifts and turns at random, from standing still to wilder than anybody is.
class RandomHead {
 public:
  explicit RandomHead(Chance& chance) : chance_(chance) {}

  Pose step() {
    constexpr double kStepS = 1.0 / 60.0;
    constexpr double kPaces[] = {0.0, 0.05, 0.3, 1.0, 4.0};
    if (chance_.once_in(150)) pace_ = kPaces[chance_.below(std::size(kPaces))];
    // What is left of a speed after a step, and what a step adds at pace 1.
    constexpr double kKept = 0.93;
    constexpr double kAddedMps = 0.25;
    constexpr double kAddedRadPerS = 1.0;
    velocity_mps_ = kKept * velocity_mps_ + pace_ * chance_.vector(kAddedMps);
    spin_rad_per_s_ = kKept * spin_rad_per_s_ + pace_ * chance_.vector(kAddedRadPerS);
    pose_.position_m += kStepS * velocity_mps_;
    turn(kStepS * spin_rad_per_s_);
    return pose_;
  }
  void jump(double most_m, double most_rad) {
    pose_.position_m += chance_.vector(most_m);
    turn(chance_.vector(most_rad));
  }

 private:
  void turn(const glm::dvec3& by_rad) {
    const double angle_rad = glm::length(by_rad);
    if (angle_rad > 0.0)
      pose_.rotation = glm::normalize(glm::angleAxis(angle_rad, by_rad / angle_rad) * pose_.rotation);
  }

  Chance& chance_;
  Pose pose_{{0.0, 1.6, 0.0}, glm::dquat(1.0, 0.0, 0.0, 0.0)};
  double pace_ = 0.3;
  glm::dvec3 velocity_mps_{0.0};
  glm::dvec3 spin_rad_per_s_{0.0};
};

SceneDesc full_scene() {
  Result<SceneDesc> scene = built_in_scene_with({"quality=full", "head.field_resolution=24"});
  EXPECT_TRUE(scene) << scene.error().to_string();
  auto& groom = std::get<ProceduralGroomDesc>(scene->groom);
  groom.strand_count = kStrands;
  groom.vertex_count = kVertices;
  return std::move(scene).value();
}

/// Hair, and what befalls it.
class SoakedHair {
 public:
  SoakedHair(Chance& chance, const SceneDesc& scene)
      : chance_(chance), head_(chance), is_full_(scene.volume.acts()), hair_(scene) {
    if (is_full_) hair_.move_bust();
  }

  const SteppedHair& hair() const { return hair_; }

  SteppedState next() {
    // Nothing moves: the same state is published once more.
    if (pause_ == 0 && chance_.once_in(300)) pause_ = chance_.from_to(1, 6);
    if (pause_ > 0) {
      --pause_;
      return hair_.state();
    }
    befall();
    // More steps than a trail has.
    if (chance_.once_in(250))
      for (int i = chance_.from_to(1, 20); i > 0; --i) take_step();
    SteppedState state = take_step();
    if (!is_within_reach(state)) {
      hair_.reset();
      state = hair_.state();
    }
    return state;
  }

 private:
  SteppedState take_step() {
    InputFrame input;
    input.has_motion = true;
    if (chance_.once_in(300)) {
      input.has_teleported = true;
      head_.jump(30.0, 3.0);
    } else if (chance_.once_in(200)) {
      head_.jump(0.05, 0.3);
    }
    input.world_from_head = head_.step();
    if (chance_.once_in(200)) has_wind_stream_ = !has_wind_stream_;
    if (chance_.once_in(60)) wind_mps_ = glm::vec3(chance_.vector(8.0));
    input.has_wind_stream = has_wind_stream_;
    input.wind_mps = wind_mps_;
    if (chance_.once_in(300)) input_rate_ = chance_.once_in(2) ? 1.0 : chance_.between(1.0, 20.0);
    return hair_.step(input, input_rate_);
  }

  void befall() {
    if (chance_.once_in(1000)) hair_.reset();
    if (chance_.once_in(has_model_ ? 500 : 50)) {
      has_model_ ? hair_.forget_model() : hair_.tell_model();
      has_model_ = !has_model_;
    }
    if (!chance_.once_in(200)) return;
    SceneDesc scene = hair_.scene();
    if (chance_.once_in(2)) scene.wind.mean_mps = glm::vec3(chance_.vector(5.0));
    if (chance_.once_in(3)) scene.wind.gust_intensity = static_cast<float>(chance_.between(0.0, 0.5));
    if (chance_.once_in(4)) scene.gravity_mps2 = chance_.vector(12.0);
    if (chance_.once_in(4)) scene.follicle_limit_deg = chance_.between(5.0, 180.0);
    if (chance_.once_in(4)) scene.substeps = static_cast<uint32_t>(chance_.from_to(1, 4));
    if (is_full_ ? chance_.once_in(2) : chance_.once_in(3)) {
      scene.solver = is_full_ ? some_full_solver() : some_solver();
      if (is_full_) scene.volume = some_volume();
      has_model_ = true;
    }
    hair_.change(scene);
  }

  SolverDesc some_solver() {
    constexpr const char* kNames[] = {"dftl", "dftl", "direct_rod", "articulated", "pbd", "tractrix_split"};
    SolverDesc solver{kNames[chance_.below(std::size(kNames))], {}};
    for (const SolverParameterInfo& info : find_solver(solver.name).value()->parameters) {
      const bool is_count = info.default_value == std::floor(info.default_value);
      if (!is_count && chance_.once_in(3))
        solver.parameters[info.name] =
            std::clamp(chance_.between(0.7, 1.3) * info.default_value, info.minimum, info.maximum);
    }
    return solver;
  }

  /// As sliders change it.
  SolverDesc some_full_solver() {
    SolverDesc solver = full_.solver;
    if (chance_.once_in(4)) solver = {"dftl", {{"sag_free", 1.0}}};
    // Whatever it is, another one: a solver is made anew where it differs.
    solver.parameters["collider_friction"] = chance_.between(0.0, 1.0);
    return solver;
  }
  VolumeDesc some_volume() {
    VolumeDesc volume = full_.volume;
    if (chance_.once_in(5)) return {};
    volume.friction_per_s *= chance_.between(0.2, 3.0);
    volume.air.acts = !chance_.once_in(4);
    volume.air.has_wind = !chance_.once_in(3);
    return volume;
  }

  /// The bound is promised there; models that fling strands further are none of the codec's.
  static bool is_within_reach(const SteppedState& state) {
    return std::all_of(state.position_in_head_m.begin(), state.position_in_head_m.end(),
                       [](const glm::vec3& point) {
                         return glm::all(glm::lessThan(glm::abs(point), glm::vec3(kBoundReachM)));
                       });
  }

  Chance& chance_;
  RandomHead head_;
  const bool is_full_;  // rods that act on each other, in air, on a head and a bust
  const SceneDesc full_ = full_scene();
  SteppedHair hair_;
  int pause_ = 0;
  bool has_wind_stream_ = false;
  bool has_model_ = true;
  glm::vec3 wind_mps_{0.0f};
  double input_rate_ = 1.0;
};

std::vector<std::byte> damaged(const EncodedFrame& frame, Chance& chance) {
  std::vector<std::byte> message = frame.message;
  // Mostly behind what is checked before anything is decoded.
  const size_t begin = chance.once_in(4) ? 0 : state_hash_at(frame) + sizeof(uint64_t);
  const auto place = [&] { return begin + chance.below(message.size() - begin); };
  switch (chance.below(4)) {
    case 0:
      message[place()] = static_cast<std::byte>(chance.below(256));
      break;
    case 1: {  // cut, and said to be as long as it is
      FrameHeader header = unpack_frame_header(message).value();
      message.resize(std::max(kFrameHeaderBytes, place()));
      header.payload_bytes = static_cast<uint32_t>(message.size() - kFrameHeaderBytes);
      const auto packed = pack(header);
      std::copy(packed.begin(), packed.end(), message.begin());
      break;
    }
    case 2:
      for (size_t at = place(), end = std::min(at + chance.below(9), message.size()); at < end; ++at)
        message[at] = static_cast<std::byte>(chance.below(256));
      break;
    default:
      for (int i = chance.from_to(1, 3); i > 0; --i) message[place()] ^= std::byte{1} << chance.below(8);
  }
  return message;
}

uint64_t announced_hash(const EncodedFrame& frame) {
  uint64_t hash = 0;
  std::memcpy(&hash, frame.message.data() + state_hash_at(frame), sizeof(hash));
  return hash;
}

/// An encoder, somebody who watches over a bad line, and the last one to have joined, over a good one.
class SoakedStream {
 public:
  SoakedStream(const SteppedHair& hair, Chance& chance) : hair_(hair), chance_(chance) {
    encoder_ = make_strand_encoder("step").value();
    encoder_->set_rest_shape(hair.rest_in_head_m());
    watcher_ = new_decoder();
  }

  void pass(const SteppedState& state) {
    const bool has_join = chance_.once_in(40) || (trust_ == Trust::Lost && chance_.once_in(4));
    const JoinFrames frames = has_join ? encoder_->encode_for_join(state.snapshot)
                                       : JoinFrames{encoder_->encode(state.snapshot), nullptr};
    ASSERT_TRUE(frames.frame);
    const bool is_keyframe = frames.frame->header.opcode == Opcode::StrandKeyframe;
    steps_ += !is_keyframe && (step_flags_of(*frames.frame) & 2) != 0;
    if (has_join) joiner_ = new_decoder();
    if (joiner_)
      check(state, *frames.frame, joiner_->decode((has_join ? frames.keyframe : frames.frame)->message));
    if (testing::Test::HasFatalFailure()) return;
    const bool is_whole = frames.keyframe != nullptr || is_keyframe;
    watch(state, trust_ != Trust::Whole && frames.keyframe ? *frames.keyframe : *frames.frame, is_whole);
  }

  int steps() const { return steps_; }
  int losses() const { return losses_; }
  int refusals() const { return refusals_; }
  int unnoticed() const { return unnoticed_; }

 private:
  /// Of what the watcher knows: all; all, after a damaged frame that decoded well; no more since a loss.
  enum class Trust { Whole, Doubtful, Lost };
  using Decoded = Result<std::shared_ptr<const Snapshot>>;

  void watch(const SteppedState& state, const EncodedFrame& frame, bool is_whole) {
    const bool is_told_all = is_whole && trust_ != Trust::Whole;
    if (!is_told_all && chance_.once_in(120)) {
      trust_ = Trust::Lost;
      ++losses_;
      return;
    }
    if (chance_.once_in(50)) {
      const Decoded decoded = watcher_->decode(damaged(frame, chance_));
      if (decoded) {
        // Bits that nothing is made of: what is shown is right, and what follows may be refused.
        ++unnoticed_;
        check(state, frame, decoded);
        trust_ = Trust::Doubtful;
        return;
      }
      ++refusals_;
    }
    const Decoded decoded = watcher_->decode(frame.message);
    if (is_told_all) trust_ = Trust::Whole;
    if (decoded || trust_ == Trust::Whole) return check(state, frame, decoded);
    if (trust_ == Trust::Lost) {
      EXPECT_EQ(decoded.error().code, ErrorCode::Unavailable);
    }
    trust_ = Trust::Lost;
  }

  void check(const SteppedState& state, const EncodedFrame& frame, const Decoded& decoded) {
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    ASSERT_EQ(state_hash(**decoded), announced_hash(frame));
    const std::vector<glm::vec3> shown = positions_in_head(**decoded);
    ASSERT_EQ(shown.size(), state.position_in_head_m.size());
    for (size_t i = 0; i < shown.size(); ++i)
      ASSERT_LE(glm::distance(glm::dvec3(shown[i]), glm::dvec3(state.position_in_head_m[i])), kBoundM);
  }

  std::unique_ptr<StrandDecoder> new_decoder() const {
    auto decoder = make_strand_decoder("step", {hair_.strand_count(), hair_.vertex_count()}).value();
    decoder->set_rest_shape(hair_.rest_in_head_m());
    return decoder;
  }

  const SteppedHair& hair_;
  Chance& chance_;
  std::unique_ptr<StrandEncoder> encoder_;
  std::unique_ptr<StrandDecoder> watcher_;
  std::unique_ptr<StrandDecoder> joiner_;
  Trust trust_ = Trust::Whole;
  int steps_ = 0;
  int losses_ = 0;
  int refusals_ = 0;
  int unnoticed_ = 0;
};

TEST(StepSoak, HoldsWhateverBefallsAStream) {
  const int stream_count = on_grid(2, 50);
  int steps = 0;
  int losses = 0;
  int refusals = 0;
  int unnoticed = 0;
  for (int seed = 1; seed <= stream_count; ++seed) {
    Chance chance(static_cast<uint32_t>(seed));
    // Every other stream is of the full quality.
    SoakedHair hair(chance, seed % 2 == 0 ? full_scene() : stepped_scene(kStrands, kVertices));
    SoakedStream stream(hair.hair(), chance);
    for (int i = 0; i < kSoakFrames; ++i) {
      SCOPED_TRACE(fmt::format("seed {}, frame {}", seed, i));
      stream.pass(hair.next());
      if (HasFailure()) return;
    }
    steps += stream.steps();
    losses += stream.losses();
    refusals += stream.refusals();
    unnoticed += stream.unnoticed();
  }
  const int frames = stream_count * kSoakFrames;
  fmt::print("{} frames, {} by steps; {} lost, {} damaged and refused, {} damaged where nobody looks\n",
             frames, steps, losses, refusals, unnoticed);
  EXPECT_GE(steps, frames / 2) << "that is what is soaked";
  EXPECT_GE(losses, frames / 300);
  EXPECT_GE(refusals, frames / 150);
}

}  // namespace
}  // namespace strandcast::step_soak_test
