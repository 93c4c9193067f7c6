#include "tests/bench/body_bench.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "common/base/quantile.h"
#include "common/groom/groom_asset.h"
#include "common/motion/motion_file.h"
#include "common/pictures/image_codec.h"
#include "common/render/render_device.h"
#include "common/scene/features.h"
#include "common/scene/scene_file.h"
#include "server/app/groom_check.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/executor/executor.h"
#include "server/sim/reference_body.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr double kStepS = 1.0 / 60.0;
// First the body comes up from below, so that no hair begins inside of it.
constexpr int kRise = 45, kWarmUp = 60;  // steps; measured after the latter
constexpr double kBelowM = 0.6;
constexpr uint32_t kSide = 360;

int64_t process_cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

struct Contestant {
  std::string name;
  SceneDesc scene;
  std::unique_ptr<StepBuilder> builder;
  std::unique_ptr<Solver> solver;
  std::vector<double> cpu_ms = {}, vertex_mm = {}, middle_mm = {};
  double stretch = 0.0;

  void step(const InputFrame& input, Executor& executor, int index) {
    SceneFeatures features;
    features.has_colliders = true;
    features.has_body = scene.body.acts();
    const SceneStep& built = builder->build(input, features, index * kStepS);
    if (built.carried_to_rotation) solver->rebase(*built.carried_to_rotation);
    const int64_t begin_ns = process_cpu_ns();
    for (const StepInput& substep : built.substeps) solver->substep(substep);
    static_cast<void>(executor);
    cpu_ms.push_back(static_cast<double>(process_cpu_ns() - begin_ns) * 1e-6);
  }
};

/// Of every 7th strand, in double, against the body of the newest step.
void measure(Contestant& contestant, const BodyInput& body, const Groom& groom, const glm::dquat& rotation) {
  SolverState state;
  contestant.solver->read(state);
  const uint32_t strands = groom.strand_count();
  const glm::dquat turn = glm::conjugate(rotation);
  for (uint32_t s = 0; s < strands; s += 7)
    for (uint32_t i = 1; i < groom.uniform_vertex_count(); ++i) {
      const uint32_t at = groom.offset[s] + i;
      if (groom.pinned[at] != 0) continue;
      const glm::dvec3 a = turn * glm::dvec3(state.position_m[(i - 1) * strands + s]);
      const glm::dvec3 b = turn * glm::dvec3(state.position_m[i * strands + s]);
      contestant.vertex_mm.push_back(std::max(0.0, -1e3 * distance_to_body_m(body, b)));
      contestant.middle_mm.push_back(std::max(0.0, -1e3 * distance_to_body_m(body, 0.5 * (a + b))));
      const double rest_m =
          glm::distance(glm::dvec3(groom.rest_position_m[at]), glm::dvec3(groom.rest_position_m[at - 1]));
      contestant.stretch = std::max(contestant.stretch, std::abs(glm::distance(a, b) / rest_m - 1.0));
    }
}

