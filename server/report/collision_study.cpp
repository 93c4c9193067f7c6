#include "server/report/collision_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/worker_pool.h"
#include "common/math/pose.h"
#include "server/report/contact_depth.h"
#include "server/report/process_time.h"
#include "server/scene/scene_content.h"
#include "server/sim/reference_field.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

// What keeps hair out of the head, by how deep it gets in the same true field and by time.
namespace {

constexpr double kCollisionStepS = 1.0 / 60.0;
constexpr double kShakeMps2 = 10.0 * 9.80665, kShakeHz = 5.0;
constexpr double kYawRad = std::numbers::pi / 6.0, kYawHz = 3.0;
/// Who is deeper than so outside of the field cannot be in the mesh.
constexpr double kNearMeshM = 0.003;
constexpr double kOutsideAsLoadedM = 0.001;
constexpr uint32_t kEveryStrand = 1, kSomeStrands = 5;

/// 10 g to and fro, while it says no.
Pose shaken_hard(double t_s) {
  const double rate = 2.0 * std::numbers::pi * kShakeHz;
  const double yaw = kYawRad * std::sin(2.0 * std::numbers::pi * kYawHz * t_s);
  return {glm::dvec3(kShakeMps2 / (rate * rate) * std::sin(rate * t_s), 0.0, 0.0),
          glm::angleAxis(yaw, glm::dvec3(0.0, 1.0, 0.0))};
}

/// How deep a point is in the mesh; 0 outside. Winding numbers, in double, by every triangle.
double depth_in_mesh_m(const Mesh& mesh, const glm::dvec3& point_m) {
  double nearest_m = 1.0, winding = 0.0;
  for (const glm::uvec3& t : mesh.triangle) {
    const glm::dvec3 u(mesh.position_m[t.x]), v(mesh.position_m[t.y]), w(mesh.position_m[t.z]);
    nearest_m = std::min(nearest_m, distance_to_triangle_m(point_m, u, v, w));
    const glm::dvec3 x = u - point_m, y = v - point_m, z = w - point_m;
    const double lx = glm::length(x), ly = glm::length(y), lz = glm::length(z);
    winding += std::atan2(glm::dot(x, glm::cross(y, z)),
                          lx * ly * lz + glm::dot(x, y) * lz + glm::dot(y, z) * lx + glm::dot(z, x) * ly);
  }
  return std::abs(winding) > std::numbers::pi ? nearest_m : 0.0;
}

/// The deepest vertex in the mesh of those that hair as loaded has outside.
double deepest_in_mesh_m(const SceneContent& content, const DistanceField& field, const SolverState& state,
                         const glm::dquat& world_from_head) {
  const Groom& groom = content.groom;
  const uint32_t strands = groom.strand_count();
  const glm::dquat turn = glm::conjugate(world_from_head);
  std::vector<double> deepest_m(strands, 0.0);
  shared_workers().for_ranges(strands, 64, [&](size_t begin, size_t end, uint32_t) {
    for (size_t s = begin; s < end; ++s)
      for (uint32_t i = 1; i < groom.uniform_vertex_count(); ++i) {
        const uint32_t at = groom.offset[s] + i;
        if (groom.pinned[at] != 0) continue;
        const glm::dvec3 place_m = turn * glm::dvec3(state.position_m[i * strands + s]);
        if (field.sample(place_m).distance_m > kNearMeshM ||
            field.sample(glm::dvec3(groom.rest_position_m[at])).distance_m < kOutsideAsLoadedM)
          continue;
        deepest_m[s] = std::max(deepest_m[s], depth_in_mesh_m(content.head, place_m));
      }
  });
  return *std::max_element(deepest_m.begin(), deepest_m.end());
}

struct Contestant {
  HeadCollision found;
  std::unique_ptr<Solver> solver;
  std::vector<SphereCollider> spheres;
  std::vector<double> cpu_ms = {};
  DepthRecord shaken = {}, settled = {};

  void step(StepInput input) {
    for (const SphereCollider& sphere : spheres)
      input.colliders.push_back(
          {glm::vec3(input.world_from_head_rotation * glm::dvec3(sphere.center_m)), sphere.radius_m});
    const double begin_ms = process_cpu_ms();
    solver->substep(input);
    cpu_ms.push_back(process_cpu_ms() - begin_ms);
  }
};

struct Head {
  SceneContent content;  // of the true field
  std::vector<Contestant> contestants;
};

Result<Contestant> make_contestant(SceneDesc scene, const SolverRow& row, Executor& executor,
                                   uint32_t resolution, const char* name) {
  const bool has_field = resolution > 0;
  scene.head.collider = has_field ? kFieldCollider : kSphereCollider;
  if (has_field) scene.head.field_resolution = resolution;
  const int64_t begin_ns = now_ns();
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  Contestant made;
  made.found.name = name;
  made.found.load_ms = static_cast<double>(now_ns() - begin_ns) * 1e-6;
  SolverContext context{&executor, {}};
  if (has_field) {
    made.found.name = fmt::format("field {}", resolution);
    made.found.resolution = resolution;
    made.found.cell_m = static_cast<double>(content.head_field->cell_m);
    context.head_field = content.head_field;
    context.features.has_distance_field = true;
  } else if (std::string_view(name) == "spheres") {
    made.spheres = content.head_colliders;
    context.features.has_colliders = true;
  }
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(row, scene.solver.parameters));
  ASSIGN_OR_RETURN(made.solver, row.make(parameters, context));
  RETURN_IF_ERROR(made.solver->load(content.groom, {1.0, 0.0, 0.0, 0.0}));
  return made;
}

