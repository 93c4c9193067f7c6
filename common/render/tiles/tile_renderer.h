// Tile renderer: draws without OpenGL on all processors. Strands are expanded, lit and shaded once per point,
// sorted into tiles and blended there front to back. shaders/README.md says how it and the OpenGL renderer
// agree. The pixels are the same for any number of threads and every instruction set.
#pragma once

#include <memory>

#include "common/base/worker_pool.h"
#include "common/render/light_lattice.h"
#include "common/render/renderer.h"
#include "common/simd/variants.h"

namespace strandcast {

struct TileOptions {
  WorkerPool* workers = &shared_workers();
  simd::InstructionSet set = simd::widest_set();
  uint32_t light_cells = kLightCells;  // along the hair's largest side
  bool is_finest = false;     // all followers and segments of the look, whatever the size of the picture
  bool draws_hidden = false;  // also strands of which nothing is seen: the same picture, but for rounding
};

/// Makes a renderer; BadInput for an inconsistent asset.
Result<std::unique_ptr<Renderer>> make_tile_renderer(const SceneAsset& asset, const LookDesc& look,
                                                     const TileOptions& options = {});

}  // namespace strandcast
