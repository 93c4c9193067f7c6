// Strands that act on each other: friction and repulsion are what double precision says, take energy away and
// bring hair to rest, with every model that bears them, on both executors.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <limits>
#include <random>

#include "server/sim/executor/lanes_executor.h"
#include "server/sim/volume/volume_forces.h"
#include "server/source/scene_change.h"
#include "tests/support/crowded_hair.h"
#include "tests/support/sim_devices.h"
#include "tests/support/test_grid.h"

namespace strandcast {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A tuft whose vertices are somewhere else than in the groom, and move.
struct ShakenTuft {
  explicit ShakenTuft(Executor& executor) : strands(executor) {
    groom = tuft(203, 16, 0.2f, 5);
    EXPECT_TRUE(strands.load(groom, rotation));
    std::mt19937 random(6);
    std::normal_distribution<float> normal;
    strands.read(state);
    for (size_t i = 0; i < state.position_m.size(); ++i) {
      if (i < strands.layout().strand_count) continue;  // roots are where they are
      state.position_m[i] += 0.004f * glm::vec3(normal(random), normal(random), normal(random));
      // Together: denser than in the groom.
      state.position_m[i].x *= 0.7f;
      state.velocity_mps[i] = 0.3f * glm::vec3(normal(random), normal(random), normal(random));
    }
    strands.write(state);
    strands.read(state);
    input.world_from_head_rotation = rotation;
    input.head_shift_m = glm::dvec3(0.3, -0.1, 0.2) * input.h_s;
    step = make_step_block(input, {.max_speed_mps = 100.0}, strands.layout().counts(), strands.head());
  }

  std::vector<glm::vec3> apply(Executor& executor, const VolumeDesc& desc) {
    auto forces = VolumeForces::make(executor, {}, strands.layout(), desc, nullptr);
    EXPECT_TRUE(forces) << forces.error().to_string();
    (*forces)->gather(input, strands, nullptr);
    (*forces)->apply(step, strands, nullptr);
    SolverState after;
    strands.read(after);
    strands.write(state);
    return after.velocity_mps;
  }

  /// The same in double: a volume of its own, and the law of shaders/sim/volume_forces.comp.
  std::vector<glm::dvec3> expected(const VolumeDesc& desc) const {
    const StrandLayout& layout = strands.layout();
    HairVolume volume = HairVolume::make({layout.strand_count, layout.vertex_count, layout.rest, {}},
                                         {desc.resolution, desc.smoothing})
                            .value();
    std::vector<glm::vec4> nodes(volume.most_nodes());
    StrandBlocks position(layout.strand_count, layout.vertex_count);
    StrandBlocks velocity(layout.strand_count, layout.vertex_count);
    VolumeInput rest;
    pack_blocks(std::span<const glm::vec4>(layout.rest), position);
    rest.position_m = position.view();
    volume.update(rest, nodes);
    std::vector<double> threshold;
    double mean = 0.0;
    for (const glm::vec4& vertex : layout.rest) {
      threshold.push_back(sample_volume(volume.grid(), nodes, glm::dvec3(vertex)).density_mpm3);
      mean += threshold.back() / static_cast<double>(layout.size());
    }
    const glm::dvec3 head_mps = input.head_shift_m / input.h_s;
    VolumeInput now;
    pack_blocks(std::span<const glm::vec3>(state.position_m), position);
    pack_blocks(std::span<const glm::vec3>(state.velocity_mps), velocity);
    now.position_m = position.view();
    now.velocity_mps = velocity.view();
    now.head_from_world = glm::mat3(glm::mat3_cast(glm::conjugate(rotation)));
    now.head_velocity_mps = glm::vec3(head_mps);
    now.ahead_s = static_cast<float>(input.h_s);
    volume.update(now, nodes);
    const auto cell_m = static_cast<double>(volume.cell_m());
    const double h_s = input.h_s;
    std::vector<glm::dvec3> result;
    for (size_t i = 0; i < layout.size(); ++i) {
      const glm::dvec3 moving = glm::dvec3(state.velocity_mps[i]) - head_mps;
      const glm::dvec3 ahead = glm::dvec3(state.position_m[i]) + h_s * moving;
      const VolumeSample here = sample_volume(volume.grid(), nodes, glm::conjugate(rotation) * ahead);
      const double rest_density = desc.rest_density_scale * std::max(threshold[i], 0.5 * mean);
      const glm::dvec3 slope = rotation * here.gradient_mpm4 / rest_density;
      const double over = std::max(here.density_mpm3 / rest_density - 1.0, 0.0);
      const double k = desc.repulsion_per_s2 * cell_m * cell_m;
      const double drag = desc.friction_per_s + (over > 0.0 ? 2.0 * k * h_s * glm::dot(slope, slope) : 0.0);
      const glm::dvec3 gained =
          h_s / (1.0 + h_s * drag) * (-k * over * slope + drag * (here.velocity_mps - moving));
      const double most = 0.25 * cell_m / h_s;
      const double size = glm::length(gained);
      const bool is_root = i < layout.strand_count;
      result.push_back(glm::dvec3(state.velocity_mps[i]) + (is_root       ? 0.0
                                                            : size > most ? most / size
                                                                          : 1.0) *
                                                               gained);
    }
    return result;
  }

