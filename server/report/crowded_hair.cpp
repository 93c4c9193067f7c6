#include "server/report/crowded_hair.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "common/scene/features.h"
#include "server/report/process_time.h"

namespace strandcast {
namespace {

constexpr uint32_t kLookSmoothing = 1;
constexpr double kCrowded = 2.0;  // times as dense as in the groom
constexpr double kNyquistQuantile = 0.999;

}  // namespace

Groom make_tuft(uint32_t strand_count, uint32_t vertex_count, float length_m, uint32_t seed) {
  constexpr float kRootRadiusM = 0.03f;
  constexpr float kFlare = 0.12f;    // tangent of how far the outermost strands lean out
  constexpr float kScatter = 0.06f;  // of directions
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Groom groom;
  groom.name = "tuft";
  groom.offset = {0};
  while (groom.strand_count() < strand_count) {
    const glm::vec2 root(uniform(random), uniform(random));
    if (glm::dot(root, root) > 1.0f) continue;
    const glm::vec3 begin(kRootRadiusM * root.x, 0.1f, kRootRadiusM * root.y);
    const glm::vec3 along = glm::normalize(glm::vec3(kFlare * root.x + kScatter * uniform(random), -1.0f,
                                                     kFlare * root.y + kScatter * uniform(random)));
    for (uint32_t i = 0; i < vertex_count; ++i) {
      const float way_m = length_m * static_cast<float>(i) / static_cast<float>(vertex_count - 1);
      groom.rest_position_m.push_back(begin + way_m * along);
      groom.pinned.push_back(i == 0 ? 1 : 0);
    }
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  }
  return groom;
}

Pose shaken_head(double time_s) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  Pose pose;
  pose.position_m = {0.15 * std::sin(2.0 * kTurn * time_s), 1.6 + 0.03 * std::sin(3.1 * kTurn * time_s), 0.0};
  pose.rotation = glm::angleAxis(0.6 * std::sin(1.3 * kTurn * time_s), glm::dvec3(0.0, 1.0, 0.0)) *
                  glm::angleAxis(0.3 * std::sin(0.9 * kTurn * time_s), glm::dvec3(1.0, 0.0, 0.0));
  return pose;
}

HairRun::HairRun(const SceneDesc& scene, StrandLayout layout, std::vector<SphereCollider> colliders)
    : scene_(scene),
      layout_(std::move(layout)),
      builder_(scene, std::move(colliders)),
      features_(analyse(scene, {})),
      before_(shaken_head(0.0)) {
  for (const glm::vec4& rest : layout_.rest) position_m_.emplace_back(rest);
  velocity_mps_.assign(position_m_.size(), glm::vec3(0.0f));
}

Result<HairRun> HairRun::make(Executor& executor, const SceneDesc& scene, const SceneContent& content) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  ASSIGN_OR_RETURN(StrandLayout layout, make_strand_layout(content.groom));
  HairRun run(scene, std::move(layout), content.colliders);
  SolverContext context{&executor, run.features_};
  context.groom_gravity_in_head_mps2 = scene.gravity_mps2;
  context.volume = scene.volume;
  context.bend_limit = scene.bend_limit;
  context.head_field = content.head_field;
  context.volume_target = content.volume_target;
  context.drag_along_share = scene.wind.along_share;
  ASSIGN_OR_RETURN(run.solver_, row->make(parameters, context));
  RETURN_IF_ERROR(run.solver_->load(content.groom, shaken_head(0.0).rotation));
  return run;
}

void HairRun::step(const Pose& world_from_head) {
  ++tick_;
  InputFrame input;
  input.has_motion = true;
  input.is_motion_stale = false;
  input.world_from_head = world_from_head;
  const SceneStep& step = builder_.build(input, features_, time_s());
  const double begin_ms = process_cpu_ms();
  if (step.carried_to_rotation) solver_->rebase(*step.carried_to_rotation);
  for (const StepInput& substep : step.substeps) solver_->substep(substep);
  solver_->read(state_);
  cpu_ms_ += process_cpu_ms() - begin_ms;
  const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(step.world_from_head.rotation));
  const auto per_second = scene_.step_rate_hz;
  for (size_t i = 0; i < position_m_.size(); ++i) {
    const glm::vec3 before = position_m_[i];
    position_m_[i] = glm::vec3(head_from_world * glm::dvec3(state_.position_m[i]));
    velocity_mps_[i] = glm::vec3(per_second * (glm::dvec3(position_m_[i]) - glm::dvec3(before)));
  }
}

CrowdedHair::CrowdedHair(HairRun run, HairVolume volume)
    : run_(std::move(run)), volume_(std::move(volume)), nodes_(volume_.most_nodes()) {
  groom_density_ = densities();
  groom_volume_m3_ = filled_volume_m3();
}

