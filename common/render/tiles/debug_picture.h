// Debug views that do not draw strands (common/render/debug_view.h), over the picture or in its place. Slow
// and simple. No GL.
#pragma once

#include "common/base/worker_pool.h"
#include "common/pictures/image_codec.h"
#include "common/render/light_lattice.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/view.h"

namespace strandcast {

/// Draws the density of hair in the plane through the camera's target, perpendicular to the view.
void draw_density(const LightLatticeView& lattice, const View& view, WorkerPool& workers, Image& image);

/// Tints each tile by its number of segments and draws its border.
void mark_tiles(const TileLists<TileSegment>& segments, const TileGrid& grid, Image& image);

}  // namespace strandcast
