// Shades points of strands: from head space to pixels, depth, width, joints and light, once per point
// (shaders/lib/hair_light.glsl). No GL.
#pragma once

#include "common/base/worker_pool.h"
#include "common/render/debug_view.h"
#include "common/render/light_lattice.h"
#include "common/render/look_lights.h"
#include "common/render/tiles/tile_frame.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"
#include "common/simd/variants.h"

namespace strandcast {

struct ShadeInput {
  ShadingNumbers look;
  LightDirections lights;
  LightLatticeView lattice;
  View view;      // target_px: of the picture
  float width_m;  // of a strand at its root
  float tip_scale;
  float tip_fade;
  DebugView debug_view = DebugView::None;
};

/// Turns points in head space into shaded points on the screen, in place.
void shade_points(const ShadeInput& input, WorkerPool& workers, simd::InstructionSet set,
                  StrandPoints& points);

}  // namespace strandcast
