// What the "step" codec promises: the bound and one chain, whatever happens between two frames; the same
// bytes and states on every path; joiners that cost those who watch little.
#include <algorithm>
#include <functional>
#include <set>

#include "common/strands/step/wire.h"
#include "common/strands/strand_payload.h"
#include "common/strands/strand_prefix.h"
#include "common/strands/tangent/codec.h"
#include "tests/support/own_workers.h"
#include "tests/support/sim_scene.h"
#include "tests/support/stepped_hair.h"

namespace strandcast::step_codec_test {
namespace {

constexpr float kBoundM = SteppedHair::kBoundM;
constexpr uint32_t kStrands = kWalkingStrands;
constexpr uint32_t kVertices = kWalkingVertices;
// Of a delta's flags (proto/WIRE.md).
constexpr int kStepFlag = 2;
constexpr int kSceneFlag = 4;
constexpr int kModelFlag = 8;

double largest_error_m(const SteppedState& state, const Snapshot& decoded) {
  const std::vector<glm::vec3> shown = positions_in_head(decoded);
  double largest = shown.size() <= state.position_in_head_m.size() ? 0.0 : INFINITY;
  const size_t stride = state.snapshot.strand_count;
  for (size_t v = 0; v < decoded.vertex_count; ++v)
    for (size_t s = 0; s < decoded.strand_count; ++s)
      largest = std::max(largest, glm::distance(glm::dvec3(state.position_in_head_m[v * stride + s]),
                                                glm::dvec3(shown[v * decoded.strand_count + s])));
  return largest;
}

bool is_keyframe(const EncodedFrame& frame) {
  return frame.header.opcode == Opcode::StrandKeyframe;
}

/// Both sides of a stream.
struct Stream {
  std::unique_ptr<StrandEncoder> encoder;
  std::unique_ptr<StrandDecoder> decoder;
  EncodedFramePtr frame;  // the last one
  int keyframes = 0;