Result<Head> make_head(const CollisionStudyDesc& desc, const SolverRow& row, Executor& executor,
                       const CollisionProgress& progress) {
  SceneDesc scene = desc.scene;
  scene.head.collider = kFieldCollider;
  scene.head.field_resolution = kTrueFieldResolution;
  Head head;
  ASSIGN_OR_RETURN(head.content, load_scene_content(scene));
  for (const char* name : {"no head", "spheres"}) {
    ASSIGN_OR_RETURN(Contestant made, make_contestant(scene, row, executor, 0, name));
    head.contestants.push_back(std::move(made));
  }
  for (const uint32_t resolution : desc.resolutions) {
    progress(fmt::format("the head as a field of {} cells", resolution));
    ASSIGN_OR_RETURN(Contestant made, make_contestant(scene, row, executor, resolution, ""));
    head.contestants.push_back(std::move(made));
  }
  return head;
}

}  // namespace

Status measure_head_collisions(const CollisionStudyDesc& desc, Executor& executor,
                               const CollisionProgress& progress, CollisionStudy& study) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(desc.scene.solver.name));
  ASSIGN_OR_RETURN(Head head, make_head(desc, *row, executor, progress));
  const DistanceField& truth = *head.content.head_field;
  const DepthAt depth_at = [&](const glm::dvec3& place_m, const glm::dvec3& groomed_m) {
    return field_clearance_m(truth, groomed_m) - truth.sample(place_m).distance_m;
  };
  study.strand_count = head.content.groom.strand_count();
  study.vertex_count = head.content.groom.uniform_vertex_count();
  progress(fmt::format("{} steps of a shake, {} at rest", desc.shake_steps, desc.rest_steps));
  Pose before = shaken_hard(0.0);
  StepInput input;
  input.h_s = kCollisionStepS;
  SolverState state;
  for (int step = 1; step <= desc.shake_steps + desc.rest_steps; ++step) {
    const Pose now = shaken_hard(std::min(step, desc.shake_steps) * kCollisionStepS);
    input.head_shift_m = now.position_m - before.position_m;
    input.world_from_head_rotation = now.rotation;
    before = now;
    for (Contestant& contestant : head.contestants) {
      contestant.step(input);
      if (step > desc.shake_steps) continue;
      contestant.solver->read(state);
      record_depths(head.content.groom, state, now.rotation, kSomeStrands, depth_at, contestant.shaken);
    }
  }
  const double plain_ms = quantile(head.contestants.front().cpu_ms, 0.5);
  for (Contestant& contestant : head.contestants) {
    HeadCollision& found = contestant.found;
    found.step_cpu_ms = quantile(contestant.cpu_ms, 0.5);
    found.extra_cpu_ms = found.step_cpu_ms - plain_ms;
    SolverState last;
    contestant.solver->read(state);
    contestant.step(input);
    contestant.solver->read(last);
    found.rest_speed_mps = speed_rms_mps(state, last, kCollisionStepS);
    record_depths(head.content.groom, last, before.rotation, kEveryStrand, depth_at, contestant.settled);
    found.shaken = contestant.shaken.depth();
    found.settled = contestant.settled.depth();
    found.mesh_m = deepest_in_mesh_m(head.content, truth, last, before.rotation);
    study.head.push_back(found);
  }
  return {};
}

Result<CollisionStudy> run_collision_study(const CollisionStudyDesc& desc, Executor& executor,
                                           const CollisionProgress& progress) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(desc.scene.solver.name));
  if (!row->has_kernel)
    return make_error(
        ErrorCode::BadInput,
        "{} has no kernel, and meets neither a head's field nor a body; --set solver.name= names "
        "another (strandcast-server --list-solvers)",
        row->name);
  CollisionStudy study;
  study.solver = row->name;
  study.device = executor.info().name;
  RETURN_IF_ERROR(measure_head_collisions(desc, executor, progress, study));
  RETURN_IF_ERROR(measure_body_answers(desc, executor, progress, study));
  return study;
}

}  // namespace strandcast
