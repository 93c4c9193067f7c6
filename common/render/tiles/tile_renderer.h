// The renderer without OpenGL: strands are expanded, lit and shaded once per point, sorted into tiles and
// blended there front to back, on all processors (shaders/README.md says how it and the OpenGL renderer
// agree). The same pixels for every number of threads and every instruction set.
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
  bool is_finest = false;  // all followers and segments of the look, whatever the size of the picture
};

/// BadInput for an asset that does not fit together.
Result<std::unique_ptr<Renderer>> make_tile_renderer(const SceneAsset& asset, const LookDesc& look,
                                                     const TileOptions& options = {});

}  // namespace strandcast
