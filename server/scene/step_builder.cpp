#include "server/scene/step_builder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/base/hash.h"
#include "common/math/pose_lattice.h"
#include "common/math/turn.h"

namespace strandcast {
namespace {

/// Bounds of the wave bands, m: from some head sizes down to a lock of hair.
constexpr std::array kWavelengthBoundsM = {1.2, 0.7, 0.4, 0.24, 0.14};
constexpr size_t kWaveCount = kWavelengthBoundsM.size() - 1;
static_assert(kWaveCount <= kMaxGustWaves);
/// In the von Karman spectrum of the along-wind component, S(k) ~ (1 + (1.339 k L)^2)^(-5/6), k in rad/m.
constexpr double kVonKarmanFactor = 1.339;
/// Integral of the normalised spectrum above k, where (1.339 k L)^2 >> 1: kTailFactor * (1.339 k L)^(-2/3).
/// With S = (2 L / pi) (1 + (aLk)^2)^(-5/6) the tail integral is (2 / (pi a)) (3 / 2) (aLk)^(-2/3).
constexpr double kTailFactor = 3.0 / (std::numbers::pi * kVonKarmanFactor);

double wave_number(double wavelength_m) {
  return 2.0 * std::numbers::pi / wavelength_m;
}

/// Part of the variance in wavelengths below `wavelength_m`.
double variance_below(double wavelength_m, double length_m) {
  return kTailFactor * std::pow(kVonKarmanFactor * wave_number(wavelength_m) * length_m, -2.0 / 3.0);
}

/// Uniform on the sphere (Archimedes: height and longitude are independent and uniform).
glm::dvec3 random_direction(uint32_t seed, uint32_t index) {
  const double height = 2.0 * unit_float(mix_u32(mix_u32(seed) ^ (2 * index))) - 1.0;
  const double longitude = 2.0 * std::numbers::pi * unit_float(mix_u32(mix_u32(seed) ^ (2 * index + 1)));
  const double radius = std::sqrt(1.0 - height * height);
  return {radius * std::cos(longitude), height, radius * std::sin(longitude)};
}

}  // namespace

std::vector<GustWave> make_gust_waves(const WindDesc& wind) {
  const double mean_speed_mps = glm::length(glm::dvec3(wind.mean_mps));
  const double deviation_mps = mean_speed_mps * wind.gust_intensity;
  if (deviation_mps <= 0.0 || wind.gust_length_m <= 0.0f) return {};
  std::vector<GustWave> waves;
  for (size_t band = 0; band < kWaveCount; ++band) {
    const double part = variance_below(kWavelengthBoundsM[band], wind.gust_length_m) -
                        variance_below(kWavelengthBoundsM[band + 1], wind.gust_length_m);
    // A sine of amplitude a has the variance a^2 / 2.
    const double amplitude_mps = deviation_mps * std::sqrt(2.0 * part);
    const auto index = static_cast<uint32_t>(band);
    const glm::dvec3 along = random_direction(wind.seed, 2 * index);
    const glm::dvec3 other = random_direction(wind.seed, 2 * index + 1);
    const glm::dvec3 across = glm::cross(along, other);
    if (glm::length(across) < 1e-3) continue;  // nearly parallel: no direction across the wave
    const double wavelength_m = std::sqrt(kWavelengthBoundsM[band] * kWavelengthBoundsM[band + 1]);
    GustWave wave;
    wave.amplitude_mps = glm::vec3(amplitude_mps * glm::normalize(across));
    wave.wave_vector_rad_per_m = glm::vec3(wave_number(wavelength_m) * along);
    wave.phase_rad = 2.0f * std::numbers::pi_v<float> * unit_float(mix_u32(wind.seed ^ mix_u32(index + 100)));
    waves.push_back(wave);
  }
  return waves;
}

StepBuilder::StepBuilder(const SceneDesc& scene, std::vector<SphereCollider> colliders)
    : groom_gravity_in_head_mps2_(scene.gravity_mps2) {
  world_from_head_ = rounded_pose({scene.place_m, world_from_head_.rotation});
  change(scene, std::move(colliders));
}

void StepBuilder::change(const SceneDesc& scene, std::vector<SphereCollider> colliders) {
  const BodyDesc& body = scene.body;
  is_body_new_ = is_body_new_ || body.preset != scene_.body.preset || body.capsules != scene_.body.capsules ||
                 body.planes != scene_.body.planes || body.joint_offset_m != scene_.body.joint_offset_m;
  scene_ = scene;
  colliders_ = std::move(colliders);
  const WindDesc& wind = scene.wind;
  gust_generator_.emplace(wind.mean_mps, wind.gust_intensity, wind.gust_length_m, wind.seed);
  // Gusts keep their way and their time, so that a slider that moves does not make others of them.
  waves_ = make_gust_waves(wind);
  for (GustWave& wave : waves_) wave.amplitude_mps *= static_cast<float>(scene.hair.wind);
  step_.substeps.resize(scene.substeps);
  end_time_s_.resize(scene.substeps);
  head_position_m_.resize(scene.substeps);
}

void StepBuilder::add_wind() {
  for (size_t i = 0; i < step_.substeps.size(); ++i)
    step_.substeps[i].wind_mps =
        scene_.hair.wind *
        glm::dvec3(input_.has_wind_stream ? input_.wind_mps : gust_generator_->sample(end_time_s_[i]));
}

void StepBuilder::add_gusts() {
  if (input_.has_wind_stream) return;
  const glm::dvec3 mean_mps = scene_.wind.mean_mps;
  for (size_t i = 0; i < step_.substeps.size(); ++i)
    for (GustWave wave : waves_) {
      wave.phase_rad = phase_of(wave, mean_mps, end_time_s_[i], head_position_m_[i]);
      step_.substeps[i].gusts.push_back(wave);
    }
}

void StepBuilder::add_colliders() {
  for (StepInput& substep : step_.substeps)
    for (const SphereCollider& collider : with_bust(colliders_, substep.bust.rig, substep.bust.turn))
      substep.colliders.push_back(
          {glm::vec3(substep.world_from_head_rotation * glm::dvec3(collider.center_m)), collider.radius_m});
}

void StepBuilder::add_follicle_limit() {
  for (StepInput& substep : step_.substeps)
    substep.follicle_limit_rad = glm::radians(scene_.follicle_limit_deg);
}

void StepBuilder::add_body() {
  const BodyDesc& desc = scene_.body;
  BodyShapes shapes = shapes_of(desc, input_.joints);
  // What went along with the head in a jump is where it is, and of the way of a body that is played faster
  // than the simulation strands meet as much as they feel of the head's.
  is_body_new_ = is_body_new_ || missing_joints_ != shapes.missing ||
                 capsules_.size() != shapes.capsules.size() || felt_ == 0.0;
  missing_joints_ = std::move(shapes.missing);
  const std::vector<BodyCapsule> before =
      is_body_new_ ? shapes.capsules : std::exchange(capsules_, shapes.capsules);
  capsules_ = std::move(shapes.capsules);
  const auto count = static_cast<double>(step_.substeps.size());
  for (size_t i = 0; i < step_.substeps.size(); ++i) {
    StepInput& substep = step_.substeps[i];
    BodyInput& body = substep.body;
    body.is_new = std::exchange(is_body_new_, false);
    const auto at = [&](const glm::dvec3& from_m, const glm::dvec3& to_m, size_t done) {
      return glm::mix(from_m, to_m, 1.0 - felt_ * (1.0 - static_cast<double>(done) / count));
    };
    for (size_t k = 0; k < capsules_.size(); ++k) {
      BodyCapsule capsule = capsules_[k];
      capsule.from_m = at(before[k].from_m, capsules_[k].from_m, i + 1);
      capsule.to_m = at(before[k].to_m, capsules_[k].to_m, i + 1);
      capsule.from_before_m = at(before[k].from_m, capsules_[k].from_m, i);
      capsule.to_before_m = at(before[k].to_m, capsules_[k].to_m, i);
      body.capsules.push_back(capsule);
    }
    for (const BodyPlaneDesc& plane : desc.planes) {
      const glm::dvec3 normal = glm::normalize(plane.normal);
      const glm::dvec3 along_mps = plane.velocity_mps - glm::dot(plane.velocity_mps, normal) * normal;
      body.planes.push_back({plane.point_m, normal, along_mps * substep.h_s});
    }
    const auto named = std::find(kBodyResponses.begin(), kBodyResponses.end(), desc.response);
    body.response = static_cast<BodyResponse>(named - kBodyResponses.begin());
    body.friction = desc.friction;
    body.tip_clearance_m = desc.tip_clearance_m;
    body.force_per_s2 = desc.force_per_s2;
  }
}

glm::dvec3 StepBuilder::head_velocity_mps() const {
  if (step_.substeps.empty()) return glm::dvec3(0.0);
  const StepInput& last = step_.substeps.back();
  return last.head_shift_m / last.h_s;
}

const SceneStep& StepBuilder::build(const InputFrame& input, const SceneFeatures& features,
                                    double end_time_s) {
  begin(input, end_time_s);
  if (features.has_wind) add_wind();
  if (features.has_turbulence) add_gusts();
  add_colliders();
  if (features.has_follicle_limit) add_follicle_limit();
  if (features.has_body) add_body();
  return step_;
}

void StepBuilder::begin(const InputFrame& input, double end_time_s, double input_rate) {
  input_ = input;
  Pose target = input.has_motion ? input.world_from_head : world_from_head_;
  if (input.has_motion && scene_.place_m != glm::dvec3(0.0)) target.position_m += scene_.place_m;
  target = rounded_pose(target);  // as frames tell it
  // The first pose is a jump too: until then the head stood at its place.
  const bool has_jumped = input.has_motion && (input.has_teleported || !has_motion_);
  const double step_s = 1.0 / scene_.step_rate_hz;
  const Pose from = place_before(target, has_jumped, input_rate * input.motion_speed);
  step_.carried_to_rotation.reset();
  if (input.has_motion && felt_motion_.share() < 1.0) step_.carried_to_rotation = from.rotation;
  has_motion_ = has_motion_ || input.has_motion;

  const auto count = static_cast<double>(step_.substeps.size());
  Pose previous = from;
  for (size_t i = 0; i < step_.substeps.size(); ++i) {
    const double blend = static_cast<double>(i + 1) / count;
    const Pose pose = i + 1 == step_.substeps.size() ? target : interpolate(from, target, blend);
    StepInput& substep = step_.substeps[i];
    substep.renews_volume = renews_volume(i, step_.substeps.size(), step_s);
    substep.h_s = step_s / count;
    substep.world_from_head_rotation = pose.rotation;
    substep.head_shift_m = pose.position_m - previous.position_m;
    substep.gravity_mps2 = scene_.gravity_mps2;
    substep.groom_gravity_in_head_mps2 = groom_gravity_in_head_mps2_;
    substep.wind_mps = glm::dvec3(0.0);
    substep.gusts.clear();
    substep.colliders.clear();
    substep.body.capsules.clear();
    substep.body.planes.clear();
    substep.follicle_limit_rad = kFreeFollicleRad;
    end_time_s_[i] = end_time_s - step_s * (1.0 - blend);
    head_position_m_[i] = pose.position_m;
    previous = pose;
  }
  if (has_jumped) bust_follower_.carry(world_from_head_.rotation, target.rotation, input.joints);
  world_from_head_ = target;
  step_.world_from_head = target;
  move_bust(input, has_jumped);
}

/// Where the head was before the step, as strands feel it. `rate`: of the motion per simulated time.
Pose StepBuilder::place_before(const Pose& target, bool has_jumped, double rate) {
  felt_ = has_jumped ? 0.0 : felt_share(rate);
  const HeadMovement moved{target.position_m - world_from_head_.position_m,
                           turn_between(world_from_head_.rotation, target.rotation)};
  const HeadMovement felt = felt_motion_.feel(moved, felt_, input_.has_teleported, 1.0 / scene_.step_rate_hz);
  if (felt_motion_.share() == 1.0) return world_from_head_;
  return {target.position_m - felt.shift_m, turned(target.rotation, -felt.turn_rad)};
}

/// Neck and chest of the step, before what collides is placed.
void StepBuilder::move_bust(const InputFrame& input, bool has_jumped) {
  for (StepInput& substep : step_.substeps) substep.bust = {};
  if (!has_bust()) return;
  if (!has_jumped) bust_follower_.follow(world_from_head_.rotation, input.joints, 1.0 / scene_.step_rate_hz);
  const BustTurn before = std::exchange(bust_turn_, BustTurn(0.0));
  bust_ = bust_code(bust_follower_.world_from_chest());
  bust_turn_ = bust_turn(bust_, world_from_head_.rotation);
  // What is carried along takes its bust with it, as codec `step` has it.
  const BustTurn from = step_.carried_to_rotation ? bust_turn_ : before;
  const auto count = static_cast<double>(step_.substeps.size());
  for (size_t i = 0; i < step_.substeps.size(); ++i)
    step_.substeps[i].bust = {bust_rig_, between(from, bust_turn_, static_cast<double>(i + 1) / count),
                              between(from, bust_turn_, static_cast<double>(i) / count)};
}

StepScene StepBuilder::step_scene(const SceneFeatures& features) const {
  StepScene scene;
  scene.step_s = 1.0 / scene_.step_rate_hz;
  scene.substeps = scene_.substeps;
  scene.gravity_mps2 = scene_.gravity_mps2;
  scene.groom_gravity_in_head_mps2 = groom_gravity_in_head_mps2_;
  if (features.has_follicle_limit) scene.follicle_limit_rad = glm::radians(scene_.follicle_limit_deg);
  scene.follicle_cosine = static_cast<float>(std::cos(scene.follicle_limit_rad));
  scene.follicle_sine = static_cast<float>(std::sin(scene.follicle_limit_rad));
  if (features.has_colliders) scene.colliders = colliders_;
  if (has_bust()) scene.bust = bust_rig_;
  scene.mean_wind_mps = scene_.wind.mean_mps;
  if (features.has_turbulence) scene.waves = waves_;
  if (features.has_body && !step_.substeps.empty()) {
    scene.body = step_.substeps.back().body;
    scene.body.is_new = false;
    for (BodyCapsule& capsule : scene.body.capsules)
      capsule = {.from_radius_m = capsule.from_radius_m, .to_radius_m = capsule.to_radius_m};
  }
  return scene;
}

StepTick StepBuilder::step_tick(uint64_t tick) const {
  StepTick result;
  result.tick = tick;
  result.world_from_head = world_from_head_;
  result.bust = bust();
  if (step_.substeps.empty()) return result;
  glm::dvec3 shift_m(0.0);
  for (const StepInput& substep : step_.substeps) shift_m += substep.head_shift_m;
  if (step_.carried_to_rotation)
    result.carried_to = Pose{world_from_head_.position_m - shift_m, *step_.carried_to_rotation};
  result.wind_mps = step_.substeps.back().wind_mps;
  result.has_waves = !step_.substeps.back().gusts.empty();
  const BodyInput& body = step_.substeps.back().body;
  result.has_body = body.acts();
  result.is_body_new = step_.substeps.front().body.is_new;
  for (const BodyCapsule& capsule : body.capsules)
    result.body_m.insert(result.body_m.end(), {capsule.from_m, capsule.to_m});
  return result;
}

}  // namespace strandcast