  explicit Stream(const SteppedHair& hair, const std::string& codec = "step") {
    encoder = make_strand_encoder(codec).value();
    encoder->set_rest_shape(hair.rest_in_head_m());
    decoder = watcher(hair, codec);
  }
  static std::unique_ptr<StrandDecoder> watcher(const SteppedHair& hair, const std::string& codec = "step") {
    auto decoder = make_strand_decoder(codec, {hair.strand_count(), hair.vertex_count()}).value();
    decoder->set_rest_shape(hair.rest_in_head_m());
    return decoder;
  }
  /// Decoding holds the state hash of both sides against each other.
  void pass(const SteppedState& state) {
    frame = encoder->encode(state.snapshot);
    ASSERT_TRUE(frame);
    keyframes += is_keyframe(*frame);
    const auto decoded = decoder->decode(frame->message);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    EXPECT_LE(largest_error_m(state, **decoded), kBoundM) << "tick " << state.snapshot.tick;
  }
  bool is_step() const { return !is_keyframe(*frame) && (step_flags_of(*frame) & kStepFlag) != 0; }
  size_t bytes() const { return frame->message.size(); }
};

const std::vector<std::string> kSolvers = {"dftl", "direct_rod"};

TEST(StepCodec, EveryVertexOfEveryFrameIsWithinTheBound) {
  for (const std::string& solver : kSolvers) {
    SCOPED_TRACE(solver);
    SteppedHair hair = walking_hair(solver);
    Stream stream(hair);
    int steps = 0;
    for (int i = 0; i < 60; ++i) {
      stream.pass(hair.step());
      steps += stream.is_step();
    }
    EXPECT_EQ(stream.keyframes, 1);
    // How fast strands move is not known before the second frame.
    EXPECT_GE(steps, 58);
  }
}

std::vector<SteppedState> recorded(SteppedHair& hair, int frames) {
  std::vector<SteppedState> states;
  for (int i = 0; i < frames; ++i) states.push_back(hair.step());
  return states;
}

/// A short stream with somebody who joins; every message of it. Decoders check states.
std::vector<std::vector<std::byte>> messages_of(const SteppedHair& hair,
                                                const std::vector<SteppedState>& states, WorkerPool& workers,
                                                simd::InstructionSet set) {
  const StrandStreamLimits limits{hair.strand_count(), hair.vertex_count()};
  const auto encoder = tangent::make_step_encoder(workers, set);
  const auto decoder = tangent::make_step_decoder(limits, workers, set);
  const auto joiner = tangent::make_step_decoder(limits, workers, set);
  for (const auto& side : {decoder.get(), joiner.get()}) side->set_rest_shape(hair.rest_in_head_m());
  encoder->set_rest_shape(hair.rest_in_head_m());
  std::vector<std::vector<std::byte>> messages;
  for (size_t i = 0; i < states.size(); ++i) {
    const bool is_join = i == states.size() / 2;
    if (is_join) {
      const JoinFrames frames = encoder->encode_for_join(states[i].snapshot);
      messages.push_back(frames.keyframe->message);
      EXPECT_TRUE(joiner->decode(frames.keyframe->message)) << "frame " << i;
      messages.push_back(frames.frame->message);
    } else {
      messages.push_back(encoder->encode(states[i].snapshot)->message);
      if (i > states.size() / 2) {
        EXPECT_TRUE(joiner->decode(messages.back())) << "frame " << i;
      }
    }
    EXPECT_TRUE(decoder->decode(messages.back())) << "frame " << i;
  }
  return messages;
}

// Strands that fill no block of 8 or 16, and more than one slice.
TEST(StepCodec, EveryInstructionSetGivesTheSameBytesAndStates) {
  for (const auto& [solver, strands, frames] :
       {std::tuple("dftl", 37u, 12), std::tuple("direct_rod", 120u, 12), std::tuple("dftl", 1033u, 5)}) {
    SCOPED_TRACE(std::string(solver) + " " + std::to_string(strands));
    SteppedHair hair = walking_hair(solver, strands);
    const std::vector<SteppedState> states = recorded(hair, frames);
    std::set<std::vector<std::vector<std::byte>>> all;
    for (const simd::InstructionSet set : simd::instruction_sets())
      all.insert(messages_of(hair, states, *own_workers(1), set));
    EXPECT_EQ(all.size(), 1u);
  }
}

// As many vertices as threads share.
TEST(StepCodec, AnyNumberOfThreadsGivesTheSameBytesAndStates) {
  SteppedHair hair = walking_hair("dftl", 3500);
  const std::vector<SteppedState> states = recorded(hair, 4);
  std::set<std::vector<std::vector<std::byte>>> all;
  for (const uint32_t threads : {1u, 2u, 4u})
    all.insert(messages_of(hair, states, *own_workers(threads), simd::widest_set()));
  EXPECT_EQ(all.size(), 1u);
}

// Those who watch pay at most 5.1 bits a vertex in all for somebody who joins. Rest shapes within a
// micrometre would make it 5, and the asset of who joins larger by 6 bits a vertex.
TEST(StepCodec, ALateJoinerFollowsAndCostsThoseWhoWatchLittle) {
  constexpr double kMostBits = 5.1;
  constexpr int kJoin = 20;
  for (const std::string& solver : kSolvers) {
    SCOPED_TRACE(solver);
    SteppedHair hair = walking_hair(solver, 1200);
    Stream alone(hair);
    Stream joined(hair);
    const auto joiner = Stream::watcher(hair);
    double bits = 0.0;
    for (int i = 0; i < kJoin + 60; ++i) {
      const SteppedState state = hair.step();
      alone.pass(state);
      if (i == kJoin) {
        const JoinFrames frames = joined.encoder->encode_for_join(state.snapshot);
        joined.frame = frames.frame;
        ASSERT_TRUE(joined.decoder->decode(frames.frame->message));
        const auto first = joiner->decode(frames.keyframe->message);
        ASSERT_TRUE(first) << first.error().to_string();
        EXPECT_LE(largest_error_m(state, **first), kBoundM);
      } else {
        joined.pass(state);
      }
      // The same frame and the same state hash: the same positions, bit for bit.
      if (i > kJoin) {
        const auto decoded = joiner->decode(joined.frame->message);
        ASSERT_TRUE(decoded) << "frame " << i << ": " << decoded.error().to_string();
      }
      bits += 8.0 * (static_cast<double>(joined.bytes()) - static_cast<double>(alone.bytes()));
    }
    bits /= static_cast<double>(hair.strand_count() * hair.vertex_count());
    RecordProperty(solver + "_join_bits_a_vertex", std::to_string(bits));
    EXPECT_LT(bits, kMostBits);
  }
}

TEST(StepCodec, ALostFrameIsMissedAndAKeyframeGoesOn) {
  SteppedHair hair = walking_hair();
  Stream stream(hair);
  for (int i = 0; i < 10; ++i) stream.pass(hair.step());
  static_cast<void>(stream.encoder->encode(hair.step().snapshot));
  const EncodedFramePtr after = stream.encoder->encode(hair.step().snapshot);
  const auto missed = stream.decoder->decode(after->message);
  ASSERT_FALSE(missed);
  EXPECT_EQ(missed.error().code, ErrorCode::Unavailable);
  const JoinFrames frames = stream.encoder->encode_for_join(hair.step().snapshot);
  ASSERT_TRUE(stream.decoder->decode(frames.keyframe->message));
  for (int i = 0; i < 10; ++i) {
    stream.pass(hair.step());
    EXPECT_TRUE(stream.is_step());
  }
}

/// What acts on strands besides a model's kernel, each in a scene.
struct BesideCase {
  const char* name;
  void (*add)(SceneDesc&);
  void (*forget)(StepModel&);
};
const BesideCase kBesides[] = {
    {"bend_limit",
     [](SceneDesc& scene) { scene.bend_limit.most_root_deg = scene.bend_limit.most_tip_deg = 4.0; },
     [](StepModel& model) { model.bend.reset(); }},
    {"oriented_drag", [](SceneDesc& scene) { scene.wind.along_share = 0.3f; },
     [](StepModel& model) { model.drag_along_share = 1.0; }},
    {"body",
     [](SceneDesc& scene) {
       scene.body.capsules = {{kJoint, kJoint}, {"", "", {-0.2, -0.2, 0.0}, {0.1, -0.2, 0.0}, 0.06, 0.05}};
       scene.body.planes = {{{0.0, -0.24, 0.0}, {0.0, 1.0, 0.1}, {0.05, 0.0, 0.0}}};
       scene.body.joint_offset_m = glm::dvec3(0.0);
     },
     [](StepModel& model) { model.meets_body = false; }},
    {"field", [](SceneDesc& scene) { scene.head.collider = kFieldCollider; },
     [](StepModel& model) { model.field = nullptr; }},
};

// What is refused changes nothing. A bit of an integer that nothing was made of may be damaged without being
// noticed, and matters to nobody.
TEST(StepCodec, DamagedBytesChangeNothing) {
  constexpr size_t kBodyAt = kFrameHeaderBytes + kStrandFixedBytes;
  constexpr int kFrames = 30;
  for (const std::string& solver : {kSolvers[0], kSolvers[1], std::string("dftl and all besides")}) {
    SCOPED_TRACE(solver);
    SceneDesc scene = stepped_scene(kStrands, kVertices, solver.substr(0, solver.find(' ')));
    if (solver.find(' ') != std::string::npos)
      for (const BesideCase& beside : kBesides) beside.add(scene);
    SteppedHair hair(scene);
    hair.settle(40);
    Stream stream(hair);
    size_t refused = 0;
    for (int i = 0; i < kFrames; ++i) {
      const SteppedState state = hair.step();
      const bool is_join = i == kFrames / 2;
      const EncodedFramePtr frame = is_join ? stream.encoder->encode_for_join(state.snapshot).frame
                                            : stream.encoder->encode(state.snapshot);
      const std::vector<std::byte>& good = frame->message;
      const size_t body = good.size() - kBodyAt;
      // Of the state hash; the flags; what is said of the steps; the integers.
      std::vector<size_t> places = {kBodyAt - 1, kBodyAt};
      for (size_t k = 0; k < 3; ++k) {
        places.push_back(kBodyAt + 2 + (static_cast<size_t>(i) + 2 * k) % 5);
        places.push_back(good.size() - 1 - (body / 4 * k + static_cast<size_t>(i)) % (body / 2));
      }
      Result<std::shared_ptr<const Snapshot>> decoded = make_error(ErrorCode::BadInput, "nothing yet");
      for (const size_t place : places) {
        std::vector<std::byte> bad = good;
        bad[place] ^= std::byte{0x40};
        decoded = stream.decoder->decode(bad);
        if (decoded) break;
        ++refused;
      }
      // The first frame tells the field, of which strands may reach a damaged part later.
      if (!decoded || i == 0) decoded = stream.decoder->decode(good);
      ASSERT_TRUE(decoded) << "frame " << i << ": " << decoded.error().to_string();
      EXPECT_EQ((*decoded)->tick, state.snapshot.tick);
      EXPECT_LE(largest_error_m(state, **decoded), kBoundM);
    }
    EXPECT_GE(refused, 7u * kFrames);
  }
}

TEST(StepCodec, HalfAndAThirdOfTheStatesTakeAStepForEachTick) {
  for (const int every : {2, 3}) {
    SteppedHair hair = walking_hair();
    Stream stream(hair);
    for (int i = 0; i < 20; ++i) {
      hair.settle(every - 1);
      stream.pass(hair.step());
      if (i > 1) {
        EXPECT_TRUE(stream.is_step());
      }
    }
    EXPECT_EQ(stream.keyframes, 1);
  }
}

TEST(StepCodec, APrefixOfTheStrandsIsAStreamOfItsOwn) {
  for (const std::string& solver : kSolvers) {
    SCOPED_TRACE(solver);
    SteppedHair hair = walking_hair(solver);
    Stream stream(hair);
    for (int i = 0; i < 20; ++i) {
      SteppedState state = hair.step();
      state.snapshot = prefix_of(state.snapshot, 45);
      std::vector<glm::vec3> positions;
      for (size_t v = 0; v < kVertices; ++v)
        for (size_t s = 0; s < 45; ++s) positions.push_back(state.position_in_head_m[v * kStrands + s]);
      state.position_in_head_m = positions;
      stream.pass(state);
      if (i > 1) {
        EXPECT_TRUE(stream.is_step());
      }
    }
  }
}

/// Ten frames, what happens, ten more: one chain, within the bound, by steps again in the end.
void expect_going_on(const std::string& solver, const std::string& what,
                     const std::function<SteppedState(SteppedHair&)>& happens) {
  SCOPED_TRACE(solver + ": " + what);
  SteppedHair hair = walking_hair(solver);
  Stream stream(hair);
  for (int i = 0; i < 10; ++i) stream.pass(hair.step());
  stream.pass(happens(hair));
  for (int i = 0; i < 10; ++i) stream.pass(hair.step());
  EXPECT_EQ(stream.keyframes, 1);
  EXPECT_TRUE(stream.is_step());
}

TEST(StepCodec, GoesOnThroughWhatHappensToAScene) {
  const auto changed = [](const std::function<void(SceneDesc&)>& change) {
    return [change](SteppedHair& hair) {
      SceneDesc scene = hair.scene();
      change(scene);
      hair.change(scene);
      return hair.step();
    };
  };
  const auto walked = [](SteppedHair& hair, const std::function<void(InputFrame&)>& change,
                         double input_rate = 1.0) {
    InputFrame input;
    input.has_motion = true;
    input.world_from_head = walking_head(static_cast<double>(hair.tick() + 1) / hair.scene().step_rate_hz);
    change(input);
    return hair.step(input, input_rate);
  };
  for (const std::string& solver : kSolvers) {
    expect_going_on(solver, "pause", [](SteppedHair& hair) { return hair.state(); });
    expect_going_on(solver, "reset", [](SteppedHair& hair) {
      hair.reset();
      return hair.state();
    });
    expect_going_on(solver, "teleport", [&](SteppedHair& hair) {
      return walked(hair, [](InputFrame& input) {
        input.has_teleported = true;
        input.world_from_head.position_m += glm::dvec3(100.0, 5.0, -30.0);
      });
    });
    expect_going_on(solver, "a jump that strands feel", [&](SteppedHair& hair) {
      return walked(hair, [](InputFrame& input) { input.world_from_head.position_m.x += 0.5; });
    });
    expect_going_on(solver, "slow motion", [&](SteppedHair& hair) {
      return walked(
          hair, [](InputFrame&) {}, 1.7);
    });
    expect_going_on(solver, "a wind stream", [&](SteppedHair& hair) {
      return walked(hair, [](InputFrame& input) {
        input.has_wind_stream = true;
        input.wind_mps = {3.0f, 0.5f, -1.0f};
      });
    });
    expect_going_on(solver, "a trail that is too short", [](SteppedHair& hair) {
      hair.settle(kMostTrailTicks);
      return hair.step();
    });
    expect_going_on(solver, "no trail", [](SteppedHair& hair) {
      SteppedState state = hair.step();
      state.snapshot.trail = nullptr;
      return state;
    });
    expect_going_on(solver, "other wind", changed([](SceneDesc& scene) {
                      scene.wind.mean_mps = {4.0f, 0.0f, 2.0f};
                    }));
    expect_going_on(solver, "other gravity", changed([](SceneDesc& scene) {
                      scene.gravity_mps2 = {0.0, -3.0, 1.0};
                    }));
    expect_going_on(solver, "a collider", changed([](SceneDesc& scene) {
                      scene.colliders = {{glm::vec3(0.0f, 0.0f, 0.02f), 0.1f}};
                    }));
    expect_going_on(solver, "substeps", changed([](SceneDesc& scene) { scene.substeps = 3; }));
    expect_going_on(solver, "a parameter",
                    changed([](SceneDesc& scene) { scene.solver.parameters["air_drag_per_s"] = 4.0; }));
    expect_going_on(solver, "another solver", changed([](SceneDesc& scene) {
                      scene.solver = {"mass_spring", {}};
                    }));
  }
}

// States of a paused simulation come again and again.
TEST(StepCodec, AHeadThatItDoesNotKnowCostsBitsAndNothingElse) {
  for (const char* solver : {"dftl", "direct_rod"}) {
    SCOPED_TRACE(solver);
    SceneDesc scene = stepped_scene(300, 16, solver);
    scene.head.collider = kFieldCollider;
    SteppedHair hair(scene);
    hair.settle(30);
    Stream stream(hair), other(hair, "tangent");
    size_t bytes = 0, tangent_bytes = 0;
    for (int frame = 0; frame < 60; ++frame) {
      const SteppedState state = hair.step();
      stream.pass(state);
      other.pass(state);
      if (frame < 10) continue;
      bytes += stream.bytes();
      tangent_bytes += other.bytes();
    }
    EXPECT_EQ(stream.keyframes, 1);
    EXPECT_LT(bytes, tangent_bytes) << "still worth it";
  }
}

TEST(StepCodec, APauseForgetsNothing) {
  for (const std::string& solver : kSolvers) {
    SCOPED_TRACE(solver);
    SteppedHair hair = walking_hair(solver);
    Stream stream(hair);
    for (int i = 0; i < 30; ++i) stream.pass(hair.step());
    const size_t before = stream.bytes();
    for (int i = 0; i < 5; ++i) stream.pass(hair.state());
    stream.pass(hair.step());
    EXPECT_TRUE(stream.is_step());
    EXPECT_LT(stream.bytes(), before + before / 2);
  }
}

TEST(StepCodec, IsTangentWhileTheSolverHasNoKernel) {
  SteppedHair hair = walking_hair();
  Stream stream(hair);
  for (int i = 0; i < 5; ++i) stream.pass(hair.step());
  hair.forget_model();
  for (int i = 0; i < 5; ++i) {
    stream.pass(hair.step());
    EXPECT_FALSE(stream.is_step());
  }
  // Who joins now knows no solver, and hears of the next one as everybody does.
  const SteppedState state = hair.step();
  const JoinFrames frames = stream.encoder->encode_for_join(state.snapshot);
  const auto joiner = Stream::watcher(hair);
  ASSERT_TRUE(joiner->decode(frames.keyframe->message));
  ASSERT_TRUE(stream.decoder->decode(frames.frame->message));
  hair.tell_model();
  for (int i = 0; i < 10; ++i) {
    stream.pass(hair.step());
    const auto decoded = joiner->decode(stream.frame->message);
    ASSERT_TRUE(decoded) << decoded.error().to_string();
    if (i == 0) {
      EXPECT_NE(step_flags_of(*stream.frame) & kModelFlag, 0);
    }
    if (i > 0) {
      EXPECT_TRUE(stream.is_step());
    }
  }
  EXPECT_EQ(stream.keyframes, 1);
}

TEST(StepCodec, TellsASceneOnceAndAModelOnce) {
  SteppedHair hair = walking_hair();
  Stream stream(hair);
  for (int i = 0; i < 6; ++i) {
    if (i == 3) {
      SceneDesc scene = hair.scene();
      scene.wind.mean_mps = {4.0f, 0.0f, 2.0f};
      hair.change(scene);
    }
    stream.pass(hair.step());
    if (i == 0) continue;
    EXPECT_EQ((step_flags_of(*stream.frame) & kSceneFlag) != 0, i == 3);
    EXPECT_EQ(step_flags_of(*stream.frame) & kModelFlag, 0);
  }
}

// Of the bytes that tangent takes beside those that every frame has. Headers and weights are most of what is
// left of so few strands.
TEST(StepCodec, EverySolverWithAKernelTakesAFractionOfTangentsBytes) {
  constexpr double kMostShare = 0.2;
  constexpr size_t kFixedBytes = kFrameHeaderBytes + kStrandFixedBytes;
  constexpr int kFirst = 25;
  for (const SolverRow& row : solver_table()) {
    SCOPED_TRACE(row.name);
    if (!row.has_kernel) continue;
    SteppedHair hair(stepped_scene(300, 16, row.name));
    hair.settle(40);
    Stream by_steps(hair);
    Stream by_motion(hair, "tangent");
    double step_bytes = 0.0, motion_bytes = 0.0;
    for (int i = 0; i < kFirst + 15; ++i) {
      const SteppedState state = hair.step();
      EXPECT_TRUE(state.snapshot.trail);
      by_steps.pass(state);
      by_motion.pass(state);
      if (i < kFirst) continue;
      EXPECT_TRUE(by_steps.is_step()) << "frame " << i;
      step_bytes += static_cast<double>(by_steps.bytes()) - kFixedBytes;
      motion_bytes += static_cast<double>(by_motion.bytes() - kFixedBytes);
    }
    EXPECT_LT(step_bytes, kMostShare * motion_bytes);
    RecordProperty(row.name, std::to_string(step_bytes / motion_bytes));
  }
}

TEST(StepCodec, ForcesBetweenStrandsArePredicted) {
  for (const std::string& solver : kSolvers)
    for (const bool has_air : {false, true}) {
      SCOPED_TRACE(solver + (has_air ? " in air" : ""));
      SceneDesc scene = stepped_scene(300, kVertices, solver);
      scene.volume.friction_per_s = 20.0;
      scene.volume.repulsion_per_s2 = 18000.0;
      scene.volume.target_per_s2 = 500.0;
      scene.volume.wind_width_m = 0.002;
      scene.volume.resolution = 16;
      scene.volume.air.acts = has_air;
      SteppedHair hair(scene);
      hair.settle(40);
      const std::vector<SteppedState> states = recorded(hair, 40);
      Stream stream(hair);
      size_t told = 0;
      for (const SteppedState& state : states) {
        stream.pass(state);
        if (!is_keyframe(*stream.frame)) told += stream.bytes();
      }
      EXPECT_EQ(stream.keyframes, 1);
      // The same strands with a model that says nothing of it.
      const auto silent = std::make_shared<StepModel>(*states.front().snapshot.trail->model);
      silent->volume = {};
      Stream other(hair);
      size_t untold = 0;
      for (SteppedState state : states) {
        auto trail = std::make_shared<StepTrail>(*state.snapshot.trail);
        trail->model = silent;
        state.snapshot.trail = trail;
        other.pass(state);
        if (!is_keyframe(*other.frame)) untold += other.bytes();
      }
      EXPECT_LT(told, untold / 2) << told << " and " << untold << " bytes";
      std::set<std::vector<std::vector<std::byte>>> all;
      const std::vector<SteppedState> some(states.begin(), states.begin() + 6);
      for (const simd::InstructionSet set : simd::instruction_sets())
        for (const uint32_t threads : {1u, 3u})
          all.insert(messages_of(hair, some, *own_workers(threads), set));
      EXPECT_EQ(all.size(), 1u) << "sets and threads";
    }
}

size_t bytes_of_deltas(const SteppedHair& hair, const std::vector<SteppedState>& states) {
  Stream stream(hair);
  size_t bytes = 0;
  for (const SteppedState& state : states) {
    stream.pass(state);
    if (!is_keyframe(*stream.frame)) bytes += stream.bytes();
  }
  EXPECT_EQ(stream.keyframes, 1);
  return bytes;
}

// The decoder bends, drags and pushes what it has decoded likewise; who joins knows no less.
TEST(StepCodec, WhatActsOnStrandsBesidesIsPredicted) {
  for (const std::string& solver : kSolvers) {
    for (const BesideCase& beside : kBesides) {
      SCOPED_TRACE(solver + " " + beside.name);
      SceneDesc scene = stepped_scene(300, kVertices, solver);
      beside.add(scene);
      SteppedHair hair(scene);
      hair.settle(40);
      const std::vector<SteppedState> states = recorded(hair, 40);
      ASSERT_TRUE(states.front().snapshot.trail->model->has_passes());
      const size_t told = bytes_of_deltas(hair, states);
      // The same strands with a model that says nothing of it.
      const auto silent = std::make_shared<StepModel>(*states.front().snapshot.trail->model);
      beside.forget(*silent);
      std::vector<SteppedState> of_silent = states;
      for (SteppedState& state : of_silent) {
        auto trail = std::make_shared<StepTrail>(*state.snapshot.trail);
        trail->model = silent;
        state.snapshot.trail = trail;
      }
      const size_t untold = bytes_of_deltas(hair, of_silent);
      fmt::print("{} {}: {} bytes, {} untold\n", solver, beside.name, told, untold);
      EXPECT_LT(told, untold * 3 / 4);
      std::set<std::vector<std::vector<std::byte>>> all;
      const std::vector<SteppedState> some(states.begin(), states.begin() + 6);
      for (const simd::InstructionSet set : simd::instruction_sets())
        for (const uint32_t threads : {1u, 3u})
          all.insert(messages_of(hair, some, *own_workers(threads), set));
      EXPECT_EQ(all.size(), 1u) << "sets and threads";

      Stream joined(hair);
      const auto joiner = Stream::watcher(hair);
      for (size_t i = 0; i < states.size(); ++i) {
        if (i != 10) {
          joined.pass(states[i]);
        } else {
          const JoinFrames frames = joined.encoder->encode_for_join(states[i].snapshot);
          ASSERT_TRUE(joined.decoder->decode(frames.frame->message));
          ASSERT_TRUE(joiner->decode(frames.keyframe->message));
        }
        if (i > 10) {
          const auto decoded = joiner->decode(joined.frame->message);
          ASSERT_TRUE(decoded) << i << ": " << decoded.error().to_string();
        }
      }
    }
  }
}

// What a joiner gets besides: of a head only what is near its skin.
TEST(StepCodec, AHeadsFieldTakesLittleOfAKeyframe) {
  SceneDesc scene = stepped_scene(kStrands, kVertices);
  scene.head.collider = kFieldCollider;
  SteppedHair hair(scene);
  const StepModel& model = *hair.step().snapshot.trail->model;
  ASSERT_NE(model.field, nullptr);
  std::vector<std::byte> bytes;
  step::write_model(model, hair.rest_in_head_m(), kStrands, bytes);
  fmt::print("{} nodes in {} bytes\n", model.field->grid.size(), bytes.size());
  EXPECT_LT(bytes.size(), 16'000u);
  // Where strands are turned it is the field, to half a step.
  const auto quads = field_quads(*model.field);
  const auto content = load_scene_content(scene);
  ASSERT_TRUE(content.ok());
  const std::vector<glm::vec4>& exact = content->head_field->quad;
  ASSERT_EQ(quads.size(), exact.size());
  size_t near = 0;
  for (size_t i = 0; i < exact.size(); ++i)
    for (int corner = 0; corner < 4; ++corner) {
      if (exact[i][corner] > 0.014f || exact[i][corner] < -0.039f) continue;
      ++near;
      ASSERT_NEAR(quads[i][corner], exact[i][corner], 0.5001f * kToldFieldStepM);
    }
  EXPECT_GT(near, exact.size() / 20);
}

/// Bytes of 18 frames of hair, of which so many of three strands are held at their tips.
size_t bytes_of_tied(const std::string& solver, uint32_t tied_of_three) {
  TestGroomDesc desc;
  desc.strand_count = 37;
  Groom groom = make_test_groom(desc);
  for (uint32_t s = 0; s < desc.strand_count; ++s)
    for (uint32_t v = desc.vertex_count - 2; s % 3 < tied_of_three && v < desc.vertex_count; ++v)
      groom.pinned[groom.offset[s] + v] = 1;
  SceneDesc scene = stepped_scene(desc.strand_count, desc.vertex_count, solver);
  scene.colliders = {{glm::vec3(0.0f), 0.095f}};
  SteppedHair hair(scene, std::move(groom));
  hair.settle(40);
  Stream stream(hair);
  size_t bytes = 0;
  for (int i = 0; i < 20; ++i) {
    stream.pass(hair.step());
    if (i >= 2) bytes += stream.bytes();
  }
  EXPECT_EQ(stream.keyframes, 1);
  EXPECT_TRUE(stream.is_step());
  return bytes;
}

TEST(StepCodec, StrandsMayBeHeldAtBothEndsEachForItself) {
  for (const std::string& solver : kSolvers) {
    SCOPED_TRACE(solver);
    const size_t all_free = bytes_of_tied(solver, 0);
    const size_t all_tied = bytes_of_tied(solver, 3);
    // Predicted as well as either kind: nobody is taken for the other.
    EXPECT_LT(bytes_of_tied(solver, 1), std::max(all_free, all_tied) * 11 / 10);
  }
}

}  // namespace
}  // namespace strandcast::step_codec_test
