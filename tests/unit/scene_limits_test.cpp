// Ranges and first values of every number of a scene and of every strand model's parameters, as literals. A
// change here is one that people notice: scene files of before may be refused, or mean something else.
#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "common/scene/scene_file.h"
#include "server/sim/solver_registry.h"
#include "server/source/scene_change.h"
#include "server/source/scene_parameters.h"

namespace strandcast::scene_limits_test {
namespace {

/// Path, least, most, and the value where nothing is said.
constexpr const char* kSceneLimits = R"(
groom.procedural.strand_count 1 200000 2000
groom.procedural.vertex_count 2 64 16
groom.procedural.length_m 0.005 3 0.28
groom.procedural.length_variation 0 0.95 0.12
groom.procedural.curl_radius_m 0 0.05 0.006
groom.procedural.curl_turns 0 100 2.2
groom.procedural.seed 0 4.294967e+09 1
groom.hairs 1 1e+07 100000
head.radius_m 0 1 0.095
head.field_resolution 16 128 64
hair.length 0.3 1.5 1
hair.curl 0 2 1
hair.stiffness 0.1 10 1
hair.friction 0 5 1
hair.wind 0 3 1
step_rate_hz 10 1000 60
substeps 1 64 1
gravity_mps2 -1000 1000 { x: 0 y: -9.81 z: 0 }
wind.mean_mps -100 100 { x: 0 y: 0 z: 0 }
wind.gust_intensity 0 3 0
wind.gust_length_m 0.1 1000 9
wind.seed 0 4.294967e+09 1
wind.along_share 0 1 1
look.root_color 0 1 { r: 0.045 g: 0.019 b: 0.008 }
look.tip_color 0 1 { r: 0.125 g: 0.054 b: 0.021 }
look.eumelanin 0 10 1.3
look.pheomelanin 0 10 0
look.strand_radius_m 1e-06 0.01 0.00012
look.tip_scale 0 1 0.25
look.followers 0 64 3
look.segments 1 8 3
look.style.clump 0 1 0.8
look.style.locks 1 16 5
look.style.spread 0 1 0.012
look.style.wave_m 0 0.1 0.004
look.style.wave_count 0 64 3
look.style.frizz_m 0 0.1 0.0006
look.style.frizz_count 0 64 9
look.style.stray_share 0 1 0.04
look.style.stray_spread 0 20 3.5
look.style.length_spread 0 1 0.18
look.style.short_share 0 1 0.1
look.style.tip_fade 0 1 0.2
look.shading.diffuse 0 10 0.42
look.shading.scatter 0 10 0.5
look.shading.highlight 0 10 1
look.shading.transmission 0 10 1
look.shading.second_highlight 0 10 1
look.shading.highlight_width_deg 1 45 7.5
look.shading.cuticle_deg -15 15 3.5
look.shading.cuticle_spread_deg 0 30 5
look.shading.root_darkening 0 1 0.45
look.shading.strand_variation 0 1 0.22
look.shading.lock_variation 0 1 0.12
look.shading.warmth_variation 0 1 0.08
look.shading.wetness 0 1 0
look.light_direction -1000 1000 { x: -0.45 y: -0.75 z: -0.5 }
look.light_color 0 100 { r: 1 g: 0.97 b: 0.92 }
look.rim_direction -1000 1000 { x: 0.55 y: -0.45 z: 0.8 }
look.rim_color 0 100 { r: 0.45 g: 0.48 b: 0.55 }
look.ambient 0 1 0.22
look.exposure 0 100 1
look.background 0 1 { r: 0.11 g: 0.12 b: 0.135 }
look.skin_color 0 1 { r: 0.55 g: 0.38 b: 0.29 }
camera.offset_m -100 100 { x: 0.22 y: 0.07 z: 0.62 }
camera.target_m -100 100 { x: 0 y: -0.055 z: 0 }
camera.fov_y_rad 0.02 2.8 0.61
stream.bound_m 1e-06 0.0005 0.0001
stream.frame_width 16 3840 640
stream.frame_height 16 2160 360
stream.jpeg_quality 1 100 80
stream.frame_rate_hz 0.1 240 15
stream.strand_rate_hz 0 1000 0
follicle_limit_deg 1 180 20
bend_limit.least_root_deg 0 180 0
bend_limit.least_tip_deg 0 180 0
bend_limit.most_root_deg 0 180 180
bend_limit.most_tip_deg 0 180 180
volume.friction_per_s 0 10000 0
volume.repulsion_per_s2 0 1000000 0
volume.target_per_s2 0 1000000 0
volume.wind_width_m 0 1 0
volume.rest_density_scale 0.1 100 1
volume.resolution 8 128 32
volume.smoothing 0 3 1
volume.interval 1 100 1
air.lock_width_m 0.001 1 0.015
body.friction 0 10 0.3
body.tip_clearance_m 0.0005 0.1 0.0005
body.force_per_s2 0 1000000 1800
body.joint_offset_m -1 1 { x: 0 y: -0.09 z: -0.02 }
detail.full_at_px 1 10000 240
detail.hysteresis 0 0.9 0.25
detail.settle_s 0 3600 2
detail.simulated_share 0.001 1 1
detail.far_share 0.001 1 0.25
detail.idle_after_s 0 3600 10
)";

/// Path, least and most of what a scene has only where somebody says so.
constexpr const char* kAddedLimits = R"(
groom.file.unit_m 0 1000
groom.file.vertex_count 0 64
groom.file.strand_vertex_count 0 4096
colliders.0.center_m -100 100
colliders.0.radius_m 0.0001 10
body.capsules.0.from_m -100 100
body.capsules.0.to_m -100 100
body.capsules.0.from_radius_m 0.0001 10
body.capsules.0.to_radius_m 0.0001 10
body.planes.0.point_m -100 100
body.planes.0.normal -1000 1000
body.planes.0.velocity_mps -100 100
live.0.port 0 65535
live.0.delay_ms 0 200
live.0.max_datagram_bytes 64 65507
live.0.scale 0.001 1000
place_m -1000 1000
)";

