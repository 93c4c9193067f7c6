// Debug views that are no picture of strands (common/render/debug_view.h): drawn over the picture, or in its
// place. Slow and simple. No GL.
#pragma once

#include "common/base/worker_pool.h"
#include "common/pictures/image_codec.h"
#include "common/render/light_lattice.h"
#include "common/render/tiles/tile_bins.h"
#include "common/render/view.h"

namespace strandcast {

/// The density of hair in the plane through the point looked at, square to the view.
void draw_density(const LightLatticeView& lattice, const View& view, WorkerPool& workers, Image& image);

/// Tints each tile by how many segments it has, and draws its border.
void mark_tiles(const TileLists<TileSegment>& segments, const TileGrid& grid, Image& image);

}  // namespace strandcast
