// Hair that a solver of the table moves on processors, one published state after the other, with the trail of
// steps that the codec "step" predicts by. For tests; small, deterministic.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/groom/groom_asset.h"
#include "common/strands/snapshot.h"
#include "common/strands/strand_codec.h"
#include "server/scene/scene_content.h"
#include "server/scene/shared_hair.h"
#include "server/scene/step_builder.h"
#include "server/scene/step_log.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// A published state, and where the solver's own numbers have the vertices.
struct SteppedState {
  Snapshot snapshot;
  std::vector<glm::vec3> position_in_head_m;  // (vertex_count x strand_count), strand fastest
  std::vector<glm::vec3> velocity_mps;        // likewise; world
  std::shared_ptr<const SharedState> shared;  // for encoders; null: the solver stepped it
};

/// The built-in scene with its head, wind and follicles, with so many strands.
inline SceneDesc stepped_scene(uint32_t strand_count, uint32_t vertex_count, std::string solver = "dftl") {
  SceneDesc scene = built_in_scene();
  auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  groom.strand_count = strand_count;
  groom.vertex_count = vertex_count;
  scene.solver.parameters["sag_free"] = 0.3;  // hair that hangs
  if (scene.solver.name != solver) scene.solver = {std::move(solver), {}};
  return scene;
}

/// Where the state hash of a frame stands.
inline size_t state_hash_at(const EncodedFrame& frame) {
  return kFrameHeaderBytes + (is_exact(frame) ? 1 : 88);
}
/// Flags of a delta of "step"; those of an exact frame are not told.
inline int step_flags_of(const EncodedFrame& frame) {
  return is_exact(frame) ? 2 + 16 : std::to_integer<int>(frame.message[state_hash_at(frame) + 8]);
}

/// Someone who walks and looks about.
inline Pose walking_head(double t_s) {
  Pose pose;
  pose.position_m = {0.02 * std::sin(5.75 * t_s), 1.6 + 0.025 * std::sin(11.5 * t_s), 1.25 * t_s};
  pose.rotation = glm::angleAxis(0.5 * std::sin(2.1 * t_s), glm::dvec3(0.0, 1.0, 0.0)) *
                  glm::angleAxis(0.15 * std::sin(3.3 * t_s), glm::dvec3(1.0, 0.0, 0.0));
  return pose;
}

/// A joint that goes up and down beside the neck.
inline constexpr const char* kJoint = "shoulder";
inline glm::dvec3 lifted_joint(double t_s) {
  return {0.1, -0.14 + 0.05 * std::sin(6.0 * t_s), 0.01 * std::sin(4.0 * t_s)};
}

class SteppedHair {
 public:
  static constexpr float kBoundM = 1e-4f;

  explicit SteppedHair(const SceneDesc& scene) : SteppedHair(scene, loaded(scene)) {}
  SteppedHair(const SceneDesc& scene, Groom groom)
      : SteppedHair(scene, content_of(scene, std::move(groom))) {}
  SteppedHair(const SceneDesc& scene, SceneContent content)
      : scene_(scene),
        content_(std::move(content)),
        executor_(std::move(make_lanes_executor()).value()),
        features_(analyse(scene, {})),
        builder_(scene, content_.colliders) {
    solver_ = made();
    EXPECT_TRUE(solver_->load(content_.groom, walking_head(0.0).rotation));
    log_.set_model(solver_->step_model());
    rest_in_head_m_ = make_scene_asset(content_.groom, {}).rest_position_m;
  }

  /// (vertex_count x strand_count), strand fastest
  const std::vector<glm::vec3>& rest_in_head_m() const { return rest_in_head_m_; }
  uint32_t strand_count() const { return content_.groom.strand_count(); }
  uint32_t vertex_count() const { return content_.groom.uniform_vertex_count(); }
  const SceneDesc& scene() const { return scene_; }
  uint64_t tick() const { return tick_; }

