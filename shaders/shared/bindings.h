// Binding numbers of buffers, shared by C++ and GLSL. Storage and uniform blocks count separately; simulation
// and rendering never share a context, so both start at 0. Every block has an instance name: equal member
// names in two stages of one program do not link otherwise.
#ifndef STRANDCAST_SHADERS_SHARED_BINDINGS_H
#define STRANDCAST_SHADERS_SHARED_BINDINGS_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Storage blocks of the simulation.
const uint kBindingPosition = 0u;
const uint kBindingVelocity = 1u;
const uint kBindingDisplacement = 2u;
const uint kBindingVelocityChange = 3u;
const uint kBindingRodScratch = 4u;
const uint kBindingRodAxis = 5u;
const uint kBindingPlaceBefore = 6u;

// Uniform block of the simulation.
const uint kBindingStep = 0u;

// Texture units of the buffer textures through which the simulation reads.
const uint kUnitRest = 0u;
const uint kUnitPosition = 1u;
const uint kUnitVelocity = 2u;
const uint kUnitDisplacement = 3u;
const uint kUnitVelocityChange = 4u;
const uint kUnitRodEdge = 5u;
const uint kUnitRodStrand = 6u;
const uint kUnitRodAxis = 7u;
const uint kUnitPlaceBefore = 8u;
const uint kUnitRestDensity = 11u;

// Of the tables in which it looks things up.
const uint kUnitField = 9u;
const uint kUnitVolume = 10u;
const uint kUnitBody = 12u;

// Storage blocks of the renderer.
const uint kBindingKeyPosition = 0u;
const uint kBindingRootTriangle = 1u;
const uint kBindingExpanded = 2u;
const uint kBindingListHead = 3u;
const uint kBindingListNode = 4u;
const uint kBindingListCount = 5u;
const uint kBindingDepthKeys = 6u;
const uint kBindingDensity = 7u;
const uint kBindingChosen = 0u;  // of segments, for who draws them
const uint kBindingRunningSum = 3u;
const uint kBindingCullMask = 4u;
const uint kBindingCullDepth = 5u;
const uint kBindingDrawCommand = 6u;
const uint kBindingFarSum = 7u;
// Of its tiles; beside them at most kBindingDensity and what is named above.
const uint kBindingTilePoints = 0u;
const uint kBindingTileStrands = 1u;
const uint kBindingTileHalved = 2u;
const uint kBindingTileSwept = 3u;
const uint kBindingTileCounts = 0u;
const uint kBindingTileFirst = 1u;
const uint kBindingTileTotals = 2u;
const uint kBindingTilePairs = 3u;
const uint kBindingTileGrouped = 4u;
const uint kBindingTileFull = 5u;

// Uniform block of the renderer.
const uint kBindingTileFrame = 0u;

// Texture units of the tiles' buffer textures.
const uint kUnitTilePoints = 0u;
const uint kUnitTileStrands = 1u;
const uint kUnitTileKeys = 2u;
const uint kUnitTileTriangles = 3u;
const uint kUnitTileOrder = 4u;
const uint kUnitTileFirst = 5u;
const uint kUnitTilePairs = 11u;
const uint kUnitTileSolid = 12u;
const uint kUnitTileKeyDepth = 6u;
const uint kUnitTileRimDepth = 7u;
const uint kUnitTileSkyDepth = 8u;
const uint kUnitTileHeadSkin = 9u;
const uint kUnitTileHeadDepth = 10u;

// Image units.
const uint kImageTileDepth = 0u;
const uint kImageTilePicture = 1u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
