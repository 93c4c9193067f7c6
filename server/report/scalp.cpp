#include "server/report/scalp.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "common/base/quantile.h"
#include "common/groom/groom_asset.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

// Hair that is not to be seen, and roots that are not to tint the skin, are so far away.
const glm::vec3 kAway(0.0f, 1000.0f, 0.0f);
// So bright that one sample of a colour in a pixel is seen, however deep in the shadow of hair.
constexpr float kBright = 1e3f;
constexpr int kSeen = 128;  // of 255
constexpr double kHalfCover = 0.5;
// Of the tint at full cover, shaders/render/head.frag.
constexpr double kScalpTint = 0.85;
// Head motion sets in within this time, so that a clip that begins in motion does not begin with a blow.
constexpr double kEaseS = 0.5;

/// Light from everywhere, skin red and hair green, nothing else.
LookDesc marking_look(const LookDesc& look, float ambient) {
  LookDesc marking = look;
  marking.skin_color = {1.0f, 0.0f, 0.0f};
  marking.root_color = marking.tip_color = {0.0f, 1.0f, 0.0f};
  marking.light_color = glm::vec3(0.0f);
  marking.ambient = ambient;
  marking.background = glm::vec3(0.0f);
  return marking;
}

double linear_from_srgb(uint8_t value) {
  const double srgb = value / 255.0;
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}

CameraDesc turned(const CameraDesc& camera, double angle_rad) {
  const glm::quat turn = glm::angleAxis(static_cast<float>(angle_rad), glm::vec3(0.0f, 1.0f, 0.0f));
  CameraDesc result = camera;
  result.offset_m = turn * camera.offset_m;
  result.target_m = turn * camera.target_m;
  return result;
}

std::vector<glm::vec3> moved_away(std::vector<glm::vec3> points) {
  for (glm::vec3& point : points) point += kAway;
  return points;
}

double mean(const ScalpShares& shares) {
  return std::accumulate(shares.begin(), shares.end(), 0.0) / static_cast<double>(shares.size());
}

double growth_of(double visible, double groomed) {
  return groomed > 0.0 ? visible / groomed - 1.0 : 0.0;
}

/// From head-relative world axes to head space.
std::vector<glm::vec3> in_head(const SolverState& state, const glm::dquat& rotation) {
  const glm::dquat head_from_world = glm::conjugate(rotation);
  std::vector<glm::vec3> points;
  for (const glm::vec3& position : state.position_m)
    points.emplace_back(head_from_world * glm::dvec3(position));
  return points;
}

double root_p95_deg(const Groom& groom, const std::vector<glm::vec3>& position_in_head_m) {
  const size_t strands = groom.strand_count();
  std::vector<double> angles;
  for (uint32_t s = 0; s < strands; ++s) {
    uint32_t first = groom.offset[s];
    while (first + 1 < groom.offset[s + 1] && groom.pinned[first] != 0) ++first;
    const size_t at = (first - groom.offset[s]) * strands + s;
    const glm::dvec3 groomed(groom.rest_position_m[first] - groom.rest_position_m[first - 1]);
    const glm::dvec3 now(position_in_head_m[at] - position_in_head_m[at - strands]);
    angles.push_back(glm::degrees(std::atan2(glm::length(glm::cross(groomed, now)), glm::dot(groomed, now))));
  }
  return quantile(std::move(angles), 0.95);
}

/// Where the head is: the motion seen from its first pose, upright there, eased in.
Pose eased_head_at(const StreamMotion& motion, double time_s) {
  const double t = std::max(time_s, 0.0);
  const double eased_s = t < kEaseS ? 0.5 * t * t / kEaseS : t - 0.5 * kEaseS;
  const Pose first = motion.head_at(0.0);
  const Pose now = motion.head_at(eased_s);
  const glm::dquat upright = glm::conjugate(first.rotation);
  return {upright * (now.position_m - first.position_m), upright * now.rotation};
}

Result<std::unique_ptr<Solver>> make_solver(const SceneDesc& scene, const SceneFeatures& features,
                                            Executor& executor) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  RETURN_IF_ERROR(check_step(*row, parameters, 1.0 / (scene.step_rate_hz * scene.substeps)));
  return row->make(
      parameters,
      {.executor = &executor, .features = features, .groom_gravity_in_head_mps2 = scene.gravity_mps2});
}

}  // namespace