/// Model, parameter, least, most, and the value where nothing is said.
constexpr const char* kSolverLimits = R"(
dftl s_damping 0 1 0.9
dftl air_drag_per_s 0 1000 1
dftl style_stiffness_per_s2 0 1000000 400
dftl style_tip_share 0 1 0.25
dftl sag_free 0 1 1
dftl collider_friction 0 10 0.3
dftl max_speed_mps 0.1 1000 30
dftl thrust_share 0 1 1
dftl thickness_spread 0 0.5 0
dftl_parallel s_damping 0 1 0.9
dftl_parallel air_drag_per_s 0 1000 1
dftl_parallel style_stiffness_per_s2 0 1000000 400
dftl_parallel style_tip_share 0 1 0.25
dftl_parallel sag_free 0 1 1
dftl_parallel collider_friction 0 10 0.3
dftl_parallel max_speed_mps 0.1 1000 30
dftl_parallel thrust_share 0 1 1
dftl_parallel thickness_spread 0 0.5 0
dftl_parallel iterations 1 64 5
dftl_parallel exact_length 0 1 1
ftl air_drag_per_s 0 1000 1
ftl style_stiffness_per_s2 0 1000000 400
ftl style_tip_share 0 1 0.25
ftl sag_free 0 1 1
ftl collider_friction 0 10 0.3
ftl max_speed_mps 0.1 1000 30
ftl thickness_spread 0 0.5 0
pbd air_drag_per_s 0 1000 1
pbd style_stiffness_per_s2 0 1000000 400
pbd style_tip_share 0 1 0.25
pbd sag_free 0 1 1
pbd collider_friction 0 10 0.3
pbd max_speed_mps 0.1 1000 30
pbd iterations 1 64 10
pbd stretch_stiffness 0 1 1
pbd bend_stiffness 0 1 0.05
xpbd air_drag_per_s 0 1000 1
xpbd style_stiffness_per_s2 0 1000000 400
xpbd style_tip_share 0 1 0.25
xpbd sag_free 0 1 1
xpbd collider_friction 0 10 0.3
xpbd max_speed_mps 0.1 1000 30
xpbd iterations 1 64 20
xpbd stretch_compliance_m_per_n 0 1000000 0.001
xpbd bend_compliance_m_per_n 0 1e+09 500
xpbd linear_density_kg_per_m 1e-07 1 1.02e-05
mass_spring air_drag_per_s 0 1000 1
mass_spring style_stiffness_per_s2 0 1000000 400
mass_spring style_tip_share 0 1 0.25
mass_spring sag_free 0 1 1
mass_spring collider_friction 0 10 0.3
mass_spring max_speed_mps 0.1 1000 30
mass_spring integrator 0 2 2
mass_spring solves 1 4 2
mass_spring stretch_stiffness_n_per_m 0 1e+12 1
mass_spring stretch_damping_ns_per_m 0 1000000 0.0001
mass_spring bend_stiffness_nm_per_rad 0 1000000 1e-06
mass_spring altitude_stiffness_n_per_m 0 1e+12 0.003
mass_spring linear_density_kg_per_m 1e-07 1000 1.02e-05
mass_spring shortest_segment_m 1e-06 10 0.001
mass_spring stretch_limit 0 10 0.05
shape_constraints air_drag_per_s 0 1000 1
shape_constraints style_stiffness_per_s2 0 1000000 100
shape_constraints style_tip_share 0 1 0.25
shape_constraints sag_free 0 1 1
shape_constraints collider_friction 0 10 0.3
shape_constraints max_speed_mps 0.1 1000 30
shape_constraints iterations 0 64 8
shape_constraints shape_iterations 0 64 2
shape_constraints bend_stiffness_m4_per_s2 0 1 0.00144231
shape_constraints shock_share 0 1 0.8
shape_constraints damping_per_s 0 1000 4.8
shape_constraints fast_acceleration_mps2 0.1 1e+09 50
shape_constraints stretch_limit 0 10 0.1
shape_constraints fast_damping_per_s 0 1000 20
shape_constraints air_along_share 0 1 0.5
tractrix_emulation s_damping 0 1 0.9
tractrix_emulation air_drag_per_s 0 1000 1
tractrix_emulation style_stiffness_per_s2 0 1000000 400
tractrix_emulation style_tip_share 0 1 0.25
tractrix_emulation sag_free 0 1 1
tractrix_emulation collider_friction 0 10 0.3
tractrix_emulation max_speed_mps 0.1 1000 30
tractrix_emulation random_order 0 1 0
tractrix_emulation order_seed 0 65535 1
tractrix_split air_drag_per_s 0 1000 1
tractrix_split style_stiffness_per_s2 0 1000000 400
tractrix_split style_tip_share 0 1 0.25
tractrix_split sag_free 0 1 1
tractrix_split collider_friction 0 10 0.3
tractrix_split max_speed_mps 0.1 1000 30
tractrix_split style_mix 0 1 0.3
tractrix_split style_return_per_s 0 1000 0.5
tractrix_hybrid air_drag_per_s 0 1000 1
tractrix_hybrid style_stiffness_per_s2 0 1000000 400
tractrix_hybrid style_tip_share 0 1 0.25
tractrix_hybrid sag_free 0 1 1
tractrix_hybrid collider_friction 0 10 0.3
tractrix_hybrid max_speed_mps 0.1 1000 30
tractrix_hybrid iterations 1 64 4
tractrix_hybrid stretch_compliance_m_per_n 0 1000000 0.001
tractrix_hybrid bend_compliance_m_per_n 0 1e+09 500
tractrix_hybrid linear_density_kg_per_m 1e-07 1 1.02e-05
tractrix_hybrid tractrix_sweeps 0 2 2
tractrix_hybrid tractrix_first 0 1 0
angular_projection air_drag_per_s 0 1000 1
angular_projection style_stiffness_per_s2 0 1000000 400
angular_projection style_tip_share 0 1 0.25
angular_projection sag_free 0 1 1
angular_projection collider_friction 0 10 0.3
angular_projection max_speed_mps 0.1 1000 30
angular_projection radius_m 1e-06 0.01 5e-05
angular_projection density_kgpm3 1 100000 1300
angular_projection young_modulus_pa 0 1e+16 3e+09
angular_projection bending_damping_s 0 1 0.002
angular_projection sweeps 1 64 4
articulated air_drag_per_s 0 1000 1
articulated style_stiffness_per_s2 0 1000000 400
articulated style_tip_share 0 1 0.25
articulated sag_free 0 1 1
articulated collider_friction 0 10 0.3
articulated max_speed_mps 0.1 1000 30
articulated radius_m 1e-06 0.01 5e-05
articulated density_kgpm3 1 100000 1300
articulated young_modulus_pa 0 1e+16 3e+09
articulated poisson_ratio 0 0.5 0.45
articulated bending_damping_s 0 1 0.002
articulated solves 1 8 1
super_helix air_drag_per_s 0 1000 1
super_helix style_stiffness_per_s2 0 1000000 400
super_helix style_tip_share 0 1 0.25
super_helix sag_free 0 1 1
super_helix collider_friction 0 10 0.3
super_helix max_speed_mps 0.1 1000 30
super_helix radius_m 1e-06 0.01 5e-05
super_helix density_kgpm3 1 100000 1300
super_helix young_modulus_pa 0 1e+16 3e+09
super_helix poisson_ratio 0 0.5 0.45
super_helix bending_damping_s 0 1 0.002
super_helix elements 1 16 4
direct_rod radius_m 1e-06 0.01 5e-05
direct_rod density_kgpm3 1 100000 1300
direct_rod young_modulus_pa 0 1e+16 3e+09
direct_rod poisson_ratio -0.9 10 0.45
direct_rod bending_damping_s 0 1 0.002
direct_rod tip_mass_kg 0 1 0
direct_rod air_drag_per_s 0 1000 2
direct_rod sag_free 0 1 0
direct_rod style_margin 0 10 1.446
direct_rod solves 1 4 1
direct_rod order 1 2 2
direct_rod collider_friction 0 10 0.3
direct_rod max_speed_mps 0.1 1000 30
)";

