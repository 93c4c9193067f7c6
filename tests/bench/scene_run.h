// The built-in scene as the server runs it, on the CPU: head motion, gusts, its solver, publishing.
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/groom/groom_asset.h"
#include "common/motion/motion_clip.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"
#include "server/publish/publisher.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

class BuiltInScene {
 public:
  /// `quantum_m`: step of the published lattice.
  explicit BuiltInScene(float quantum_m)
      : scene_(built_in_scene()),
        content_(std::move(load_scene_content(scene_)).value()),
        builder_(scene_, content_.colliders),
        publisher_(content_.groom, quantum_m) {
    const auto row = find_solver(scene_.solver.name);
    CHECK(row.ok());
    solver_ = (*row)->make_reference(complete_parameters(**row, scene_.solver.parameters).value());
    CHECK(solver_->load(content_.groom, built_in_motion(0.0).rotation).ok());
  }

  const SceneDesc& scene() const { return scene_; }
  SceneAsset asset() const { return make_scene_asset(content_.groom, content_.head); }
  std::vector<glm::vec3> rest_in_head() const { return asset().rest_position_m; }

  /// The next step of the head's motion; after stop_head() the head stays where it is.
  Snapshot next() {
    ++tick_;
    const double time_s = static_cast<double>(tick_) / scene_.step_rate_hz;
    if (!is_head_still_) head_time_s_ = time_s;
    InputFrame input;
    input.has_motion = true;
    input.is_motion_stale = false;
    input.world_from_head = built_in_motion(head_time_s_);
    const SceneStep& step = builder_.build(input, analyse(scene_, {}), time_s);
    for (const StepInput& substep : step.substeps) solver_->substep(substep);
    PublishInput publish;
    publish.tick = tick_;
    publish.sim_time_ns = std::llround(time_s * 1e9);
    publish.world_from_head = step.world_from_head;
    return *publisher_.publish(*solver_, publish);
  }
  void stop_head() { is_head_still_ = true; }

 private:
  SceneDesc scene_;
  SceneContent content_;
  StepBuilder builder_;
  Publisher publisher_;
  std::unique_ptr<Solver> solver_;
  uint64_t tick_ = 0;
  double head_time_s_ = 0.0;
  bool is_head_still_ = false;
};

}  // namespace strandcast