/// Millimetres of 50 that a belt carries tips to the side.
Result<double> carried_mm(const SolverRow& row, const SolverParameters& parameters, Executor& executor,
                          BodyResponse response, double force_per_s2) {
  Groom groom;
  groom.name = "lying";
  groom.offset = {0};
  constexpr uint32_t kStrands = 16, kVertices = 12;
  for (uint32_t s = 0; s < kStrands; ++s) {
    for (uint32_t i = 0; i < kVertices; ++i) {
      groom.rest_position_m.emplace_back(0.02f * static_cast<float>(i), 0.001f,
                                         0.05f * static_cast<float>(s));
      groom.pinned.push_back(i == 0 ? 1 : 0);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  SceneFeatures features;
  features.has_body = true;
  ASSIGN_OR_RETURN(auto solver, row.make(parameters, {&executor, features}));
  RETURN_IF_ERROR(solver->load(groom, {1.0, 0.0, 0.0, 0.0}));
  StepInput input;
  input.h_s = kStepS;
  input.body.planes = {{glm::dvec3(0.0), {0.0, 1.0, 0.0}, glm::dvec3(0.0)}};
  input.body.response = response;
  input.body.friction = 1.0;
  input.body.force_per_s2 = force_per_s2;
  for (int step = 0; step < 120; ++step) solver->substep(input);
  SolverState before, after;
  solver->read(before);
  input.body.planes[0].shift_m = {0.0, 0.0, 0.1 * kStepS};
  for (int step = 0; step < 30; ++step) solver->substep(input);
  solver->read(after);
  double way_m = 0.0;
  for (uint32_t s = 0; s < kStrands; ++s) {
    const size_t tip = (kVertices - 1) * kStrands + s;
    way_m += static_cast<double>((after.position_m[tip] - before.position_m[tip]).z) / kStrands;
  }
  return 1e3 * way_m;
}

/// Hair and body in head space from the front and from the left.
Status draw(const Groom& groom, const SceneDesc& scene, const SolverState& state, const glm::dquat& rotation,
            const Mesh& body, uint32_t column, Image& sheet) {
  ASSIGN_OR_RETURN(const auto device, RenderDevice::open({}));
  LookDesc look = scene.look;
  look.followers = 0;
  look.strand_radius_m = 0.0006f;
  ASSIGN_OR_RETURN(auto renderer, device->make_renderer(make_scene_asset(groom, body), look));
  PosedStrands strands;
  for (const glm::vec3& point : state.position_m)
    strands.position_m.emplace_back(glm::conjugate(rotation) * glm::dvec3(point));
  const glm::vec3 directions[] = {{0.0f, 0.1f, 1.0f}, {1.0f, 0.1f, 0.0f}};
  for (uint32_t view = 0; view < 2; ++view) {
    CameraDesc camera;
    camera.target_m = {0.0f, -0.15f, 0.0f};
    camera.offset_m = 1.6f * directions[view];
    camera.fov_y_rad = 0.45f;
    RETURN_IF_ERROR(renderer->draw(strands, camera, {kSide, kSide}));
    const Image picture = renderer->read_image();
    for (uint32_t y = 0; y < kSide; ++y)
      std::copy_n(
          picture.rgba.begin() + 4 * size_t{y} * kSide, 4 * size_t{kSide},
          sheet.rgba.begin() + 4 * ((size_t{view} * kSide + y) * sheet.width + size_t{column} * kSide));
  }
  return {};
}

}  // namespace

Status run_body_bench(const BodyBenchOptions& options) {
  MotionFileOptions file;
  file.has_body = true;
  ASSIGN_OR_RETURN(const MotionFile motion, load_motion_file(options.clip, file));
  const MotionClip& clip = motion.clip;
  ASSIGN_OR_RETURN(SceneDesc scene,
                   built_in_scene_with({"groom.procedural.strand_count=" + options.strands,
                                        "groom.procedural.vertex_count=" + options.vertices,
                                        "groom.procedural.length_m=0.35", "head.is_visible=false",
                                        "has_auto_collider=false", "wind.mean_mps={x:0 y:0 z:0}"}));
  scene.colliders = {{glm::vec3(0.0f), 0.094f}};
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  ASSIGN_OR_RETURN(const auto executor, open_executor({options.device, "auto", {}}));
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(options.solver));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, {}));
  std::vector<Contestant> contestants;
  for (const char* name :
       {"no body", kBodyResponses[0], kBodyResponses[1], kBodyResponses[2], kBodyResponses[3]}) {
    Contestant contestant{name, scene, nullptr, nullptr};
    if (!contestants.empty()) {
      contestant.scene.body.preset = kUpperBody;
      contestant.scene.body.response = name;
    }
    contestant.builder = std::make_unique<StepBuilder>(contestant.scene, content.colliders);
    SolverContext context{executor.get(), {}};
    context.features.has_colliders = true;
    context.features.has_body = contestant.scene.body.acts();
    ASSIGN_OR_RETURN(contestant.solver, row->make(parameters, context));
    RETURN_IF_ERROR(contestant.solver->load(content.groom, clip.sample(0.0).rotation));
    contestants.push_back(std::move(contestant));
  }
  fmt::print("{} on {}: {} x {} vertices, {}\n", row->name, executor->info().name,
             content.groom.strand_count(), content.groom.uniform_vertex_count(),
             options.clip.filename().string());
  const auto input_at = [&](int step) {
    const double t_s = std::max(0, step - kWarmUp) * kStepS;
    InputFrame input;
    input.has_motion = true;
    input.world_from_head = clip.sample(t_s);
    input.joints = {clip.joint_name, clip.sample_joints(t_s)};
    for (glm::dvec3& place_m : input.joints.place_m)
      place_m.y -= kBelowM * std::max(0.0, 1.0 - static_cast<double>(step) / kRise);
    return input;
  };
  constexpr uint32_t kMoments = 4;
  Image sheet{kSide * kMoments, 2 * kSide, {}};
  sheet.rgba.resize(4 * size_t{sheet.width} * sheet.height);
  uint32_t column = 0;
  double fastest_mps = 0.0;
  for (int step = 0; step < options.steps; ++step) {
    const InputFrame input = input_at(step);
    for (Contestant& contestant : contestants) contestant.step(input, *executor, step);
    const BodyInput& body = contestants[1].builder->step().substeps.back().body;
    if (step == 0)
      for (const std::string& missing : contestants[1].builder->missing_joints()) fmt::print("{}\n", missing);
    for (const BodyCapsule& capsule : body.capsules)
      fastest_mps = std::max(fastest_mps, glm::distance(capsule.to_m, capsule.to_before_m) / kStepS *
                                              static_cast<double>(scene.substeps));
    if (step >= kWarmUp)
      for (Contestant& contestant : contestants)
        measure(contestant, body, content.groom, input.world_from_head.rotation);
    if (options.picture.empty() ||
        step + 1 < (static_cast<int>(column) + 1) * options.steps / static_cast<int>(kMoments) ||
        column == kMoments)
      continue;
    SolverState state;
    contestants[1].solver->read(state);
    std::vector<SphereCollider> balls = {scene.colliders};
    for (const SphereCollider& ball : balls_along(body.capsules)) balls.push_back(ball);
    RETURN_IF_ERROR(draw(content.groom, scene, state, input.world_from_head.rotation, mesh_of_balls(balls),
                         column++, sheet));
  }
  if (!options.picture.empty()) RETURN_IF_ERROR(save_png(options.picture, sheet));
  fmt::print("fastest end of a capsule {:.2f} m/s\n", fastest_mps);
  const InputFrame last = input_at(options.steps - 1);
  SolverState before, after;
  const double plain_ms = quantile(contestants.front().cpu_ms, 0.5);
  for (Contestant& contestant : contestants) {
    const std::vector<double> cpu_ms = contestant.cpu_ms;
    for (int step = 0; step < options.rest; ++step) contestant.step(last, *executor, options.steps + step);
    contestant.solver->read(before);
    contestant.step(last, *executor, options.steps + options.rest);
    contestant.solver->read(after);
    double squares = 0.0;
    for (size_t i = 0; i < after.position_m.size(); ++i) {
      const glm::dvec3 way_m(after.position_m[i] - before.position_m[i]);
      squares += glm::dot(way_m, way_m);
    }
    const BodyDesc& body = contestant.scene.body;
    const auto response = static_cast<BodyResponse>(
        std::find(kBodyResponses.begin(), kBodyResponses.end(), body.response) - kBodyResponses.begin());
    double belt_mm = 0.0;
    if (body.acts()) {
      ASSIGN_OR_RETURN(belt_mm, carried_mm(*row, parameters, *executor, response, body.force_per_s2));
    }
    fmt::print(
        "  {:8} cpu {:6.2f} ms ({:+.2f})  deep {:6.2f} mm (99 % {:5.2f}), middles {:6.2f} (99 % {:5.2f})  "
        "lengths "
        "{:.2g} %  at rest {:.3g} mm/s  belt {:.0f} of 50 mm\n",
        contestant.name, quantile(cpu_ms, 0.5), quantile(cpu_ms, 0.5) - plain_ms,
        *std::max_element(contestant.vertex_mm.begin(), contestant.vertex_mm.end()),
        quantile(contestant.vertex_mm, 0.99),
        *std::max_element(contestant.middle_mm.begin(), contestant.middle_mm.end()),
        quantile(contestant.middle_mm, 0.99), 1e2 * contestant.stretch,
        1e3 / kStepS * std::sqrt(squares / static_cast<double>(after.position_m.size())), belt_mm);
  }
  return {};
}

}  // namespace strandcast
