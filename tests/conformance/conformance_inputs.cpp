#include "tests/conformance/conformance_inputs.h"

#include <map>
#include <memory>

#include "common/kernels/step_model.h"
#include "common/strands/strand_prefix.h"

namespace strandcast::conformance {
namespace {

constexpr uint32_t kSlicedStrands = 1024;  // slices, and with these vertices all classes of weights
constexpr uint32_t kSlicedVertices = 16;
constexpr uint32_t kShortStory = 3;  // frames
constexpr uint32_t kStory = 10;
constexpr uint32_t kNewBoundAt = 8;

// Of the lattice that the hair moves on. Codecs that give back the lattice they get have a coarser one.
constexpr float kFineStepM = 0x1p-21f;
constexpr int kCoarserBits = 8;

bool rounds_itself(const StreamCase& stream) {
  return stream.codec == "tangent" || stream.codec == "step";
}

/// 0, 1, .. 8, .. 0, .. -8, .. with the period 32.
int32_t zigzag(uint32_t t) {
  const auto phase = static_cast<int32_t>(t % 32);
  return phase < 8 ? phase : phase < 24 ? 16 - phase : phase - 32;
}

/// -20..20, alike for nobody near by.
int32_t tremble(uint32_t s, uint32_t v, uint32_t frame) {
  const uint32_t mixed = (s * 7919u + v * 104'729u + frame * 1'299'721u) * 2'654'435'761u;
  return static_cast<int32_t>((mixed >> 16) % 41) - 20;
}

glm::ivec3 root_of(uint32_t s) {
  const glm::ivec2 cell(static_cast<int32_t>(s % 32) - 16, static_cast<int32_t>(s / 32));
  const int32_t lower = 64 * (cell.x * cell.x + cell.y * cell.y);
  return {8192 * cell.x, 200'000 - lower, 8192 * cell.y};
}

/// From the vertex before vertex v, which is no root.
glm::ivec3 rest_edge_of(uint32_t s, uint32_t v) {
  return {1000 * zigzag(s + 3 * v), -38'000, 1200 * zigzag(5 * s + 7 * v + 9)};
}

glm::ivec3 rest_position_of(uint32_t s, uint32_t v) {
  glm::ivec3 position = root_of(s);
  for (uint32_t u = 1; u <= v; ++u) position += rest_edge_of(s, u);
  return position;
}

/// Strand 2 turns round for two frames: nothing foretells that.
bool is_turned_round(uint32_t s, uint32_t frame) {
  return s == 2 && (frame == 3 || frame == 4);
}

glm::ivec3 position_of(uint32_t s, uint32_t v, uint32_t frame) {
  glm::ivec3 edges(0);
  for (uint32_t u = 1; u <= v; ++u)
    edges += rest_edge_of(s, u) + glm::ivec3(40 * zigzag(frame + 2 * u + s % 7), 60 * zigzag(3 * frame + s),
                                             30 * zigzag(2 * frame + u + s % 3));
  if (is_turned_round(s, frame)) edges = -edges;
  return root_of(s) + edges + tremble(s, v, frame) * glm::ivec3(1, -1, 1);
}

/// Turns by 2 atan(1 / n), exact but for the divisions.
Pose head_pose(uint32_t frame) {
  const double n = 20.0 - frame;
  Pose pose;
  pose.position_m = {frame / 64.0, 1.5, frame / -128.0};
  pose.rotation = {(n * n - 1.0) / (n * n + 1.0), 0.0, 2.0 * n / (n * n + 1.0), 0.0};
  return pose;
}

/// Strands that stay where they rest: steps tell nearly all.
bool is_still(const StreamCase& stream) {
  return stream.name == "still" || stream.name == "exact";
}
Pose pose_of(const StreamCase& stream, uint32_t frame) {
  if (stream.name == "exact") return {};
  return head_pose(is_still(stream) ? 0 : frame);
}

std::shared_ptr<const StepModel> model_of(const StreamCase& stream) {
  auto model = std::make_shared<StepModel>();
  model->strand_count = stream.strand_count;
  model->vertex_count = stream.vertex_count;
  model->pinned_root_count = 2;
  model->parameters.air_drag_per_s = 4.0;
  model->parameters.max_speed_mps = 20.0;
  model->parameters.collider_friction = 0.25;
  if (stream.name == "volume" || stream.name == "volume_extras") {
    model->volume.friction_per_s = 16.0;
    model->volume.repulsion_per_s2 = 4096.0;
    model->volume.resolution = 8;
  }
  if (stream.name == "volume_extras") {
    model->volume.target_per_s2 = 1024.0;
    model->volume.wind_width_m = 0x1p-9;
    model->volume.smoothing = 2;
  }
  if (stream.name == "volume_air") {
    model->parameters.air_drag_per_s = 0.0;
    model->volume.friction_per_s = 16.0;
    model->volume.resolution = 8;
    model->volume.air.acts = true;
    model->volume.air.hairs = 65'536.0;
    model->volume.air.lock_width_m = 0x1p-6;
    model->volume.air.hair_radius_m = 0x1p-14;
    model->volume.air.hair_density_kgpm3 = 1280.0;
  }
  if (stream.name != "rod" && stream.name != "volume_extras" && stream.name != "volume_air") {
    model->kernel.shader_path = "sim/dftl.comp";
    model->parameters.s_damping = 0.875;
    model->parameters.style_stiffness_per_s2 = 64.0;
    model->parameters.style_tip_share = 0.25;
    model->parameters.sag_free = 1.0;
    return model;
  }
  model->kernel.shader_path = "sim/direct_rod.comp";
  model->kernel.variant = {{"HAS_TWIST", 1}};
  model->kernel.constants = {{"u_tip_length", 0.0},
                             {"u_spin_inertia", 0x1p-29},
                             {"u_bending_damping", 0x1p-9},
                             {"u_solves", 1u},
                             {"u_order", 2u}};
  const float segment_m = 40'000 * kFineStepM;
  const size_t size = size_t{stream.strand_count} * stream.vertex_count;
  model->rod_edge.assign(size, {0.0f, 0.0f, 1.0f, segment_m});
  for (const glm::vec4& row : {glm::vec4(0, -1, 0, segment_m), glm::vec4(1, 0, 0, segment_m / 16),
                               glm::vec4(0, -1, 0, 0x1p-10f), glm::vec4(1, 0, 0, 0x1p-11f)})
    model->rod_strand.insert(model->rod_strand.end(), stream.strand_count, row);
  return model;
}

/// Nothing that would move them.
std::shared_ptr<const StepScene> still_scene() {
  auto scene = std::make_shared<StepScene>();
  scene->step_s = 0x1p-6;
  scene->gravity_mps2 = scene->groom_gravity_in_head_mps2 = {};
  return scene;
}

/// One wave of wind and one collider; from frame 5 on another gravity.
std::shared_ptr<const StepScene> scene_of(bool is_late) {
  auto scene = std::make_shared<StepScene>();
  scene->step_s = 0x1p-6;
  scene->gravity_mps2.y = is_late ? -8.0 : -9.75;
  scene->groom_gravity_in_head_mps2.y = -9.75;
  scene->follicle_limit_rad = 0.5;
  scene->follicle_cosine = 0.875f;
  scene->follicle_sine = 0.5f;
  scene->colliders = {{glm::vec3(0.0f, -0.0625f, 0.0f), 0.0625f}};
  scene->mean_wind_mps = {1.5, 0.0, 0.25};
  scene->waves = {{glm::vec3(0.25f, 0.125f, 0.0f), glm::vec3(0.0f, 8.0f, 16.0f), 0.75f}};
  return scene;
}

/// What a server would say of its steps up to a frame. The same objects for all frames, as servers have it.
std::shared_ptr<const StepTrail> trail_of(const StreamCase& stream, uint32_t frame) {
  constexpr uint32_t kLateFrame = 5;
  if (stream.codec != "step") return nullptr;
  static std::map<std::string, std::shared_ptr<const StepModel>> models;
  static const std::shared_ptr<const StepScene> scenes[] = {scene_of(false), scene_of(true), still_scene()};
  auto& model = models[stream.name];
  if (model == nullptr) model = model_of(stream);
  auto trail = std::make_shared<StepTrail>();
  trail->model = model;
  trail->scene = scenes[is_still(stream) ? 2 : frame >= kLateFrame ? 1 : 0];
  for (uint32_t i = frame < 3 ? 0 : frame - 3; i <= frame; ++i) {
    StepTick tick;
    tick.tick = i + 1;
    tick.world_from_head = pose_of(stream, i);
    if (!is_still(stream)) tick.wind_mps = {1.5 + i / 64.0, 0.0, i / -32.0};
    tick.has_waves = i % 4 != 3;
    if (i == 7) tick.carried_to = tick.world_from_head;
    trail->ticks.push_back(tick);
  }
  return trail;
}

Snapshot snapshot_of(const StreamCase& stream, uint32_t frame) {
  constexpr int64_t kFrameNs = 16'666'667;
  Snapshot snapshot;
  snapshot.tick = frame + 1;
  snapshot.sim_time_ns = kFrameNs * static_cast<int64_t>(snapshot.tick);
  snapshot.motion_time_ns = frame == 0 ? 0 : snapshot.sim_time_ns - 1'000'000;
  snapshot.world_from_head = pose_of(stream, frame);
  snapshot.trail = trail_of(stream, frame);
  snapshot.strand_count = stream.strand_count;
  snapshot.vertex_count = stream.vertex_count;
  const int shift = (rounds_itself(stream) ? 0 : kCoarserBits) + (frame >= kNewBoundAt ? 1 : 0);
  snapshot.quantum_m = kFineStepM * static_cast<float>(1 << shift);
  for (int axis = 0; axis < 3; ++axis)
    for (uint32_t v = 0; v < stream.vertex_count; ++v)
      for (uint32_t s = 0; s < stream.strand_count; ++s)
        snapshot.lattice.push_back(
            (is_still(stream) ? rest_position_of(s, v) : position_of(s, v, frame))[axis] >> shift);
  return snapshot;
}

}  // namespace

std::vector<StreamCase> stream_cases() {
  std::vector<StreamCase> cases;
  for (const char* codec : {"raw", "delta", "tangent"}) {
    cases.push_back({"whole", codec, 7, 5, 7});
    cases.push_back({"prefix", codec, 7, 5, 3});
  }
  cases.push_back({"no_rest", "tangent", 7, 5, 7, false});
  cases.push_back({"slices", "tangent", kSlicedStrands, kSlicedVertices, kSlicedStrands});
  for (const char* name : {"whole", "rod", "still", "exact"}) cases.push_back({name, "step", 7, 5, 7});
  for (const char* name : {"volume", "volume_extras", "volume_air"}) cases.push_back({name, "step", 7, 5, 7});
  cases.push_back({"prefix", "step", 7, 5, 3});
  cases.push_back({"slices", "step", kSlicedStrands, kSlicedVertices, kSlicedStrands});
  return cases;
}

std::vector<StreamStep> steps_of(const StreamCase& stream) {
  std::vector<StreamStep> steps;
  const bool is_large = stream.strand_count == kSlicedStrands;
  for (uint32_t frame = 0; frame < (is_large ? kShortStory : kStory); ++frame)
    steps.push_back({prefix_of(snapshot_of(stream, frame), stream.coded_count),
                     is_large ? frame == 1 : frame == 4 || frame == 6});
  return steps;
}

std::vector<glm::vec3> rest_shape_of(const StreamCase& stream) {
  std::vector<glm::vec3> rest_in_head_m;
  if (!stream.has_rest) return rest_in_head_m;
  for (uint32_t v = 0; v < stream.vertex_count; ++v)
    for (uint32_t s = 0; s < stream.strand_count; ++s)
      rest_in_head_m.push_back(kFineStepM * glm::vec3(rest_position_of(s, v)));
  return rest_in_head_m;
}

}  // namespace strandcast::conformance
