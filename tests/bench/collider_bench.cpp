// The head as spheres and as a distance field beside a step without any: CPU and wall time of a step in a
// shake of 10 g, how deep vertices and the middles of segments get below their clearance in it and when they
// have come to rest, against the field that the kernel looks up and against the mesh itself (in double, by
// brute force). The three take turns step by step. What the field costs is what its step takes more than that
// without.
//   collider_bench [--strands 10000] [--vertices 16] [--solver dftl] [--device lanes|gl] [--resolution 64]
//   [--steps 60]
//                  [--rest 300] [--groom FILE] [--mesh FILE]
// With --body CLIP.bvh instead the responses to the clip's body beside a step without one; --picture FILE.png
// shows moments of it.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "common/base/profile.h"
#include "common/base/quantile.h"
#include "common/base/worker_pool.h"
#include "common/groom/head_measure.h"
#include "common/math/pose.h"
#include "common/scene/features.h"
#include "common/scene/scene_file.h"
#include "server/scene/scene_content.h"
#include "server/sim/executor/executor.h"
#include "server/sim/reference_field.h"
#include "server/sim/solver_registry.h"
#include "tests/bench/body_bench.h"

namespace strandcast {
namespace {

constexpr double kStepS = 1.0 / 60.0;

int64_t process_cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

/// 10 g at 5 Hz with yaw of 30 degrees at 3 Hz.
Pose shake(double t) {
  const double rate = 2.0 * std::numbers::pi * 5.0;
  const double yaw = std::numbers::pi / 6.0 * std::sin(2.0 * std::numbers::pi * 3.0 * t);
  return {glm::dvec3(10.0 * 9.80665 / (rate * rate) * std::sin(rate * t), 0.0, 0.0),
          glm::angleAxis(yaw, glm::dvec3(0.0, 1.0, 0.0))};
}

struct Depths {
  double vertex_mm = 0.0, middle_mm = 0.0, mesh_mm = 0.0;
};

/// Below their clearances; against the mesh only where the hair as loaded is outside of it.
Depths depths_of(const SceneContent& content, const Mesh* mesh, const SolverState& state,
                 const glm::dquat& rotation) {
  const Groom& groom = content.groom;
  const DistanceField& field = *content.head_field;
  const uint32_t strands = groom.strand_count();
  const glm::dquat turn = glm::conjugate(rotation);
  std::vector<Depths> deepest(64);
  shared_workers().for_ranges(strands, 64, [&](size_t begin, size_t end, uint32_t worker) {
    Depths& own = deepest[worker];
    for (size_t s = begin; s < end; ++s)
      for (uint32_t i = 1; i < groom.uniform_vertex_count(); ++i) {
        if (groom.pinned[groom.offset[s] + i] != 0) continue;
        const glm::dvec3 a = turn * glm::dvec3(state.position_m[(i - 1) * strands + s]);
        const glm::dvec3 b = turn * glm::dvec3(state.position_m[i * strands + s]);
        const glm::dvec3 p(groom.rest_position_m[groom.offset[s] + i - 1]);
        const glm::dvec3 q(groom.rest_position_m[groom.offset[s] + i]);
        const double distance_m = field.sample(b).distance_m;
        own.vertex_mm = std::max(own.vertex_mm, 1e3 * (field_clearance_m(field, q) - distance_m));
        own.middle_mm = std::max(own.middle_mm, 1e3 * (field_clearance_m(field, 0.5 * (p + q)) -
                                                       field.sample(0.5 * (a + b)).distance_m));
        // Only what the field has near the skin can be inside of the mesh.
        if (mesh == nullptr || distance_m > 0.003 || field.sample(q).distance_m < 0.001) continue;
        double nearest_m = 1.0, winding = 0.0;
        for (const glm::uvec3& t : mesh->triangle) {
          const glm::dvec3 u(mesh->position_m[t.x]), v(mesh->position_m[t.y]), w(mesh->position_m[t.z]);
          nearest_m = std::min(nearest_m, distance_to_triangle_m(b, u, v, w));
          const glm::dvec3 x = u - b, y = v - b, z = w - b;
          const double lx = glm::length(x), ly = glm::length(y), lz = glm::length(z);
          winding += std::atan2(glm::dot(x, glm::cross(y, z)), lx * ly * lz + glm::dot(x, y) * lz +
                                                                   glm::dot(y, z) * lx + glm::dot(z, x) * ly);
        }
        if (std::abs(winding) > std::numbers::pi) own.mesh_mm = std::max(own.mesh_mm, 1e3 * nearest_m);
      }
  });
  Depths all;
  for (const Depths& own : deepest) {
    all.vertex_mm = std::max(all.vertex_mm, own.vertex_mm);
    all.middle_mm = std::max(all.middle_mm, own.middle_mm);
    all.mesh_mm = std::max(all.mesh_mm, own.mesh_mm);
  }
  return all;
}

struct Contestant {
  std::string name;
  std::unique_ptr<Solver> solver;
  std::vector<SphereCollider> colliders;
  std::vector<double> wall_ms = {}, cpu_ms = {};

