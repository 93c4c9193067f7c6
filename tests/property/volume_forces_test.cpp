// Strands that act on each other: friction and repulsion are what double precision says, take energy away and
// bring hair to rest, with every model that bears them, on both executors.
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <tuple>
#include <utility>

#include "server/report/crowded_hair.h"
#include "server/sim/executor/lanes_executor.h"
#include "server/sim/volume/volume_forces.h"
#include "server/source/scene_change.h"
#include "tests/support/sim_devices.h"
#include "tests/support/test_grid.h"

namespace strandcast::volume_forces_test {
namespace {

using testing::HasSubstr;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A tuft whose vertices are somewhere else than in the groom, and move.
struct ShakenTuft {
  explicit ShakenTuft(Executor& executor) : strands(executor) {
    groom = make_tuft(203, 16, 0.2f, 5);
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
    input.wind_mps = glm::dvec3(-0.7, 0.2, 0.4);
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
      const glm::dvec3 pull = drag * (here.velocity_mps - moving);
      const auto held = [&](const glm::dvec3& velocity_mps) {
        return velocity_mps * std::min(1.0, 0.25 * cell_m / h_s / std::max(glm::length(velocity_mps), 1e-30));
      };
      const glm::dvec3 push = -k * over * slope;
      glm::dvec3 gained = held(h_s / (1.0 + h_s * drag) * (push + pull));
      if (desc.air.acts) gained = held(h_s / (1.0 + h_s * drag) * push) + in_air(desc, i, here, moving, drag);
      if (i < layout.strand_count) gained = glm::dvec3(0.0);
      result.push_back(glm::dvec3(state.velocity_mps[i]) + gained);
    }
    return result;
  }