Result<ScalpView> ScalpView::make(const gl::ShaderLibrary& shaders, const gl::DeviceInfo& device,
                                  const SceneAsset& asset, const SceneDesc& scene, RenderSize size) {
  if (asset.head.triangle.empty())
    return make_error(ErrorCode::BadInput, "the scene shows no head (head.is_visible), so there is no scalp");
  ScalpView view;
  view.size_ = size;
  for (size_t i = 0; i < kScalpViews; ++i)
    view.cameras_[i] = turned(
        scene.camera, 2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(kScalpViews));
  ASSIGN_OR_RETURN(const auto bald, Renderer::make(shaders, device, asset, marking_look(scene.look, 1.0f)));
  RETURN_IF_ERROR(view.find_scalp(*bald, moved_away(asset.rest_position_m)));
  // Roots elsewhere: none of the skin is tinted as hair.
  SceneAsset untinted = asset;
  untinted.rest_position_m = moved_away(asset.rest_position_m);
  ASSIGN_OR_RETURN(view.marked_,
                   Renderer::make(shaders, device, untinted, marking_look(scene.look, kBright)));
  ASSIGN_OR_RETURN(view.shown_, Renderer::make(shaders, device, asset, scene.look));
  return view;
}

Status ScalpView::find_scalp(Renderer& bald, const std::vector<glm::vec3>& hair_away_m) {
  size_t scalp_pixels = 0;
  for (size_t i = 0; i < kScalpViews; ++i) {
    RETURN_IF_ERROR(bald.draw({Pose(), hair_away_m}, cameras_[i], size_));
    const Image image = bald.read_image();
    is_scalp_[i].assign(size_t{image.width} * image.height, false);
    for (size_t p = 0; p < is_scalp_[i].size(); ++p) {
      const double skin = linear_from_srgb(image.rgba[4 * p]);
      const double hair = linear_from_srgb(image.rgba[4 * p + 1]);
      const bool is_scalp = skin + hair > 0.0 && hair >= kHalfCover * kScalpTint * (skin + hair);
      is_scalp_[i][p] = is_scalp;
      scalp_pixels += is_scalp ? 1 : 0;
    }
  }
  if (scalp_pixels == 0)
    return make_error(ErrorCode::BadInput, "no camera sees scalp: no roots lie on the head that is drawn");
  return {};
}

Result<ScalpShares> ScalpView::visible(const std::vector<glm::vec3>& position_in_head_m) {
  ScalpShares shares{};
  const PosedStrands strands{Pose(), position_in_head_m};
  for (size_t i = 0; i < kScalpViews; ++i) {
    RETURN_IF_ERROR(marked_->draw(strands, cameras_[i], size_));
    const Image image = marked_->read_image();
    double all = 0.0;
    double seen = 0.0;
    for (size_t p = 0; p < is_scalp_[i].size(); ++p) {
      if (!is_scalp_[i][p]) continue;
      const bool has_skin = image.rgba[4 * p] >= kSeen;
      const bool has_hair = image.rgba[4 * p + 1] >= kSeen;
      all += 1.0;
      seen += has_skin ? (has_hair ? 0.5 : 1.0) : 0.0;
    }
    shares[i] = all > 0.0 ? seen / all : 0.0;
  }
  return shares;
}

Result<Image> ScalpView::picture(const std::vector<glm::vec3>& position_in_head_m) {
  RETURN_IF_ERROR(shown_->draw({Pose(), position_in_head_m}, cameras_[0], size_));
  return shown_->read_image();
}

double ScalpRun::growth() const {
  double sum = 0.0;
  for (const ScalpSample& sample : samples) sum += sample.visible[0];
  return growth_of(sum / static_cast<double>(samples.size()), groomed[0]);
}

double ScalpRun::growth_around() const {
  double sum = 0.0;
  for (const ScalpSample& sample : samples) sum += mean(sample.visible);
  return growth_of(sum / static_cast<double>(samples.size()), mean(groomed));
}

double ScalpRun::growth_p95() const {
  std::vector<double> visible;
  for (const ScalpSample& sample : samples) visible.push_back(sample.visible[0]);
  return growth_of(quantile(std::move(visible), 0.95), groomed[0]);
}