Result<CrowdedHair> CrowdedHair::make(Executor& executor, const SceneDesc& scene, Groom groom,
                                      uint32_t look_resolution) {
  SceneContent content;
  content.groom = std::move(groom);
  ASSIGN_OR_RETURN(HairRun run, HairRun::make(executor, scene, content));
  const StrandLayout& layout = run.layout();
  ASSIGN_OR_RETURN(HairVolume volume,
                   HairVolume::make({layout.strand_count, layout.vertex_count, layout.rest, {}},
                                    {look_resolution, kLookSmoothing}));
  return CrowdedHair(std::move(run), std::move(volume));
}

void CrowdedHair::shake(double seconds) {
  const double begin_s = run_.time_s();
  while (run_.time_s() - begin_s < seconds)
    run_.step(shaken_head(run_.time_s() - begin_s + 1.0 / run_.scene().step_rate_hz));
  still_ = shaken_head(run_.time_s() - begin_s);
}

void CrowdedHair::hold(double seconds) {
  for (int64_t i = 0; i < std::llround(seconds * run_.scene().step_rate_hz); ++i) run_.step(still_);
}

RestFindings CrowdedHair::look(double seconds) {
  const double rate_hz = run_.scene().step_rate_hz;
  const auto steps = std::llround(seconds * rate_hz);
  const std::vector<glm::vec3>& position_m = run_.position_in_head_m();
  std::vector<glm::vec3> before = position_m, before_that = position_m;
  std::vector<double> nyquist(position_m.size(), 0.0);
  double squared = 0.0;
  for (int64_t i = 0; i < steps; ++i) {
    before_that = std::exchange(before, position_m);
    run_.step(still_);
    for (size_t v = 0; v < position_m.size(); ++v) {
      const glm::dvec3 moved = glm::dvec3(position_m[v]) - glm::dvec3(before[v]);
      const glm::dvec3 moved_before = glm::dvec3(before[v]) - glm::dvec3(before_that[v]);
      squared += glm::dot(moved, moved);
      if (i > 0) nyquist[v] = std::max(nyquist[v], 0.25 * glm::distance(moved, moved_before));
    }
  }
  RestFindings findings;
  findings.speed_rms_mps =
      rate_hz * std::sqrt(squared / (static_cast<double>(steps) * static_cast<double>(position_m.size())));
  std::sort(nyquist.begin(), nyquist.end());
  findings.nyquist_m = nyquist[static_cast<size_t>(static_cast<double>(nyquist.size()) * kNyquistQuantile)];
  const std::vector<double> density = densities();
  size_t crowded = 0;
  for (size_t v = 0; v < density.size(); ++v) crowded += density[v] > kCrowded * groom_density_[v] ? 1 : 0;
  findings.crowded_share = static_cast<double>(crowded) / static_cast<double>(density.size());
  findings.volume_share = filled_volume_m3() / groom_volume_m3_;
  findings.highest_m = -1.0;
  for (const glm::vec3& point : position_m)
    findings.highest_m = std::max(findings.highest_m, static_cast<double>(point.y));
  return findings;
}

double CrowdedHair::shape_rms_m() const {
  const std::vector<glm::vec3>& position_m = run_.position_in_head_m();
  double squared = 0.0;
  for (size_t i = 0; i < position_m.size(); ++i) {
    const glm::dvec3 off = glm::dvec3(position_m[i]) - glm::dvec3(run_.layout().rest[i]);
    squared += glm::dot(off, off);
  }
  return std::sqrt(squared / static_cast<double>(position_m.size()));
}

glm::dvec3 CrowdedHair::mean_shift_m() const {
  const std::vector<glm::vec3>& position_m = run_.position_in_head_m();
  glm::dvec3 sum(0.0);
  for (size_t i = 0; i < position_m.size(); ++i)
    sum += glm::dvec3(position_m[i]) - glm::dvec3(run_.layout().rest[i]);
  return sum / static_cast<double>(position_m.size());
}

void CrowdedHair::fill() {
  StrandBlocks blocks(run_.layout().strand_count, run_.layout().vertex_count);
  pack_blocks(std::span<const glm::vec3>(run_.position_in_head_m()), blocks);
  VolumeInput input;
  input.position_m = blocks.view();
  volume_.update(input, nodes_);
}

std::vector<double> CrowdedHair::densities() {
  fill();
  std::vector<double> density;
  for (const glm::vec3& point : run_.position_in_head_m())
    density.push_back(sample_volume(volume_.grid(), nodes_, glm::dvec3(point)).density_mpm3);
  return density;
}

double CrowdedHair::filled_volume_m3() {
  fill();
  const auto cell_m = static_cast<double>(volume_.cell_m());
  double length_m = 0.0;
  double squared = 0.0;
  for (size_t i = 0; i < volume_.grid().size(); ++i) {
    const double density = static_cast<double>(nodes_[i].w);
    length_m += density * cell_m * cell_m * cell_m;
    squared += density * density * cell_m * cell_m * cell_m;
  }
  return length_m * length_m / squared;
}

}  // namespace strandcast