  Groom groom;
  glm::dquat rotation = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.2));
  StrandState strands;
  SolverState state;
  StepInput input;
  StepBlock step{};
};

VolumeDesc some_volume() {
  VolumeDesc volume;
  volume.friction_per_s = 20.0;
  volume.repulsion_per_s2 = 18000.0;
  volume.resolution = 12;
  return volume;
}

class VolumeForcesOn : public testing::TestWithParam<SimDevice> {
 protected:
  static SimExecutors executors_;
};
SimExecutors VolumeForcesOn::executors_;

TEST_P(VolumeForcesOn, AreWhatDoublePrecisionSays) {
  Executor& executor = executors_.on(GetParam());
  ShakenTuft hair(executor);
  VolumeDesc friction = some_volume();
  friction.repulsion_per_s2 = 0.0;
  VolumeDesc repulsion = some_volume();
  repulsion.friction_per_s = 0.0;
  std::vector<VolumeDesc> descs = {friction, repulsion, some_volume()};
  if (GetParam() == SimDevice::Gl) {  // where it would be chosen on hardware only
    descs.push_back(some_volume());
    descs.back().scatter = "sort";
  }
  for (const VolumeDesc& desc : descs) {
    const std::vector<glm::vec3> found = hair.apply(executor, desc);
    const std::vector<glm::dvec3> expected = hair.expected(desc);
    double changed = 0.0;
    for (size_t i = 0; i < found.size(); ++i) {
      ASSERT_LT(glm::distance(glm::dvec3(found[i]), expected[i]), 1e-4) << i;
      changed = std::max(changed, glm::distance(expected[i], glm::dvec3(hair.state.velocity_mps[i])));
    }
    EXPECT_GT(changed, 0.05) << "something happened";
  }
}

TEST_P(VolumeForcesOn, FrictionNeverAddsEnergy) {
  Executor& executor = executors_.on(GetParam());
  ShakenTuft hair(executor);
  hair.input.head_shift_m = glm::dvec3(0.0);
  hair.step = make_step_block(hair.input, {.max_speed_mps = 100.0}, hair.strands.layout().counts(),
                              hair.strands.head());
  VolumeDesc desc = some_volume();
  desc.repulsion_per_s2 = 0.0;
  const auto energy = [&](const std::vector<glm::vec3>& velocity_mps) {
    const StrandLayout& layout = hair.strands.layout();
    double sum = 0.0;
    for (size_t i = layout.strand_count; i < layout.size(); ++i) {
      const bool is_last = i + layout.strand_count >= layout.size();
      const auto after_m = is_last ? 0.0 : static_cast<double>(layout.rest[i + layout.strand_count].w);
      const auto length_m = 0.5 * (static_cast<double>(layout.rest[i].w) + after_m);
      sum += length_m * glm::dot(glm::dvec3(velocity_mps[i]), glm::dvec3(velocity_mps[i]));
    }
    return sum;
  };
  double before = energy(hair.state.velocity_mps);
  for (const double friction : {1.0, 20.0, 1e4}) {
    desc.friction_per_s = friction;
    const double after = energy(hair.apply(executor, desc));
    EXPECT_LT(after, before) << friction;
    before = after;
  }
}

