// Lookups in the light lattice and in the look, for kernels (common/simd/variants.h). Everything is inlined.
#pragma once

#include <cstring>

#include "common/render/laws.h"
#include "common/render/light_lattice.h"
#include "common/render/tiles/strand_shading.h"

namespace strandcast {

STRANDCAST_LANES law::HairLook hair_look(const ShadingNumbers& n) {
  law::HairLook look;
  look.root_color = n.root_color;
  look.tip_color = n.tip_color;
  // schema begin: hair look
  // clang-format off
  look.diffuse = n.diffuse;
  look.scatter = n.scatter;
  look.highlight = n.highlight;
  look.transmission = n.transmission;
  look.second_highlight = n.second_highlight;
  look.width = n.width_rad;
  look.tilt = n.tilt_rad;
  look.tilt_spread = n.tilt_spread_rad;
  look.root_darkening = n.root_darkening;
  look.strand_variation = n.strand_variation;
  look.lock_variation = n.lock_variation;
  look.warmth_variation = n.warmth_variation;
  look.wetness = n.wetness;
  // clang-format on
  // schema end
  return look;
}
STRANDCAST_LANES law::HairLights hair_lights(const ShadingNumbers& n, const LightDirections& lights) {
  return {lights.to_key, n.key_color, lights.to_rim, n.rim_color, lights.has_rim, lights.up, n.ambient};
}

/// Position in a lattice: offset of the cell's lower corner, and weights towards the next ones.
struct LatticePlace {
  int32_t offset[simd::kLanes];
  simd::Float fx, fy, fz;
};
STRANDCAST_LANES LatticePlace lattice_place(law::vec3 cell, const glm::ivec3& size) {
  using namespace simd;
  // What is no number goes to the first cell.
  const Float x = max(min(cell.x, static_cast<float>(size.x) - 1.001f), 0.0f);
  const Float y = max(min(cell.y, static_cast<float>(size.y) - 1.001f), 0.0f);
  const Float z = max(min(cell.z, static_cast<float>(size.z) - 1.001f), 0.0f);
  const IntBits ix = to_integers(x);
  const IntBits iy = to_integers(y);
  const IntBits iz = to_integers(z);
  const IntBits offset = (iz * size.y + iy) * size.x + ix;
  LatticePlace place;
  std::memcpy(place.offset, &offset, sizeof offset);
  place.fx = x - Float(__builtin_convertvector(ix, FloatBits));
  place.fy = y - Float(__builtin_convertvector(iy, FloatBits));
  place.fz = z - Float(__builtin_convertvector(iz, FloatBits));
  return place;
}

STRANDCAST_LANES simd::Float low_halves(simd::UintBits v) {
  return __builtin_convertvector((simd::IntBits)(v & 0xffffu), simd::FloatBits);
}
STRANDCAST_LANES simd::Float high_halves(simd::UintBits v) {
  return __builtin_convertvector((simd::IntBits)(v >> 16), simd::FloatBits);
}

/// Returns optical depths towards the lights at points of head space, interpolated trilinearly.
STRANDCAST_LANES law::LightDepth light_depth_at(const LightLatticeView& view, law::vec3 point) {
  using namespace simd;
  const Float scale = 1.0f / view.cell_m;
  const law::vec3 cell((dot(point, law::vec3(view.axis[0])) - view.origin_m.x) * scale,
                       (dot(point, law::vec3(view.axis[1])) - view.origin_m.y) * scale,
                       (dot(point, law::vec3(view.axis[2])) - view.origin_m.z) * scale);
  const LatticePlace fine = lattice_place(cell, view.size);
  Float rows[4];
  for (int row = 0; row < 4; ++row) {
    const size_t step = static_cast<size_t>(row & 1) * view.size.x +
                        static_cast<size_t>(row >> 1) * view.size.x * view.size.y;
    UintBits pair;
    for (uint32_t lane = 0; lane < kLanes; ++lane) {
      uint32_t both;
      std::memcpy(&both, view.key + fine.offset[lane] + step, sizeof both);
      pair[lane] = both;
    }
    rows[row] = mix(low_halves(pair), high_halves(pair), fine.fx);
  }
  law::LightDepth depth;
  depth.key = kLightDepthUnit * mix(mix(rows[0], rows[1], fine.fy), mix(rows[2], rows[3], fine.fy), fine.fz);

  // Middles of the halved cells lie half a cell further.
  const law::vec3 halved((cell.x - 0.5f) * 0.5f, (cell.y - 0.5f) * 0.5f, (cell.z - 0.5f) * 0.5f);
  const LatticePlace coarse = lattice_place(halved, view.half_size);
  Float rim[4];
  Float sky[4];
  for (int row = 0; row < 4; ++row) {
    const size_t step = static_cast<size_t>(row & 1) * view.half_size.x +
                        static_cast<size_t>(row >> 1) * view.half_size.x * view.half_size.y;
    UintBits near;
    UintBits next;
    for (uint32_t lane = 0; lane < kLanes; ++lane) {
      near[lane] = view.others[coarse.offset[lane] + step];
      next[lane] = view.others[coarse.offset[lane] + step + 1];
    }
    rim[row] = mix(low_halves(near), low_halves(next), coarse.fx);
    sky[row] = mix(high_halves(near), high_halves(next), coarse.fx);
  }
  depth.rim =
      kLightDepthUnit * mix(mix(rim[0], rim[1], coarse.fy), mix(rim[2], rim[3], coarse.fy), coarse.fz);
  depth.sky =
      kLightDepthUnit * mix(mix(sky[0], sky[1], coarse.fy), mix(sky[2], sky[3], coarse.fy), coarse.fz);
  return depth;
}

}  // namespace strandcast