  /// One step of the walk.
  SteppedState step() {
    InputFrame input;
    input.has_motion = true;
    const double time_s = static_cast<double>(tick_ + 1) / scene_.step_rate_hz;
    input.world_from_head = walking_head(time_s);
    input.joints = {{kJoint}, {lifted_joint(time_s)}};
    return step(input);
  }
  SteppedState step(InputFrame input, double input_rate = 1.0) {
    take(input, input_rate);
    return state();
  }
  /// Steps of the walk that nobody sees.
  void settle(int steps) {
    for (int i = 0; i < steps; ++i) step();
  }
  /// As it is now, published once more.
  SteppedState state() {
    SolverState solver_state;
    if (shared_.is_active())
      solver_state = state_of(shared_.read_blocks());
    else
      solver_->read(solver_state);
    const Pose& pose = builder_.world_from_head();
    const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(pose.rotation));
    SteppedState state;
    state.velocity_mps = solver_state.velocity_mps;
    for (const glm::vec3& point : solver_state.position_m)
      state.position_in_head_m.emplace_back(head_from_world * glm::dvec3(point));
    QuantiseInput input;
    input.tick = tick_;
    input.sim_time_ns = std::llround(static_cast<double>(tick_) / scene_.step_rate_hz * 1e9);
    input.world_from_head = pose;
    input.bust = builder_.bust();
    input.strand_count = strand_count();
    input.vertex_count = vertex_count();
    input.quantum_m = lattice_step_m("step", kBoundM).value();
    log_.set_scene(builder_.step_scene(features_));
    input.trail = log_.trail(shared_.number());
    if (shared_.is_active()) state.shared = shared_.state();
    input.position_in_head_m = state.position_in_head_m;
    state.snapshot = quantise(input).snapshot;
    return state;
  }
  /// All strands at rest, at the same tick.
  void reset() {
    shared_.drop(tick_);
    EXPECT_TRUE(solver_->load(content_.groom, builder_.world_from_head().rotation));
  }
  /// Goes on from what viewers have, as a simulation that shares their steps.
  void share(const SharedUpdate& update) { shared_.follow(update, *log_.trail(), scene_.step_rate_hz); }
  /// As a change of a scene that runs: another solver goes on where the one before is.
  void change(const SceneDesc& scene) {
    const bool is_other_solver = !(scene.solver == scene_.solver);
    scene_ = scene;
    features_ = analyse(scene, {});
    builder_.change(scene, colliders_of(scene, content_.head_colliders));
    if (!is_other_solver) return;
    shared_.leave(*solver_, builder_.world_from_head().rotation, tick_);
    std::unique_ptr<Solver> before = std::move(solver_);
    solver_ = made();
    const glm::dquat& rotation = builder_.world_from_head().rotation;
    EXPECT_TRUE(hand_over(*before, *solver_, content_.groom, rotation));
    log_.set_model(solver_->step_model());
  }
  /// Neck and chest have a pose of their own from the next step on.
  void move_bust() { builder_.set_bust(content_.bust); }
  const SceneContent& content() const { return content_; }
  const StepBuilder& builder() const { return builder_; }
  /// What a solver without a kernel says.
  void forget_model() { log_.set_model(nullptr); }
  void tell_model() { log_.set_model(solver_->step_model()); }

 private:
  static SceneContent content_of(const SceneDesc& scene, Groom groom) {
    SceneContent content;
    content.groom = std::move(groom);
    content.colliders = scene.colliders;
    return content;
  }

  /// To fit a head to the hair takes most of the time: kept for the next one.
  static SceneContent loaded(const SceneDesc& scene) {
    static std::vector<std::pair<SceneDesc, SceneContent>> known;
    SceneDesc look_up = scene;
    look_up.solver = {};
    for (const auto& [desc, content] : known)
      if (desc == look_up) return content;
    auto content = load_scene_content(scene);
    EXPECT_TRUE(content) << content.error().to_string();
    known.emplace_back(look_up, std::move(content).value());
    return known.back().second;
  }
  std::unique_ptr<Solver> made() {
    const SolverRow* row = find_solver(scene_.solver.name).value();
    const SolverParameters parameters = complete_parameters(*row, scene_.solver.parameters).value();
    SolverContext context{executor_.get(), features_};
    context.groom_gravity_in_head_mps2 = builder_.groom_gravity_in_head_mps2();
    context.volume = scene_.volume;
    context.bend_limit = scene_.bend_limit;
    context.head_field = content_.head_field;
    context.drag_along_share = scene_.wind.along_share;
    auto solver = row->make(parameters, context);
    EXPECT_TRUE(solver) << solver.error().to_string();
    return std::move(solver).value();
  }
  void take(const InputFrame& input, double input_rate) {
    ++tick_;
    builder_.begin(input, static_cast<double>(tick_) / scene_.step_rate_hz, input_rate);
    if (features_.has_wind) builder_.add_wind();
    if (features_.has_turbulence) builder_.add_gusts();
    if (features_.has_colliders) builder_.add_colliders();
    if (features_.has_follicle_limit) builder_.add_follicle_limit();
    if (features_.has_body) builder_.add_body();
    if (shared_.is_active()) {
      shared_.step(builder_.step_tick(tick_), builder_.step_scene(features_), scene_.step_rate_hz);
      log_.add(builder_.step_tick(tick_));
      return;
    }
    const SceneStep& step = builder_.step();
    if (step.carried_to_rotation) solver_->rebase(*step.carried_to_rotation);
    for (const StepInput& substep : step.substeps) solver_->substep(substep);
    log_.add(builder_.step_tick(tick_));
  }

  SceneDesc scene_;
  SceneContent content_;
  std::unique_ptr<Executor> executor_;
  SceneFeatures features_;
  StepBuilder builder_;
  std::unique_ptr<Solver> solver_;
  StepLog log_;
  std::vector<glm::vec3> rest_in_head_m_;
  uint64_t tick_ = 0;
  SharedHair shared_;
};

inline constexpr uint32_t kWalkingStrands = 120;
inline constexpr uint32_t kWalkingVertices = 12;

/// Settled hair: nothing of what is tested hangs on how it falls at first.
inline SteppedHair walking_hair(const std::string& solver = "dftl", uint32_t strands = kWalkingStrands) {
  SteppedHair hair(stepped_scene(strands, kWalkingVertices, solver));
  hair.settle(40);
  return hair;
}

}  // namespace strandcast