TEST_P(VolumeForcesOn, TheGroomItselfIsLeftAlone) {
  Executor& executor = executors_.on(GetParam());
  ShakenTuft hair(executor);
  ASSERT_TRUE(hair.strands.load(hair.groom, hair.rotation));
  hair.strands.read(hair.state);
  hair.input.head_shift_m = glm::dvec3(0.0);
  hair.step = make_step_block(hair.input, {.max_speed_mps = 100.0}, hair.strands.layout().counts(),
                              hair.strands.head());
  for (const glm::vec3& velocity_mps : hair.apply(executor, some_volume()))
    ASSERT_LT(glm::length(velocity_mps), 1e-4f);  // 2 um in a step: density by rounding
}

TEST_P(VolumeForcesOn, ABrokenStrandChangesNoOther) {
  Executor& executor = executors_.on(GetParam());
  ShakenTuft hair(executor);
  const uint32_t strand_count = hair.strands.layout().strand_count;
  for (uint32_t vertex = 1; vertex < 16; ++vertex)
    hair.state.position_m[size_t{vertex} * strand_count + 7] = glm::vec3(kNan);
  hair.strands.write(hair.state);
  const std::vector<glm::vec3> found = hair.apply(executor, some_volume());
  for (size_t i = 0; i < found.size(); ++i)
    if (i % strand_count != 7) {
      ASSERT_TRUE(glm::length(found[i]) < 10.0f) << i;
    }
}

INSTANTIATE_TEST_SUITE_P(Devices, VolumeForcesOn, testing::ValuesIn(sim_devices()), name_of_device);

TEST(VolumeForces, WhatBearsNoneSaysSo) {
  SceneDesc scene;
  scene.volume = some_volume();
  scene.solver.name = "ftl";
  EXPECT_THAT(check_solver(scene).error().to_string(),
              HasSubstr("solver ftl takes no forces between strands"));
  scene.solver.name = "super_helix";
  EXPECT_THAT(check_solver(scene).error().to_string(), HasSubstr("it has no kernel"));
  scene.solver.name = "dftl";
  EXPECT_TRUE(check_solver(scene));
}

// ---- twenty seconds of shaking, then a minute is nearly over

SceneDesc hanging_scene(const SolverRow& row) {
  SceneDesc scene;
  scene.has_auto_collider = false;
  scene.solver = {row.name, {}};
  for (const SolverParameterInfo& info : row.parameters)
    if (info.name == "style_stiffness_per_s2" || info.name == "sag_free")
      scene.solver.parameters[info.name] = 0.0;
  scene.volume = some_volume();
  return scene;
}

RestFindings after_shaking(const SceneDesc& scene) {
  const bool is_whole = test_grid() == TestGrid::Whole;
  auto executor = std::move(make_lanes_executor()).value();
  CrowdedHair hair(*executor, scene, tuft(is_whole ? 400 : 200, is_whole ? 32 : 16, 0.2f, 1));
  hair.shake(20.0);
  hair.hold(35.0);
  return hair.look(5.0);
}

std::string to_text(const RestFindings& found) {
  return fmt::format(
      "{:.3f} mm/s rms, {:.4f} mm from step to step, {:.1f} % of the groom's volume, {:.2f} % crowded",
      1e3 * found.speed_rms_mps, 1e3 * found.nyquist_m, 100.0 * found.volume_share,
      100.0 * found.crowded_share);
}

class HangingHair : public testing::TestWithParam<std::string> {};

TEST_P(HangingHair, RestsAndKeepsItsVolume) {
  const SolverRow& row = *find_solver(GetParam()).value();
  const SceneDesc scene = hanging_scene(row);
  const RestFindings found = after_shaking(scene);
  SCOPED_TRACE(to_text(found));
  RecordProperty("found", to_text(found));
  EXPECT_LT(found.speed_rms_mps, row.name == "dftl" ? 2e-3 : 5e-4);
  EXPECT_LT(found.nyquist_m, 5e-5);
  // The sweep that gives this row its lengths starts at the tip, and undoes some of what pushes the middle.
  EXPECT_GT(found.volume_share, row.name == "tractrix_hybrid" ? 0.85 : 0.93);
  EXPECT_LT(found.crowded_share, 0.01);
}