Result<ScalpRun> run_scalp(const ScalpRunDesc& desc, const gl::ShaderLibrary& shaders,
                           const gl::DeviceInfo& device, Executor& executor) {
  SceneDesc scene = desc.scene;
  scene.wind = {};
  const double seconds = std::min(desc.seconds, desc.motion.duration_s);
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  const SceneAsset asset = make_scene_asset(content.groom, content.head);
  ASSIGN_OR_RETURN(ScalpView view, ScalpView::make(shaders, device, asset, scene, desc.size));
  const SceneFeatures features = analyse(scene, {});
  ASSIGN_OR_RETURN(const auto solver, make_solver(scene, features, executor));
  RETURN_IF_ERROR(solver->load(content.groom, glm::dquat(1.0, 0.0, 0.0, 0.0)));

  ScalpRun run;
  ASSIGN_OR_RETURN(run.groomed, view.visible(asset.rest_position_m));
  ASSIGN_OR_RETURN(run.groomed_picture, view.picture(asset.rest_position_m));
  StepBuilder builder(scene, content.colliders);
  const auto interval = std::max<int64_t>(1, std::llround(desc.every_s * scene.step_rate_hz));
  const auto steps = std::llround(seconds * scene.step_rate_hz);
  double worst = -1.0;
  SolverState state;
  for (int64_t step = 0; step <= steps; ++step) {
    const double time_s = static_cast<double>(step) / scene.step_rate_hz;
    InputFrame input;
    input.has_motion = true;
    input.world_from_head = eased_head_at(desc.motion, time_s);
    for (const StepInput& substep : builder.build(input, features, time_s).substeps) solver->substep(substep);
    if (step == 0 || step % interval != 0) continue;
    solver->read(state);
    const std::vector<glm::vec3> position_m = in_head(state, input.world_from_head.rotation);
    ScalpSample sample{time_s, {}, root_p95_deg(content.groom, position_m)};
    ASSIGN_OR_RETURN(sample.visible, view.visible(position_m));
    if (mean(sample.visible) > worst) {
      worst = mean(sample.visible);
      ASSIGN_OR_RETURN(run.worst_picture, view.picture(position_m));
    }
    run.samples.push_back(sample);
  }
  if (run.samples.empty())
    return make_error(ErrorCode::BadInput,
                      "{} lasts {:.2f} s, less than is between two measurements ({:g} s)", desc.motion.name,
                      desc.motion.duration_s, desc.every_s);
  return run;
}

std::string scalp_text(const ScalpRunDesc& desc, const ScalpRun& run) {
  std::vector<double> angles;
  std::vector<double> visible;
  for (const ScalpSample& sample : run.samples) {
    angles.push_back(sample.root_p95_deg);
    visible.push_back(sample.visible[0]);
  }
  return fmt::format(
      "{}, solver {}, follicle_limit_deg {:g}, {} of {:g} s\n"
      "scalp visible from the scene's camera: {:.2f} % as groomed, {:.2f} % in motion (95 % of moments: "
      "{:.2f} %), "
      "growth {:+.1f} % (95 %: {:+.1f} %)\n"
      "from all around: {:.2f} % as groomed, growth {:+.1f} %\n"
      "roots: 95 % within {:.1f} degrees of where they are groomed, {:.1f} at the worst moment\n",
      desc.scene.name, desc.scene.solver.name, desc.scene.follicle_limit_deg, desc.motion.name,
      std::min(desc.seconds, desc.motion.duration_s), 100.0 * run.groomed[0],
      100.0 * (1.0 + run.growth()) * run.groomed[0], 100.0 * quantile(visible, 0.95), 100.0 * run.growth(),
      100.0 * run.growth_p95(), 100.0 * mean(run.groomed), 100.0 * run.growth_around(), median(angles),
      *std::max_element(angles.begin(), angles.end()));
}

std::string scalp_csv(const ScalpRun& run) {
  std::string text = "time_s,view,visible,groomed,root_p95_deg\n";
  for (const ScalpSample& sample : run.samples)
    for (size_t i = 0; i < kScalpViews; ++i)
      text += fmt::format("{:.4f},{},{:.5f},{:.5f},{:.2f}\n", sample.time_s, i, sample.visible[i],
                          run.groomed[i], sample.root_p95_deg);
  return text;
}

}  // namespace strandcast
