// Compares the ways in which hair answers a body that moves by itself: how deep it gets, and the time taken.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/base/quantile.h"
#include "common/groom/groom_asset.h"
#include "common/motion/motion_file.h"
#include "common/render/render_device.h"
#include "common/scene/scene_file.h"
#include "server/app/groom_check.h"
#include "server/report/contact_depth.h"
#include "server/report/process_time.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/reference_body.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr double kBodyStepS = 1.0 / 60.0;
// First the body comes up from below, so that no hair begins inside of it.
constexpr int kRiseSteps = 45, kBodyWarmUpSteps = 60;  // measured after the latter
constexpr double kBelowM = 0.6;
constexpr uint32_t kSomeBodyStrands = 7;
constexpr uint32_t kPictureSide = 360, kMoments = 4;

/// Where head and joints are at a time.
using BodyMotion = std::function<InputFrame(double t_s)>;

/// A head that says no by 60 degrees over shoulders that shrug and swing, 2.2 m/s at most; joints where the
/// built-in head's body would have them.
InputFrame built_in_body(double t_s) {
  constexpr double kTurnRad = std::numbers::pi / 3.0, kTurnHz = 0.7;
  constexpr double kSwingM = 0.1, kSwingHz = 3.5;
  const double turn = kTurnRad * std::sin(2.0 * std::numbers::pi * kTurnHz * t_s);
  const double swing_m = kSwingM * std::sin(2.0 * std::numbers::pi * kSwingHz * t_s);
  InputFrame input;
  input.world_from_head.rotation = glm::angleAxis(turn, glm::dvec3(0.0, 1.0, 0.0));
  input.joints.name = {kNeckJoint,          kChestJoint,     kLeftShoulderJoint,
                       kRightShoulderJoint, kLeftElbowJoint, kRightElbowJoint};
  const glm::dvec3 places[] = {{0.0, -0.08, 0.0},
                               {0.0, -0.28, 0.0},
                               {0.18, -0.2 + 0.3 * swing_m, swing_m},
                               {-0.18, -0.2 - 0.3 * swing_m, -swing_m},
                               {0.26, -0.46, swing_m},
                               {-0.26, -0.46, -swing_m}};
  for (const glm::dvec3& place_m : places)
    input.joints.place_m.push_back(glm::conjugate(input.world_from_head.rotation) * place_m);
  return input;
}

Result<BodyMotion> body_motion(const CollisionStudyDesc& desc) {
  if (desc.clip.empty()) return BodyMotion(built_in_body);
  MotionFileOptions options = desc.clip_options;
  options.has_body = true;
  ASSIGN_OR_RETURN(const MotionFile motion, load_motion_file(desc.clip, options));
  if (motion.clip.joint_name.empty())
    return make_error(ErrorCode::BadInput, "'{}' has no neck, chest, shoulders or elbows",
                      desc.clip.string());
  return BodyMotion([clip = motion.clip](double t_s) {
    InputFrame input;
    input.world_from_head = clip.sample(t_s);
    input.joints = {clip.joint_name, clip.sample_joints(t_s)};
    return input;
  });
}

struct BodyContestant {
  BodyAnswer found;
  SceneDesc scene;
  std::unique_ptr<StepBuilder> builder;
  std::unique_ptr<Solver> solver;
  std::vector<double> cpu_ms = {};
  DepthRecord depths = {};

  void step(const InputFrame& input, int index) {
    SceneFeatures features;
    features.has_colliders = true;
    features.has_body = scene.body.acts();
    const SceneStep& built = builder->build(input, features, index * kBodyStepS);
    if (built.carried_to_rotation) solver->rebase(*built.carried_to_rotation);
    const double begin_ms = process_cpu_ms();
    for (const StepInput& substep : built.substeps) solver->substep(substep);
    cpu_ms.push_back(process_cpu_ms() - begin_ms);
  }
};

double largest_stretch(const Groom& groom, const SolverState& state) {
  const uint32_t strands = groom.strand_count();
  double largest = 0.0;
  for (uint32_t s = 0; s < strands; s += kSomeBodyStrands)
    for (uint32_t i = 1; i < groom.uniform_vertex_count(); ++i) {
      const uint32_t at = groom.offset[s] + i;
      const double rest_m =
          glm::distance(glm::dvec3(groom.rest_position_m[at]), glm::dvec3(groom.rest_position_m[at - 1]));
      const double now_m = glm::distance(glm::dvec3(state.position_m[i * strands + s]),
                                         glm::dvec3(state.position_m[(i - 1) * strands + s]));
      if (rest_m > 0.0) largest = std::max(largest, std::abs(now_m / rest_m - 1.0));
    }
  return largest;
}

