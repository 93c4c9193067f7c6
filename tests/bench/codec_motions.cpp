#include "tests/bench/codec_motions.h"

#include <algorithm>
#include <memory>
#include <variant>

#include "common/groom/groom_asset.h"
#include "common/motion/bvh.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"
#include "server/publish/publisher.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

// Steps of the lattice that states are recorded on; a 250th of the bound that is measured at.
constexpr float kRecordedStepM = 4e-7f;

SceneDesc scene_of(const SimulatedMotion& motion, const SolverRow& row) {
  SceneDesc scene = built_in_scene();
  auto& hair = std::get<ProceduralGroomDesc>(scene.groom);
  hair.strand_count = motion.strand_count;
  hair.vertex_count = motion.vertex_count;
  scene.solver.parameters["sag_free"] = 0.3;  // hair that hangs
  scene.solver.name = motion.solver;
  // What the built-in scene sets for its own solver stays as far as others have it.
  std::erase_if(scene.solver.parameters, [&row](const auto& given) {
    return std::none_of(row.parameters.begin(), row.parameters.end(),
                        [&given](const auto& info) { return info.name == given.first; });
  });
  return scene;
}

}  // namespace

Snapshot on_lattice(const Snapshot& state, float quantum_m) {
  const std::vector<glm::vec3> points = positions_in_head(state);
  QuantiseInput input{state, points, {}};
  input.quantum_m = quantum_m;
  return quantise(input).snapshot;
}

Recording record_chains(const HairMotionDesc& desc, const RecordedSpan& part) {
  HairMotion hair(desc);
  Recording recording;
  recording.rest_in_head_m = hair.rest_in_head();
  for (int i = 0; i < part.warm_up + part.count; ++i) {
    hair.step();
    if (i >= part.warm_up) recording.states.push_back(hair.snapshot(kRecordedStepM));
  }
  return recording;
}

Result<Recording> record_simulation(const SimulatedMotion& motion, const RecordedSpan& part) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(motion.solver));
  MotionClip clip;
  if (!motion.clip.empty()) {
    ASSIGN_OR_RETURN(clip, load_bvh(motion.clip, {}));
  }
  const auto head_at = [&](double time_s) {
    return motion.clip.empty() ? built_in_motion(time_s) : clip.sample(motion.clip_begin_s + time_s);
  };
  const SceneDesc scene = scene_of(motion, *row);
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  const std::unique_ptr<Solver> solver = row->make_reference(parameters);
  RETURN_IF_ERROR(solver->load(content.groom, head_at(0.0).rotation));
  StepBuilder builder(scene, content.colliders);
  Publisher publisher(content.groom, kRecordedStepM);
  Recording recording;
  recording.rest_in_head_m = make_scene_asset(content.groom, {}).rest_position_m;
  for (int tick = 1; tick <= part.warm_up + part.count; ++tick) {
    const double time_s = tick / scene.step_rate_hz;
    InputFrame input;
    input.has_motion = true;
    input.is_motion_stale = false;
    input.world_from_head = head_at(time_s);
    const SceneStep& step = builder.build(input, analyse(scene, {}), time_s);
    for (const StepInput& substep : step.substeps) solver->substep(substep);
    if (tick <= part.warm_up) continue;
    PublishInput publish;
    publish.tick = static_cast<uint64_t>(tick);
    publish.sim_time_ns = std::llround(time_s * 1e9);
    publish.world_from_head = step.world_from_head;
    recording.states.push_back(*publisher.publish(*solver, publish));
  }
  return recording;
}

}  // namespace strandcast