  /// What a vertex takes on from hair around it, and then from the air.
  glm::dvec3 in_air(const VolumeDesc& desc, size_t i, const VolumeSample& here, const glm::dvec3& moving,
                    double friction_per_s) const {
    const StrandLayout& layout = strands.layout();
    const AirDesc& air = desc.air;
    const glm::dvec3 outside_mps = input.wind_mps - input.head_shift_m / input.h_s;
    const double hairs_per_m2 = here.density_mpm3 * air.hairs / layout.strand_count;
    const glm::dvec3 rubbed_mps = -std::expm1(-input.h_s * friction_per_s) * (here.velocity_mps - moving);
    const double carried = carried_air_share(air, hairs_per_m2, glm::length(outside_mps - here.velocity_mps));
    // What of the hair's motion is not with the wind, which hair at rest has braked already.
    const double with_wind = glm::dot(here.velocity_mps, outside_mps) / glm::dot(outside_mps, outside_mps);
    const glm::dvec3 own_mps = here.velocity_mps - std::clamp(with_wind, 0.0, 1.0) * outside_mps;
    const glm::dvec3 air_mps = met_wind_share(carried) * outside_mps + carried * own_mps;
    const glm::dvec3 flow_mps = air_mps - moving - rubbed_mps;
    const double rate_per_s = air_rate_per_s(air, glm::length(flow_mps));
    const size_t after = std::min(i / layout.strand_count + 1, size_t{layout.vertex_count} - 1);
    const size_t strand = i % layout.strand_count;
    const glm::dvec3 along = glm::normalize(
        glm::dvec3(state.position_m[after * layout.strand_count + strand]) -
        glm::dvec3(state.position_m[std::max(i, size_t{layout.strand_count}) - layout.strand_count]));
    const glm::dvec3 flow_along = along * glm::dot(along, flow_mps);
    return rubbed_mps - std::expm1(-input.h_s * rate_per_s) * (flow_mps - (1.0 - kAlongShare) * flow_along);
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
  VolumeDesc air;
  air.resolution = 12;
  air.air.acts = true;
  air.air.hairs = 4000.0;
  air.air.has_wind = false;
  VolumeDesc all = some_volume();
  all.air = air.air;
  std::vector<VolumeDesc> descs = {friction, repulsion, some_volume(), air, all};
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
  const Groom groom = make_tuft(is_whole ? 400 : 200, is_whole ? 32 : 16, 0.2f, 1);
  CrowdedHair hair = CrowdedHair::make(*executor, scene, groom, scene.volume.resolution).value();
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

/// On the small grid those of the usual scenes, and the one with a bound of its own.
std::vector<std::string> rows_that_rest() {
  const std::set<std::string> some = {"dftl", "direct_rod", "tractrix_hybrid"};
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table())
    if (row.has_kernel && row.bears_volume && row.comes_to_rest && row.name != "dftl_parallel" &&
        (test_grid() == TestGrid::Whole || some.contains(row.name)))
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
      CrowdedHair hair = CrowdedHair::make(*executor, scene, groom, scene.volume.resolution).value();
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

/// Half of the sum of squares by which a tuft's density differs from that of other hair on the same lattice,
/// over what it is without the tuft (Woodhouse 2017, 6.2), before and after some seconds.
std::pair<double, double> energies(const SceneDesc& scene, const Groom& groom, const Groom& target,
                                   double seconds) {
  SceneContent content;
  content.groom = groom;
  content.volume_target = std::make_shared<const Groom>(target);
  auto executor = std::move(make_lanes_executor()).value();
  HairRun run = HairRun::make(*executor, scene, content).value();
  const StrandLayout goal_layout = make_strand_layout(target).value();
  HairVolume volume =
      HairVolume::make({run.layout().strand_count, run.layout().vertex_count, run.layout().rest, {}},
                       {scene.volume.resolution, scene.volume.smoothing})
          .value();
  VolumeOptions options{scene.volume.resolution, scene.volume.smoothing};
  options.cell_m = volume.cell_m();
  HairVolume goal =
      HairVolume::make({goal_layout.strand_count, goal_layout.vertex_count, goal_layout.rest, {}}, options)
          .value();
  const auto densities = [](HairVolume& of, uint32_t strands, uint32_t vertices, const auto& position,
                            double scale) {
    StrandBlocks blocks(strands, vertices);
    pack_blocks(std::span(position), blocks);
    VolumeInput input;
    input.position_m = blocks.view();
    std::vector<glm::vec4> nodes(of.most_nodes());
    of.update(input, nodes);
    std::map<std::tuple<int, int, int>, double> density;  // by lattice point
    const VolumeGrid& grid = of.grid();
    for (uint32_t z = 0; z < grid.nodes.z; ++z)
      for (uint32_t y = 0; y < grid.nodes.y; ++y)
        for (uint32_t x = 0; x < grid.nodes.x; ++x) {
          const glm::ivec3 at = grid.first + glm::ivec3(glm::uvec3(x, y, z));
          density[{at.x, at.y, at.z}] = scale * static_cast<double>(nodes[grid.index(x, y, z)].w);
        }
    return density;
  };
  const auto wanted = densities(goal, goal_layout.strand_count, goal_layout.vertex_count, goal_layout.rest,
                                volume.length_m() / goal.length_m());
  const auto energy = [&] {
    auto found = densities(volume, run.layout().strand_count, run.layout().vertex_count,
                           run.position_in_head_m(), 1.0);
    double off = 0.0, whole = 0.0;
    for (const auto& [at, density] : wanted) {
      found[at] -= density;
      whole += density * density;
    }
    for (const auto& [at, density] : found) off += density * density;
    return off / whole;
  };
  const double before = energy();
  for (int i = 0; i < std::lround(seconds * scene.step_rate_hz); ++i) run.step(shaken_head(0.0));
  return {before, energy()};
}

// Hair goes to where other hair is, as a volume: the energy of Woodhouse falls, and without the push it does
// not.
TEST(VolumeForces, ATargetOfAnotherGroomIsApproached) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.volume = {};
  scene.volume.resolution = some_volume().resolution;
  scene.volume.friction_per_s = 20.0;
  const Groom groom = make_tuft(200, 16, 0.2f, 1);
  Groom target = groom;  // blown aside, further and further down
  for (glm::vec3& point : target.rest_position_m) point.x += 0.25f * (0.1f - point.y);
  const auto [before, unpushed] = energies(scene, groom, target, 4.0);
  scene.volume.target_per_s2 = 18000.0;
  const auto [same, pushed] = energies(scene, groom, target, 4.0);
  EXPECT_EQ(before, same);
  EXPECT_GT(unpushed, 0.8 * before);
  EXPECT_LT(pushed, 0.6 * before) << before;
  // Twice as many strands are no other target: what there is of hair is scaled.
  Groom doubled = target;
  const auto vertices = static_cast<uint32_t>(target.rest_position_m.size());
  for (uint32_t strand = 0; strand < target.strand_count(); ++strand)
    doubled.offset.push_back(vertices + target.offset[strand + 1]);
  doubled.rest_position_m.insert(doubled.rest_position_m.end(), target.rest_position_m.begin(),
                                 target.rest_position_m.end());
  doubled.pinned.insert(doubled.pinned.end(), target.pinned.begin(), target.pinned.end());
  EXPECT_NEAR(energies(scene, groom, doubled, 4.0).second, pushed, 1e-2 * before);
}

/// Root mean square of how far vertices are from the middle of a turn around them: the radius of curls.
double curl_radius_m(const StrandLayout& layout, const std::vector<glm::vec3>& position_m,
                     uint32_t turn_vertices) {
  double squared = 0.0;
  size_t counted = 0;
  for (uint32_t strand = 0; strand < layout.strand_count; ++strand)
    for (uint32_t first = 0; first + turn_vertices <= layout.vertex_count; ++first) {
      glm::dvec3 middle(0.0);
      for (uint32_t i = 0; i < turn_vertices; ++i)
        middle += glm::dvec3(position_m[layout.index(first + i, strand)]);
      middle /= turn_vertices;
      const uint32_t vertex = first + turn_vertices / 2;
      if (vertex >= layout.vertex_count) continue;
      // Across the way of the turn: along it a vertex is where it is on any straight hair too.
      const glm::dvec3 way =
          glm::normalize(glm::dvec3(position_m[layout.index(first + turn_vertices - 1, strand)]) -
                         glm::dvec3(position_m[layout.index(first, strand)]));
      const glm::dvec3 off = glm::dvec3(position_m[layout.index(vertex, strand)]) - middle;
      const glm::dvec3 across = off - glm::dot(off, way) * way;
      squared += glm::dot(across, across);
      ++counted;
    }
  return std::sqrt(squared / static_cast<double>(counted));
}

// Real curls, by the rod's own curvature and twist: hair that acts on hair keeps them and the room that they
// take.
TEST(VolumeForces, CurlsKeepTheirTurnsAndTheirRoom) {
  constexpr float kRadiusM = 0.005f;
  constexpr uint32_t kTurnVertices = 8;
  constexpr float kTurnRad = 2.0f * std::numbers::pi_v<float> / kTurnVertices;
  Groom groom = make_tuft(200, 32, 0.2f, 1);
  std::mt19937 random(2);
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const float phase = std::uniform_real_distribution<float>(0.0f, 6.28f)(random);
    for (uint32_t i = groom.offset[strand] + 1; i < groom.offset[strand + 1]; ++i) {
      const float angle = phase + kTurnRad * static_cast<float>(i - groom.offset[strand]);
      groom.rest_position_m[i] += kRadiusM * glm::vec3(std::cos(angle), 0.0f, std::sin(angle));
    }
  }
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  const auto after = [&](const VolumeDesc& volume) {
    scene.volume = volume;
    auto executor = std::move(make_lanes_executor()).value();
    CrowdedHair hair = CrowdedHair::make(*executor, scene, groom, some_volume().resolution).value();
    hair.shake(5.0);
    hair.hold(15.0);
    const RestFindings found = hair.look(2.0);
    return std::pair(found,
                     curl_radius_m(hair.run().layout(), hair.run().position_in_head_m(), kTurnVertices));
  };
  const double groomed_m = curl_radius_m(
      make_strand_layout(groom).value(),
      [&] {
        const StrandLayout layout = make_strand_layout(groom).value();
        return std::vector<glm::vec3>(layout.rest.begin(), layout.rest.end());
      }(),
      kTurnVertices);
  EXPECT_NEAR(groomed_m, static_cast<double>(kRadiusM), 5e-4);
  const auto [alone, alone_m] = after({});
  const auto [together, together_m] = after(some_volume());
  SCOPED_TRACE(to_text(alone));
  SCOPED_TRACE(to_text(together));
  EXPECT_GT(together_m, 0.95 * alone_m) << "of " << groomed_m;
  EXPECT_GT(together.volume_share, 0.93);
  EXPECT_LT(together.crowded_share, 0.01);
  EXPECT_LT(together.speed_rms_mps, 5e-4);
}

// Wind through hair: what is behind other hair is blown less far.
TEST(VolumeForces, HairKeepsTheWindOffHair) {
  SceneDesc scene = hanging_scene(*find_solver("direct_rod").value());
  scene.wind.mean_mps = {1.5f, 0.0f, 0.0f};
  scene.volume.repulsion_per_s2 = 0.0;
  const auto blown_m = [&] {
    auto executor = std::move(make_lanes_executor()).value();
    CrowdedHair hair =
        CrowdedHair::make(*executor, scene, make_tuft(400, 16, 0.2f, 1), scene.volume.resolution).value();
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
}  // namespace strandcast::volume_forces_test