/// As a line of the tables.
std::string line_of(const ParameterInfo& info) {
  return fmt::format("{} {:.7g} {:.7g}{}{}", info.path, info.minimum, info.maximum,
                     info.unset_value.empty() ? "" : " ", info.unset_value);
}

std::vector<std::string> lines_of(const char* table) {
  std::vector<std::string> lines;
  std::istringstream text(table);
  for (std::string line; std::getline(text, line);)
    if (!line.empty()) lines.push_back(line);
  return lines;
}

bool is_of_solver(const ParameterInfo& info) {
  return info.path.starts_with("solver.parameters.");
}

TEST(SceneLimits, NumbersOfAScene) {
  std::vector<std::string> lines;
  for (const ParameterInfo& info : list_parameters(built_in_scene()))
    if (info.has_range && !is_of_solver(info)) lines.push_back(line_of(info));
  EXPECT_THAT(lines, testing::ElementsAreArray(lines_of(kSceneLimits)))
      << fmt::format("{}", fmt::join(lines, "\n"));
}

/// What a scene has only where somebody says so.
SceneDesc scene_with_more() {
  SceneDesc scene = built_in_scene();
  scene.groom = FileGroomDesc{};
  scene.colliders.resize(1);
  scene.body.capsules.resize(1);
  scene.body.planes.resize(1);
  scene.live.resize(1);
  scene.place_m = {1.0, 0.0, 0.0};
  return scene;
}

TEST(SceneLimits, NumbersOfWhatASceneMayAdd) {
  std::vector<std::string> lines;
  const std::vector<ParameterInfo> usual = list_parameters(built_in_scene());
  for (const ParameterInfo& info : list_parameters(scene_with_more())) {
    const bool is_usual = std::any_of(usual.begin(), usual.end(),
                                      [&](const ParameterInfo& other) { return other.path == info.path; });
    if (info.has_range && !is_usual) lines.push_back(line_of(info));
  }
  EXPECT_THAT(lines, testing::ElementsAreArray(lines_of(kAddedLimits)))
      << fmt::format("{}", fmt::join(lines, "\n"));
}

TEST(SceneLimits, ParametersOfStrandModels) {
  std::vector<std::string> lines;
  for (const SolverRow& row : solver_table())
    for (const SolverParameterInfo& one : row.parameters)
      lines.push_back(fmt::format("{} {} {:.7g} {:.7g} {:g}", row.name, one.name, one.minimum, one.maximum,
                                  one.default_value));
  EXPECT_THAT(lines, testing::ElementsAreArray(lines_of(kSolverLimits)))
      << fmt::format("{}", fmt::join(lines, "\n"));
}

}  // namespace
}  // namespace strandcast::scene_limits_test