std::vector<std::string> rows_that_rest() {
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table())
    if (row.has_kernel && row.bears_volume && row.comes_to_rest && row.name != "dftl_parallel")
      names.push_back(row.name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Rows, HangingHair, testing::ValuesIn(rows_that_rest()),
                         [](const auto& name) { return name.param; });

// A style that its model keeps stays kept: the groom's own density is what hair may have.
TEST(VolumeForces, AStyleThatIsKeptStaysSo) {
  for (const char* solver : {"dftl", "direct_rod"}) {
    SceneDesc scene = built_in_scene();
    auto& desc = std::get<ProceduralGroomDesc>(scene.groom);
    desc.strand_count = on_grid(400, 2000);
    scene.wind = {};
    scene.has_auto_collider = false;
    scene.solver = {solver, {{"sag_free", 1.0}}};
    const Groom groom = load_scene_content(scene).value().groom;
    const auto off_m = [&](const VolumeDesc& volume) {
      scene.volume = volume;
      auto executor = std::move(make_lanes_executor()).value();
      CrowdedHair hair(*executor, scene, groom);
      hair.hold(20.0);
      return hair.shape_rms_m();
    };
    VolumeDesc volume = some_volume();
    volume.resolution = 32;
    const double without_m = off_m({});
    const double with_m = off_m(volume);
    EXPECT_LT(with_m, 2e-3) << solver << ": " << without_m << " m without";
  }
}

// Hair that lies elsewhere than its groom did goes back to where the groom was, as a volume.
TEST(VolumeForces, ATargetKeepsAStyleAsAVolume) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.volume = {};
  scene.volume.resolution = some_volume().resolution;
  scene.volume.friction_per_s = 20.0;
  const RestFindings without = after_shaking(scene);
  scene.volume.target_per_s2 = 18000.0;
  const RestFindings with = after_shaking(scene);
  SCOPED_TRACE(to_text(without));
  SCOPED_TRACE(to_text(with));
  EXPECT_GT(with.volume_share, 0.93);
  EXPECT_LT(without.volume_share, 0.85);
  EXPECT_LT(with.speed_rms_mps, 5e-4);
}

// Wind through hair: what is behind other hair is blown less far.
TEST(VolumeForces, HairKeepsTheWindOffHair) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.wind.mean_mps = {1.5f, 0.0f, 0.0f};
  scene.volume.repulsion_per_s2 = 0.0;
  const auto blown_m = [&] {
    auto executor = std::move(make_lanes_executor()).value();
    CrowdedHair hair(*executor, scene, tuft(400, 16, 0.2f, 1));
    hair.hold(10.0);
    return hair.mean_shift_m();
  };
  const double free_m = blown_m().x;
  scene.volume.wind_width_m = 1e-5;
  const double hardly_m = blown_m().x;
  scene.volume.wind_width_m = 0.01;
  const double shadowed_m = blown_m().x;
  EXPECT_GT(free_m, 0.005);
  EXPECT_NEAR(hardly_m, free_m, 0.05 * free_m);
  EXPECT_LT(shadowed_m, 0.7 * free_m);
  EXPECT_GT(shadowed_m, 0.05 * free_m) << "the strands that the wind meets first";
}

// The form of the sources keeps hair shaking, and without any hair falls together.
TEST(VolumeForces, TheExplicitFormNeverRests) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.volume.integration = "explicit";
  const RestFindings found = after_shaking(scene);
  SCOPED_TRACE(to_text(found));
  EXPECT_GT(found.speed_rms_mps, 0.01);
}
TEST(VolumeForces, WithoutThemHairFallsTogether) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.volume = {};
  scene.volume.resolution = some_volume().resolution;
  const RestFindings found = after_shaking(scene);
  SCOPED_TRACE(to_text(found));
  EXPECT_LT(found.volume_share, 0.85);
}

}  // namespace
}  // namespace strandcast
