// A simulation that goes on from its viewers' strands takes their steps, bit for bit: nothing is corrected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <numbers>
#include <span>

#include "common/motion/motion_clip.h"
#include "common/scene/scene_file.h"
#include "common/strands/shared_strands.h"
#include "common/strands/strand_codec.h"
#include "tests/support/stepped_hair.h"

namespace strandcast {
namespace {

constexpr int kSettledFrames = 30;  // until the model is told and steps are under way

/// Strands enough for more than one block of lanes; bytes are counted of more.
constexpr uint32_t kFewStrands = 120;
constexpr uint32_t kCountedStrands = 400;

SceneDesc scene_of(const std::string& quality, uint32_t strand_count = kFewStrands) {
  SceneDesc scene = built_in_scene_with({"quality=" + quality}).value();
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = strand_count;
  return scene;
}

/// A head that walks and shakes, at 60 Hz.
InputFrame shaken(int frame, double most_rad = 0.96) {
  const double t_s = frame / 60.0;
  InputFrame input;
  input.has_motion = true;
  input.world_from_head = walking_head(t_s);
  input.world_from_head.rotation =
      glm::angleAxis(most_rad * std::sin(2.0 * std::numbers::pi * 2.2 * t_s), glm::dvec3(0.0, 1.0, 0.0)) *
      input.world_from_head.rotation;
  return input;
}

/// A stream of hair to one viewer, whose strands the simulation takes over where it shares them.
class Stream {
 public:
  /// `delay`: steps that the simulation takes before it hears what viewers have.
  Stream(const SceneDesc& scene, bool shares, size_t delay = 0)
      : hair_(scene), shares_(shares), delay_(delay) {
    hair_.move_bust();
    encoder_ = make_strand_encoder("step").value();
    encoder_->set_rest_shape(hair_.rest_in_head_m());
    viewer_ = new_viewer();
  }

  SteppedHair& hair() { return hair_; }
  /// Has another encoder, which steps every state by itself, write the same bytes.
  void bring_witness() {
    witness_ = make_strand_encoder("step").value();
    witness_->set_rest_shape(hair_.rest_in_head_m());
  }
  void give(const SteppedState& state) {
    encoder_->set_state(state.shared);
    encoder_->encode(state.snapshot);
  }
  uint64_t encoder_steps() const { return encoder_->step_count(); }
  uint64_t witness_steps() const { return witness_->step_count(); }
  /// From the next frame on states come on a lattice of half the resolution.
  void coarsen() { is_coarse_ = true; }
  /// Whether viewers had to be corrected in the frame, or were told a rounded state.
  bool send(const InputFrame& input, bool joins = false) {
    state_ = hair_.step(input);
    if (is_coarse_) {
      state_.snapshot.quantum_m *= 2.0f;
      for (int32_t& value : state_.snapshot.lattice) value /= 2;
    }
    // As it comes from afar, now sooner, now later.
    const auto jitter_ns = static_cast<int64_t>(state_.snapshot.tick * 7919 % 4'000'000);
    state_.snapshot.motion_time_ns = 1'000'000'000'000 + state_.snapshot.sim_time_ns + jitter_ns;
    if (witness_ != nullptr) witness(joins);
    encoder_->set_state(state_.shared);
    if (joins) {
      const JoinFrames frames = encoder_->encode_for_join(state_.snapshot);
      take(frames.frame);
      if (witness_ != nullptr) {
        EXPECT_EQ(frames.keyframe->message, witnessed_.keyframe->message);
      }
      joiner_ = new_viewer();
      joined_bytes_ = frames.keyframe->message.size();
      const auto joined = joiner_->decode(frames.keyframe->message);
      EXPECT_TRUE(joined) << joined.error().to_string();
      EXPECT_EQ(state_hash(**joined), state_hash(*seen_));
    } else {
      const EncodedFramePtr frame = encoder_->encode(state_.snapshot);
      take(frame);
      if (joiner_ != nullptr) {
        EXPECT_EQ(state_hash(**joiner_->decode(frame->message)), state_hash(*seen_));
      }
    }
    const auto update = encoder_->take_shared();
    if (witness_ != nullptr) {
      EXPECT_EQ(frame_->message, witnessed_.frame->message);
      EXPECT_EQ(witness_->take_shared() != nullptr, update != nullptr);
    }
    told_.push_back(update);
    if (told_.size() <= delay_) return update != nullptr;
    if (told_.front() && shares_) hair_.share(*told_.front());
    told_.pop_front();
    return update != nullptr;
  }
  /// Frames of `count` that were corrected, from frame `first` on.
  int corrected(int first, int count, double most_rad = 0.96) {
    int result = 0;
    for (int i = first; i < first + count; ++i) result += send(shaken(i, most_rad)) ? 1 : 0;
    return result;
  }
  size_t bytes() const { return frame_->message.size(); }  // of the last frame
  const EncodedFrame& frame() const { return *frame_; }
  size_t joined_bytes() const { return joined_bytes_; }  // of the last keyframe
  /// Has it look at every frame before the viewer does.
  void look(std::function<void(const EncodedFrame&, StrandDecoder&)> at) { look_ = std::move(at); }
  /// Farthest that a vertex of the viewer is from the simulation's, m.
  double worst_error_m() const {
    const std::vector<glm::vec3> seen_m = positions_in_head(*seen_);
    double worst_m = 0.0;
    for (size_t i = 0; i < seen_m.size(); ++i)
      worst_m =
          std::max(worst_m, glm::distance(glm::dvec3(seen_m[i]), glm::dvec3(state_.position_in_head_m[i])));
    return worst_m;
  }

