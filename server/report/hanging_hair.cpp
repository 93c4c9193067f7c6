#include "server/report/hanging_hair.h"

#include <string>

#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

constexpr double kFreeDeg = 180.0;

}  // namespace

VolumeDesc volume_of(const HairCompany& company) {
  VolumeDesc volume = with_overrides(SceneDesc(), {std::string("quality=") + kFullQuality}).value().volume;
  if (!company.has_contact) volume.friction_per_s = volume.repulsion_per_s2 = 0.0;
  volume.air.acts = company.has_air;
  return volume;
}

SceneDesc hanging_scene(double step_rate_hz) {
  SceneDesc scene;
  scene.step_rate_hz = step_rate_hz;
  scene.has_auto_collider = false;
  scene.follicle_limit_deg = kFreeDeg;
  scene.wind = {};
  scene.volume = {};
  scene.solver = {"direct_rod", {}};
  return scene;
}

SolverDesc limp_rod() {
  return {"direct_rod",
          {{"young_modulus_pa", 0.0},
           {"air_drag_per_s", 0.0},
           {"bending_damping_s", 0.0},
           {"style_margin", 0.0}}};
}

Groom make_hanging_hair(uint32_t vertex_count, float length_m) {
  Groom groom;
  groom.name = "hanging hair";
  groom.offset = {0, vertex_count};
  for (uint32_t i = 0; i < vertex_count; ++i) {
    groom.rest_position_m.emplace_back(
        0.0f, -length_m * static_cast<float>(i) / static_cast<float>(vertex_count - 1), 0.0f);
    groom.pinned.push_back(i == 0 ? 1 : 0);
  }
  return groom;
}

}  // namespace strandcast
