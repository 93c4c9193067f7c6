// From points of strands in head space to what is drawn: pixels, depth, width, joints and light, once per
// point (shaders/lib/hair_light.glsl). No GL.
#pragma once

#include "common/base/worker_pool.h"
#include "common/render/light_lattice.h"
#include "common/render/tiles/tile_frame.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"
#include "common/simd/variants.h"

namespace strandcast {

/// The look in the numbers of shaders/lib/hair_light.glsl.
struct ShadingNumbers {
  glm::vec3 root_color, tip_color;
  float diffuse, scatter, highlight, transmission, second_highlight;
  float width_rad, tilt_rad, tilt_spread_rad;
  float root_darkening, strand_variation, lock_variation, warmth_variation, wetness;
  glm::vec3 key_color, rim_color;
  glm::vec3 skin_color;
  float ambient;
};
ShadingNumbers shading_numbers(const LookDesc& look);

struct ShadeInput {
  ShadingNumbers look;
  LightDirections lights;
  LightLatticeView lattice;
  View view;      // target_px: of the picture
  float width_m;  // of a strand at its root
  float tip_scale;
  float tip_fade;
};

/// Points in head space become points on the screen, in place.
void shade_points(const ShadeInput& input, WorkerPool& workers, simd::InstructionSet set,
                  StrandPoints& points);

}  // namespace strandcast