 private:
  std::unique_ptr<StrandDecoder> new_viewer() const {
    auto viewer = make_strand_decoder("step", {hair_.strand_count(), hair_.vertex_count()}).value();
    viewer->set_rest_shape(hair_.rest_in_head_m());
    return viewer;
  }
  void witness(bool joins) {
    witnessed_ = joins ? witness_->encode_for_join(state_.snapshot)
                       : JoinFrames{witness_->encode(state_.snapshot), {}};
  }
  void take(const EncodedFramePtr& frame) {
    if (look_) look_(*frame, *viewer_);
    const auto seen = viewer_->decode(frame->message);
    ASSERT_TRUE(seen) << seen.error().to_string();
    seen_ = *seen;
    frame_ = frame;
    EXPECT_EQ(seen_->motion_time_ns, state_.snapshot.motion_time_ns);
    EXPECT_EQ(seen_->bust, state_.snapshot.bust);
  }

  SteppedHair hair_;
  bool is_coarse_ = false;
  const bool shares_;
  const size_t delay_;
  std::deque<std::shared_ptr<SharedUpdate>> told_;
  std::unique_ptr<StrandEncoder> encoder_;
  std::unique_ptr<StrandEncoder> witness_;
  JoinFrames witnessed_;
  std::unique_ptr<StrandDecoder> viewer_;
  std::unique_ptr<StrandDecoder> joiner_;
  SteppedState state_;
  std::shared_ptr<const Snapshot> seen_;
  EncodedFramePtr frame_;
  size_t joined_bytes_ = 0;
  std::function<void(const EncodedFrame&, StrandDecoder&)> look_;
};

class SharedStrands : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Qualities, SharedStrands, testing::Values("fast", "full"));

/// What viewers show is then the simulation's own hair, to half of a step of the lattice.
TEST_P(SharedStrands, LeaveNothingToCorrect) {
  Stream shared(scene_of(GetParam()), true);
  shared.corrected(0, kSettledFrames);
  EXPECT_EQ(shared.corrected(kSettledFrames, 150), 0);
  const double quantum_m = lattice_step_m("step", SteppedHair::kBoundM).value();
  EXPECT_LT(shared.worst_error_m(), 0.9 * quantum_m);

  Stream apart(scene_of(GetParam()), false);
  apart.corrected(0, kSettledFrames);
  EXPECT_GT(apart.corrected(kSettledFrames, 150), 10);
  EXPECT_GT(apart.worst_error_m(), 2.0 * quantum_m);
  EXPECT_LE(shared.bytes(), apart.bytes());
}

/// What a stream of 45 kbit/s at 60 Hz has for a frame is 93.75 bytes.
TEST_P(SharedStrands, TakeLittleMoreThanTheHeadsPose) {
  constexpr size_t kWebSocketBytes = 2;
  constexpr size_t kMostBytes = 90;
  for (const bool shares : {true, false}) {
    Stream stream(scene_of(GetParam(), kCountedStrands), shares);
    stream.corrected(0, kSettledFrames);
    int exact = 0;
    for (int i = 0; i < 150; ++i) {
      stream.send(shaken(kSettledFrames + i));
      exact += is_exact(stream.frame()) ? 1 : 0;
      if (!shares) continue;
      EXPECT_LE(stream.bytes() + kWebSocketBytes, kMostBytes) << i;
    }
    EXPECT_EQ(exact == 150, shares) << exact;
  }
}

/// The same in the mean, in gusts that somebody sends and beside a body with a joint that moves.
TEST_P(SharedStrands, TakeLittleMoreInGustsBesideABody) {
  constexpr double kWebSocketBytes = 2.0;
  constexpr double kMostBytes = 45'000.0 / 8.0 / 60.0;
  constexpr int kFrames = 150;
  SceneDesc scene = scene_of(GetParam(), kCountedStrands);
  scene.body.capsules = {{kJoint, kJoint}, {"", "", {-0.2, -0.2, 0.0}, {0.1, -0.2, 0.0}, 0.06, 0.05}};
  const GustGenerator gusts({3.0f, 0.0f, 1.0f}, 0.3f, 20.0f, 7);
  const auto input_at = [&](int frame) {
    InputFrame input = shaken(frame);
    input.has_wind_stream = true;
    input.wind_mps = gusts.sample(frame / 60.0);
    input.joints = {{kJoint}, {lifted_joint(frame / 60.0)}};
    return input;
  };
  Stream stream(scene, true);
  for (int i = 0; i < kSettledFrames; ++i) stream.send(input_at(i));
  double bytes = 0.0;
  for (int i = 0; i < kFrames; ++i) {
    stream.send(input_at(kSettledFrames + i));
    EXPECT_TRUE(is_exact(stream.frame())) << i;
    bytes += static_cast<double>(stream.bytes()) + kWebSocketBytes;
  }
  EXPECT_LE(bytes / kFrames, kMostBytes);
  RecordProperty("bytes", std::to_string(bytes / kFrames));
}

TEST_P(SharedStrands, AreNotMovedByDamagedFrames) {
  Stream stream(scene_of(GetParam()), true);
  stream.corrected(0, kSettledFrames);
  size_t refused = 0;
  stream.look([&](const EncodedFrame& frame, StrandDecoder& viewer) {
    ASSERT_TRUE(is_exact(frame));
    for (size_t at = kFrameHeaderBytes; at < frame.message.size(); ++at) {
      std::vector<std::byte> bad = frame.message;
      bad[at] ^= std::byte{1} << (at % 8);
      ASSERT_FALSE(viewer.decode(bad)) << at;
      ++refused;
    }
    std::vector<std::byte> longer = frame.message;
    longer.push_back(std::byte{0});
    FrameHeader header = frame.header;
    ++header.payload_bytes;
    const auto packed = pack(header);
    std::copy(packed.begin(), packed.end(), longer.begin());
    EXPECT_FALSE(viewer.decode(longer));
  });
  EXPECT_EQ(stream.corrected(kSettledFrames, 4), 0);
  EXPECT_GT(refused, 4u * 40u);
}

/// The simulation's state is what viewers predict: an encoder that hears of it writes the same bytes without
/// a step of its own, but for the ticks until the simulation goes on from what a joiner was told.
TEST_P(SharedStrands, CostTheEncoderNoStep) {
  for (const size_t delay : {0, 2}) {
    Stream stream(scene_of(GetParam()), true, delay);
    stream.bring_witness();
    stream.corrected(0, kSettledFrames + 5);
    for (int join = 0; join < 3; ++join) {
      const uint64_t before = stream.encoder_steps(), witness_before = stream.witness_steps();
      EXPECT_EQ(stream.corrected(kSettledFrames + 5 + 20 * join, 19), 0);
      EXPECT_EQ(stream.encoder_steps() - before, join == 0 ? 0 : delay) << join;
      EXPECT_EQ(stream.witness_steps() - witness_before, 19u);
      EXPECT_TRUE(stream.send(shaken(kSettledFrames + 24 + 20 * join), true));
    }
  }
}

/// It has the state before whatever comes, and goes on from it by steps of its own.
TEST_P(SharedStrands, AreTheEncodersAgainWhereNothingIsShared) {
  SceneDesc scene = scene_of(GetParam());
  Stream stream(scene, true);
  stream.bring_witness();
  stream.corrected(0, kSettledFrames + 5);
  const auto goes_on = [&](int first) {
    stream.corrected(first, 12);
    const uint64_t before = stream.encoder_steps();
    EXPECT_EQ(stream.corrected(first + 12, 8), 0);
    EXPECT_EQ(stream.encoder_steps(), before);
  };
  stream.hair().step(shaken(kSettledFrames + 5));  // no frame has it
  goes_on(kSettledFrames + 6);
  stream.hair().reset();
  goes_on(80);
  scene.gravity_mps2.y *= 0.5;
  stream.hair().change(scene);
  goes_on(100);
  stream.hair().forget_model();
  stream.corrected(120, 3);
  stream.hair().tell_model();
  goes_on(123);
  scene.solver = {scene.solver.name == "dftl" ? "direct_rod" : "dftl", {}};
  stream.hair().change(scene);
  goes_on(150);
}

/// A state that others led to is not taken for the viewers'.
TEST_P(SharedStrands, AreNotTakenFromElsewhere) {
  Stream stream(scene_of(GetParam()), true);
  stream.corrected(0, kSettledFrames + 5);
  SteppedHair& hair = stream.hair();
  // A step that viewers are told otherwise.
  SteppedState state = hair.step(shaken(kSettledFrames + 5));
  ASSERT_NE(state.shared, nullptr);
  auto trail = std::make_shared<StepTrail>(*state.snapshot.trail);
  trail->ticks.back().wind_mps.x += 3.0;
  state.snapshot.trail = trail;
  const uint64_t before = stream.encoder_steps();
  stream.give(state);
  EXPECT_EQ(stream.encoder_steps(), before + 1);
}

/// A viewer that has nothing to count from asks for a keyframe.
TEST_P(SharedStrands, AreOfNoUseWithoutTheFrameBefore) {
  Stream stream(scene_of(GetParam()), true);
  stream.corrected(0, kSettledFrames + 3);
  auto stranger =
      make_strand_decoder("step", {stream.hair().strand_count(), stream.hair().vertex_count()}).value();
  stranger->set_rest_shape(stream.hair().rest_in_head_m());
  ASSERT_TRUE(is_exact(stream.frame()));
  EXPECT_EQ(stranger->decode(stream.frame().message).error().code, ErrorCode::Unavailable);
}

TEST_P(SharedStrands, GoOnFromWhatAJoinerIsTold) {
  Stream stream(scene_of(GetParam()), true);
  stream.corrected(0, kSettledFrames);
  for (int join = 0; join < 5; ++join) {
    const int first = kSettledFrames + 20 * join;
    EXPECT_TRUE(stream.send(shaken(first), true));
    EXPECT_LT(stream.worst_error_m(), SteppedHair::kBoundM);
    EXPECT_EQ(stream.corrected(first + 1, 19), 0) << join;
  }
}

/// Besides the head's field, of which every keyframe tells. `TellsRodsBesideTheirWeight` has the rods, and
/// velocity_guess_test.cpp what velocities are told beside.
TEST_P(SharedStrands, TakeFewBitsAVertexForWhoJoins) {
  struct Head {
    const char* moves;
    double most_rad, most_bits;
  };
  const bool is_full = GetParam() == std::string("full");
  SceneDesc scene = scene_of(GetParam(), kCountedStrands);
  scene.head.collider = "spheres";
  for (const Head& head :
       {Head{"walking", 0.0, is_full ? 21.9 : 25.6}, {"shaken", 0.96, is_full ? 35.6 : 33.0}}) {
    Stream stream(scene, true);
    stream.corrected(0, 2 * kSettledFrames, head.most_rad);
    stream.send(shaken(2 * kSettledFrames, head.most_rad), true);
    const double vertices = static_cast<double>(stream.hair().strand_count()) * stream.hair().vertex_count();
    const double bits = 8.0 * static_cast<double>(stream.joined_bytes()) / vertices;
    RecordProperty(std::string("bits_") + head.moves, std::to_string(bits));
    EXPECT_LT(bits, head.most_bits) << head.moves;
  }
}

/// An encoder takes its time: the simulation repeats the steps that it took meanwhile.
TEST_P(SharedStrands, AreFoundWhenTheyAreLate) {
  for (const size_t delay : {1, 2, 3}) {
    Stream stream(scene_of(GetParam()), true, delay);
    stream.corrected(0, kSettledFrames);
    stream.corrected(kSettledFrames, 60);
    EXPECT_EQ(stream.corrected(kSettledFrames + 60, 60), 0) << delay;
    EXPECT_TRUE(stream.send(shaken(kSettledFrames + 120), true));
    stream.corrected(kSettledFrames + 121, 10);
    EXPECT_EQ(stream.corrected(kSettledFrames + 131, 30), 0) << delay;
  }
}

double rms_m(std::span<const glm::vec3> a_m, std::span<const glm::vec3> b_m) {
  double sum = 0.0;
  for (size_t i = 0; i < a_m.size(); ++i) sum += glm::dot(a_m[i] - b_m[i], a_m[i] - b_m[i]);
  return std::sqrt(sum / static_cast<double>(a_m.size()));
}

/// The strands of a stream where somebody joins, beside those of one where nobody does.
struct Snap {
  double worst_m = 0.0;
  double worst_mps = 0.0;
  double later_rms_m = 0.0;  // a tenth of a second after it
};
Snap snap_of(const std::string& quality, bool shares) {
  Stream joined(scene_of(quality), shares);
  Stream alone(scene_of(quality), shares);
  for (Stream* stream : {&joined, &alone}) stream->corrected(0, 2 * kSettledFrames, 0.0);
  joined.send(shaken(2 * kSettledFrames, 0.0), true);
  alone.send(shaken(2 * kSettledFrames, 0.0));
  Snap snap;
  snap.worst_m = joined.worst_error_m();
  const SteppedState now = joined.hair().state(), expected = alone.hair().state();
  for (size_t i = 0; i < now.velocity_mps.size(); ++i)
    snap.worst_mps = std::max(
        snap.worst_mps, glm::distance(glm::dvec3(now.velocity_mps[i]), glm::dvec3(expected.velocity_mps[i])));
  for (int i = 1; i <= 6; ++i)
    for (Stream* stream : {&joined, &alone}) stream->send(shaken(2 * kSettledFrames + i, 0.0));
  snap.later_rms_m = rms_m(joined.hair().state().position_in_head_m, alone.hair().state().position_in_head_m);
  return snap;
}

/// Everybody takes over what joiners are told, the simulation too.
TEST_P(SharedStrands, MoveByNothingThatIsSeenWhenSomebodyJoins) {
  constexpr double kMostM = 3e-5;
  constexpr double kMostMps = 1e-3;
  constexpr double kMostLaterM = 5e-4;
  const Snap snap = snap_of(GetParam(), true);
  EXPECT_LE(snap.worst_m, kMostM);
  EXPECT_LE(snap.worst_mps, kMostMps);
  EXPECT_GT(snap.worst_mps, 0.0);
  EXPECT_LE(snap.later_rms_m, kMostLaterM);
  RecordProperty("later_rms_mm", std::to_string(1e3 * snap.later_rms_m));
  // Where nothing is shared, joiners are told no more than the bound.
  EXPECT_GT(snap_of(GetParam(), false).worst_m, kMostM);
}

/// A thousand of them in half a minute: hair is no farther off than after the first hundred, and goes back.
TEST_P(SharedStrands, RestAsAThousandJoinersCome) {
  constexpr double kMostAwayM = 5e-4;
  SceneDesc scene = scene_of(GetParam());
  std::get<ProceduralGroomDesc>(scene.groom).strand_count = 16;
  scene.wind = {};
  InputFrame still;
  still.has_motion = true;
  still.world_from_head.position_m = {0.0, 1.6, 0.0};
  SteppedHair hair(scene);
  const auto encoder = make_strand_encoder("step").value();
  encoder->set_rest_shape(hair.rest_in_head_m());
  const auto send = [&](int count, int joins_every) {
    for (int i = 0; i < count; ++i) {
      const SteppedState state = hair.step(still);
      const bool is_join = joins_every != 0 && i % joins_every == 0;
      EXPECT_TRUE(is_join ? encoder->encode_for_join(state.snapshot).keyframe
                          : encoder->encode(state.snapshot));
      if (const auto update = encoder->take_shared()) hair.share(*update);
    }
    return hair.state().position_in_head_m;
  };
  const std::vector<glm::vec3> rest_m = send(100, 0);
  const double few_m = rms_m(rest_m, send(200, 2));
  const double many_m = rms_m(rest_m, send(1800, 2));
  EXPECT_LT(many_m, kMostAwayM);
  EXPECT_LT(many_m, 1.2 * few_m + 0.1 * SteppedHair::kBoundM);
  EXPECT_LT(rms_m(rest_m, send(200, 0)), SteppedHair::kBoundM);
}

/// Somebody joins twice a second. Each time velocities are rounded, by 1 mm/s at most.
TEST_P(SharedStrands, RestAsJoinersCome) {
  SceneDesc scene = scene_of(GetParam());
  scene.wind = {};
  InputFrame still;
  still.has_motion = true;
  still.world_from_head.position_m = {0.0, 1.6, 0.0};
  double moved_m[2] = {};
  for (const bool joins : {false, true}) {
    Stream stream(scene, true);
    for (int i = 0; i < 2 * kSettledFrames; ++i) stream.send(still);
    const std::vector<glm::vec3> before_m = stream.hair().state().position_in_head_m;
    for (int i = 0; i < 300; ++i) stream.send(still, joins && i % 30 == 0);
    moved_m[joins] = rms_m(before_m, stream.hair().state().position_in_head_m);
  }
  EXPECT_LT(moved_m[1], moved_m[0] + 0.5 * SteppedHair::kBoundM);
}

/// Strands that were put elsewhere are not taken back by a state from before.
TEST_P(SharedStrands, ForgetStatesFromBeforeAReset) {
  Stream stream(scene_of(GetParam()), true, 2);
  stream.corrected(0, kSettledFrames);
  EXPECT_TRUE(stream.send(shaken(kSettledFrames), true));  // on its way as the hair is reset
  stream.hair().reset();
  stream.corrected(kSettledFrames + 1, 2);
  Stream alone(scene_of(GetParam()), false);
  alone.corrected(0, kSettledFrames + 1);
  alone.hair().reset();
  alone.corrected(kSettledFrames + 1, 2);
  EXPECT_LT(rms_m(stream.hair().state().position_in_head_m, alone.hair().state().position_in_head_m), 1e-3);
}

TEST_P(SharedStrands, GoOnOverOtherScenesAndJumps) {
  SceneDesc scene = scene_of(GetParam());
  Stream stream(scene, true);
  stream.corrected(0, kSettledFrames);
  scene.gravity_mps2.y *= 0.5;
  scene.hair.wind = 0.2;
  stream.hair().change(scene);
  EXPECT_EQ(stream.corrected(kSettledFrames, 20), 0);
  InputFrame jump = shaken(200);
  jump.has_teleported = true;
  stream.send(jump);
  EXPECT_EQ(stream.corrected(201, 20), 0);
}

// The bound changes while frames are exact: the encoder begins anew, without anything of the lattice before.
TEST_P(SharedStrands, BeginAnewOnAnotherLattice) {
  Stream stream(scene_of(GetParam()), true);
  stream.corrected(0, kSettledFrames + 5);
  EXPECT_TRUE(is_exact(stream.frame()));
  stream.coarsen();
  stream.send(shaken(kSettledFrames + 5));
  EXPECT_EQ(stream.frame().header.opcode, Opcode::StrandKeyframe);
  stream.corrected(kSettledFrames + 6, 5);  // which decode
}

}  // namespace
}  // namespace strandcast
