// Shape of the tile renderer on the GPU, for C++ and GLSL.
#ifndef STRANDCAST_SHADERS_SHARED_TILES_H
#define STRANDCAST_SHADERS_SHARED_TILES_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Pixels across and down a tile: one invocation per column keeps a column's pixels in registers.
const uint kTileColumns = 8u;
const uint kTileRows = 16u;
// Tiles that one group draws, side by side in the list of tiles.
const uint kTilesPerGroup = 8u;
// Invocations that order one tile, and the steps of depth that they put its segments into first.
const uint kOrderLocalSize = 16u;
const uint kDepthSteps = 128u;
// Invocations that merge one tile whose segments lie close in depth.
const uint kMergeLocalSize = 64u;
// Invocations that add up the tiles' counts, alone.
const uint kOffsetLocalSize = 128u;
// Counts of one picture, by their places in a buffer.
const uint kTotalPairs = 0u;      // of a segment and a tile
const uint kTotalSegments = 1u;   // on the picture
const uint kTotalNotFinite = 2u;  // segments with a position that is no number
const uint kTotalFullTiles = 3u;  // left to tile_merge.comp; with the next two, groups to dispatch
const uint kTotalCount = 6u;
// Segments over one tile at most; the furthest are left out.
const uint kMaxTileSegments = 60000u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