/// Strands that lie on a plane, along x.
Groom lying_strands(uint32_t strand_count, uint32_t vertex_count) {
  Groom groom;
  groom.name = "lying";
  groom.offset = {0};
  for (uint32_t s = 0; s < strand_count; ++s) {
    for (uint32_t i = 0; i < vertex_count; ++i) {
      groom.rest_position_m.emplace_back(0.02f * static_cast<float>(i), 0.001f,
                                         0.05f * static_cast<float>(s));
      groom.pinned.push_back(i == 0 ? 1 : 0);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

/// Returns how far a belt carries the tips of lying hair along, over its own way in the same time.
Result<double> carried_share(const SolverRow& row, const SolverParameters& parameters, Executor& executor,
                             const BodyDesc& body) {
  constexpr uint32_t kStrands = 16, kVertices = 12;
  constexpr int kLyingSteps = 120, kBeltSteps = 30;
  constexpr double kBeltMps = 0.1;
  SceneFeatures features;
  features.has_body = true;
  ASSIGN_OR_RETURN(auto solver, row.make(parameters, {&executor, features}));
  RETURN_IF_ERROR(solver->load(lying_strands(kStrands, kVertices), {1.0, 0.0, 0.0, 0.0}));
  StepInput input;
  input.h_s = kBodyStepS;
  input.body.planes = {{glm::dvec3(0.0), {0.0, 1.0, 0.0}, glm::dvec3(0.0)}};
  input.body.response = static_cast<BodyResponse>(
      std::find(kBodyResponses.begin(), kBodyResponses.end(), body.response) - kBodyResponses.begin());
  input.body.friction = 1.0;
  input.body.force_per_s2 = body.force_per_s2;
  for (int step = 0; step < kLyingSteps; ++step) solver->substep(input);
  SolverState before, after;
  solver->read(before);
  input.body.planes[0].shift_m = {0.0, 0.0, kBeltMps * kBodyStepS};
  for (int step = 0; step < kBeltSteps; ++step) solver->substep(input);
  solver->read(after);
  double way_m = 0.0;
  for (uint32_t s = 0; s < kStrands; ++s) {
    const size_t tip = (kVertices - 1) * kStrands + s;
    way_m += static_cast<double>((after.position_m[tip] - before.position_m[tip]).z) / kStrands;
  }
  return way_m / (kBeltMps * kBodyStepS * kBeltSteps);
}

/// Hair and body in head space, from the front and from the left, into a column of the sheet.
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
    RETURN_IF_ERROR(renderer->draw(strands, camera, {kPictureSide, kPictureSide}));
    const Image picture = renderer->read_image();
    for (uint32_t y = 0; y < kPictureSide; ++y)
      std::copy_n(picture.rgba.begin() + 4 * size_t{y} * kPictureSide, 4 * size_t{kPictureSide},
                  sheet.rgba.begin() +
                      4 * ((size_t{view} * kPictureSide + y) * sheet.width + size_t{column} * kPictureSide));
  }
  return {};
}

/// The scene's own hair on a ball in the place of the head, so that only the body is measured.
SceneDesc on_a_ball(SceneDesc scene) {
  scene.head.is_visible = false;
  scene.has_auto_collider = false;
  scene.wind.mean_mps = glm::vec3(0.0f);
  scene.colliders = {{glm::vec3(0.0f), 0.094f}};
  if (auto* grown = std::get_if<ProceduralGroomDesc>(&scene.groom)) grown->length_m = 0.35f;
  return scene;
}

struct Hair {
  SceneContent content;
  const SolverRow* row = nullptr;
  SolverParameters parameters;
};

Result<BodyContestant> make_contestant(const SceneDesc& scene, const Hair& hair, Executor& executor,
                                       const char* response, const glm::dquat& rotation) {
  BodyContestant made;
  made.scene = scene;
  made.found.name = response == nullptr ? "no body" : response;
  if (response != nullptr) {
    made.scene.body.preset = kUpperBody;
    made.scene.body.response = response;
  }
  made.builder = std::make_unique<StepBuilder>(made.scene, hair.content.colliders);
  SolverContext context{&executor, {}};
  context.features.has_colliders = true;
  context.features.has_body = made.scene.body.acts();
  ASSIGN_OR_RETURN(made.solver, hair.row->make(hair.parameters, context));
  RETURN_IF_ERROR(made.solver->load(hair.content.groom, rotation));
  return made;
}

/// Returns the motion's input; during warm-up the body rises from below first.
InputFrame input_at(const BodyMotion& motion, int step) {
  InputFrame input = motion(std::max(0, step - kBodyWarmUpSteps) * kBodyStepS);
  input.has_motion = true;
  for (glm::dvec3& place_m : input.joints.place_m)
    place_m.y -= kBelowM * std::max(0.0, 1.0 - static_cast<double>(step) / kRiseSteps);
  return input;
}

Status move_them(const CollisionStudyDesc& desc, const Hair& hair, const BodyMotion& motion,
                 std::vector<BodyContestant>& contestants, CollisionStudy& study) {
  uint32_t column = 0;
  SolverState state;
  for (int step = 0; step < desc.body_steps; ++step) {
    const InputFrame input = input_at(motion, step);
    for (BodyContestant& contestant : contestants) contestant.step(input, step);
    if (step < kBodyWarmUpSteps) continue;
    const SceneStep& built = contestants[1].builder->step();
    const BodyInput& body = built.substeps.back().body;
    for (const BodyCapsule& capsule : body.capsules)
      study.fastest_mps =
          std::max(study.fastest_mps, glm::distance(capsule.to_m, capsule.to_before_m) / kBodyStepS *
                                          static_cast<double>(built.substeps.size()));
    const DepthAt depth_at = [&](const glm::dvec3& place_m, const glm::dvec3&) {
      return -distance_to_body_m(body, place_m);
    };
    for (BodyContestant& contestant : contestants) {
      contestant.solver->read(state);
      record_depths(hair.content.groom, state, input.world_from_head.rotation, kSomeBodyStrands, depth_at,
                    contestant.depths);
      contestant.found.stretch =
          std::max(contestant.found.stretch, largest_stretch(hair.content.groom, state));
    }
    const int next_moment = (static_cast<int>(column) + 1) * desc.body_steps / static_cast<int>(kMoments);
    if (!desc.has_pictures || column == kMoments || step + 1 < next_moment) continue;
    contestants[1].solver->read(state);
    std::vector<SphereCollider> balls = contestants[1].scene.colliders;
    for (const SphereCollider& ball : balls_along(body.capsules)) balls.push_back(ball);
    RETURN_IF_ERROR(draw(hair.content.groom, contestants[1].scene, state, input.world_from_head.rotation,
                         mesh_of_balls(balls), column++, study.moments));
  }
  return {};
}

}  // namespace