  void step(StepInput input, Executor& executor) {
    for (const SphereCollider& sphere : colliders)
      input.colliders.push_back(
          {glm::vec3(input.world_from_head_rotation * glm::dvec3(sphere.center_m)), sphere.radius_m});
    const int64_t cpu_ns = process_cpu_ns();
    wall_ms.push_back(timed_ms(executor, [&] { solver->substep(input); }));
    cpu_ms.push_back(static_cast<double>(process_cpu_ns() - cpu_ns) * 1e-6);
  }
};

using Options = std::map<std::string, std::string>;

Status run(Options options) {
  std::vector<std::string> settings = {"head.field_resolution=" + options["resolution"]};
  if (!options["groom"].empty())
    settings.push_back("groom.file.path=" + options["groom"]);
  else
    settings.insert(settings.end(), {"groom.procedural.strand_count=" + options["strands"],
                                     "groom.procedural.vertex_count=" + options["vertices"]});
  if (!options["mesh"].empty()) settings.push_back("head.mesh_path=" + options["mesh"]);
  ASSIGN_OR_RETURN(SceneDesc scene, built_in_scene_with(settings));
  ASSIGN_OR_RETURN(const SceneContent balls, load_scene_content(scene));
  scene.head.collider = kFieldCollider;
  const int64_t load_ns = now_ns();
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  fmt::print("loaded in {:.0f} ms\n", static_cast<double>(now_ns() - load_ns) * 1e-6);
  for (const std::string& note : content.notes) fmt::print("{}\n", note);
  ASSIGN_OR_RETURN(const auto executor, open_executor({options["device"], "auto", {}}));
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(options["solver"]));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, {}));
  std::vector<Contestant> contestants;
  for (const char* name : {"no head", "spheres", "field"}) {
    SolverContext context{executor.get(), {}};
    context.features.has_colliders = std::strcmp(name, "spheres") == 0;
    context.features.has_distance_field = std::strcmp(name, "field") == 0;
    context.head_field = content.head_field;
    ASSIGN_OR_RETURN(auto solver, row->make(parameters, context));
    RETURN_IF_ERROR(solver->load(content.groom, {1.0, 0.0, 0.0, 0.0}));
    contestants.push_back({name, std::move(solver),
                           context.features.has_colliders ? balls.colliders : std::vector<SphereCollider>{}});
  }
  const uint32_t vertices = content.groom.uniform_vertex_count();
  fmt::print("{} on {}: {} x {} vertices, field {} cells\n", row->name, executor->info().name,
             content.groom.strand_count(), vertices, options["resolution"]);
  Depths worst;
  SolverState state;
  Pose before = shake(0.0);
  const int steps = std::stoi(options["steps"]);
  for (int step = 1; step <= steps; ++step) {
    const Pose now = shake(step * kStepS);
    StepInput input;
    input.h_s = kStepS;
    input.head_shift_m = now.position_m - before.position_m;
    input.world_from_head_rotation = now.rotation;
    before = now;
    for (Contestant& contestant : contestants) contestant.step(input, *executor);
    contestants.back().solver->read(state);
    const Depths depths = depths_of(content, nullptr, state, now.rotation);
    worst.vertex_mm = std::max(worst.vertex_mm, depths.vertex_mm);
    worst.middle_mm = std::max(worst.middle_mm, depths.middle_mm);
  }
  for (const Contestant& contestant : contestants)
    fmt::print("  {:8}  cpu {:6.2f} ms  wall {:6.2f} ms  ({:+.2f} ms cpu, {:+.2f} ms wall)\n",
               contestant.name, quantile(contestant.cpu_ms, 0.5), quantile(contestant.wall_ms, 0.5),
               quantile(contestant.cpu_ms, 0.5) - quantile(contestants.front().cpu_ms, 0.5),
               quantile(contestant.wall_ms, 0.5) - quantile(contestants.front().wall_ms, 0.5));
  StepInput rest;
  rest.h_s = kStepS;
  rest.world_from_head_rotation = before.rotation;
  for (int step = std::stoi(options["rest"]); step > 0; --step)
    for (Contestant& contestant : contestants) contestant.step(rest, *executor);
  for (Contestant& contestant : contestants) {
    SolverState earlier;
    contestant.solver->read(earlier);
    contestant.step(rest, *executor);
    contestant.solver->read(state);
    double squares = 0.0;
    for (size_t i = 0; i < state.position_m.size(); ++i) {
      const glm::dvec3 way_m(state.position_m[i] - earlier.position_m[i]);
      squares += glm::dot(way_m, way_m);
    }
    fmt::print("  {:8}  settled: rms speed {:.2f} mm/s\n", contestant.name,
               1e3 / kStepS * std::sqrt(squares / static_cast<double>(state.position_m.size())));
  }
  const Depths settled = depths_of(content, &content.head, state, before.rotation);
  fmt::print("  shaken: vertices {:.3f} mm, middles {:.3f} mm below their clearance\n", worst.vertex_mm,
             worst.middle_mm);
  fmt::print("  settled: vertices {:.4f} mm, middles {:.4f} mm; {:.3f} mm inside of the mesh\n",
             settled.vertex_mm, settled.middle_mm, settled.mesh_mm);
  return {};
}

}  // namespace
}  // namespace strandcast

int main(int argc, char** argv) {
  strandcast::Options options = {{"strands", "10000"}, {"vertices", "16"}, {"solver", "dftl"},
                                 {"device", "lanes"},  {"steps", "60"},    {"rest", "300"},
                                 {"resolution", "64"}, {"groom", ""},      {"mesh", ""},
                                 {"body", ""},         {"picture", ""}};
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = std::strncmp(argv[i], "--", 2) == 0 ? argv[i] + 2 : "";
    if (!options.contains(name)) {
      fmt::print(stderr, "unknown option {}\n", argv[i]);
      return 2;
    }
    options[name] = argv[i + 1];
  }
  const strandcast::Status status =
      options["body"].empty()
          ? strandcast::run(options)
          : strandcast::run_body_bench({options["body"], options["strands"], options["vertices"],
                                        options["solver"], options["device"], std::stoi(options["steps"]),
                                        std::stoi(options["rest"]), options["picture"]});
  if (!status) fmt::print(stderr, "{}\n", status.error().to_string());
  return status ? 0 : 2;
}