Status measure_body_answers(const CollisionStudyDesc& desc, Executor& executor,
                            const CollisionProgress& progress, CollisionStudy& study) {
  const SceneDesc scene = on_a_ball(desc.scene);
  Hair hair;
  ASSIGN_OR_RETURN(hair.content, load_scene_content(scene));
  ASSIGN_OR_RETURN(hair.row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(hair.parameters, complete_parameters(*hair.row, scene.solver.parameters));
  ASSIGN_OR_RETURN(const BodyMotion motion, body_motion(desc));
  study.body_name = desc.clip.empty() ? "built in" : desc.clip.filename().string();
  const glm::dquat rotation = motion(0.0).world_from_head.rotation;
  std::vector<BodyContestant> contestants;
  ASSIGN_OR_RETURN(BodyContestant none, make_contestant(scene, hair, executor, nullptr, rotation));
  contestants.push_back(std::move(none));
  for (const char* response : kBodyResponses) {
    ASSIGN_OR_RETURN(BodyContestant made, make_contestant(scene, hair, executor, response, rotation));
    contestants.push_back(std::move(made));
  }
  if (desc.has_pictures) {
    study.moments = {kPictureSide * kMoments, 2 * kPictureSide, {}};
    study.moments.rgba.resize(4 * size_t{study.moments.width} * study.moments.height);
  }
  progress(fmt::format("{} steps of a body ({}), {} at rest", desc.body_steps, study.body_name,
                       desc.body_rest_steps));
  RETURN_IF_ERROR(move_them(desc, hair, motion, contestants, study));
  const InputFrame last = input_at(motion, desc.body_steps - 1);
  const double plain_ms = quantile(contestants.front().cpu_ms, 0.5);
  SolverState before, after;
  for (BodyContestant& contestant : contestants) {
    BodyAnswer& found = contestant.found;
    found.step_cpu_ms = quantile(contestant.cpu_ms, 0.5);
    found.extra_cpu_ms = found.step_cpu_ms - plain_ms;
    found.depth = contestant.depths.depth();
    for (int step = 0; step < desc.body_rest_steps; ++step) contestant.step(last, desc.body_steps + step);
    contestant.solver->read(before);
    contestant.step(last, desc.body_steps + desc.body_rest_steps);
    contestant.solver->read(after);
    found.rest_speed_mps = speed_rms_mps(before, after, kBodyStepS);
    if (contestant.scene.body.acts()) {
      ASSIGN_OR_RETURN(found.carried_share,
                       carried_share(*hair.row, hair.parameters, executor, contestant.scene.body));
    }
    study.body.push_back(found);
  }
  return {};
}

}  // namespace strandcast
