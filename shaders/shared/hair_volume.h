// Bindings and numbers on which the kernels that make a hair volume (volume/*.comp) and their host agree. Included
// by both: only "const uint" lines here, with names that no other header uses.
#ifndef STRANDCAST_SHADERS_SHARED_HAIR_VOLUME_H
#define STRANDCAST_SHADERS_SHARED_HAIR_VOLUME_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Storage blocks: these kernels store neither positions nor velocities.
const uint kBindingVolumeFacts = 0u;
const uint kBindingVolumeCounts = 1u;
const uint kBindingVolumeRanks = 2u;
const uint kBindingVolumeRecords = 3u;
const uint kBindingVolumeCells = 4u;
const uint kBindingVolumeLists = 5u;
const uint kBindingVolumeNodes = 6u;
const uint kBindingVolumeMasks = 7u;
const uint kBindingVolumePlaces = 2u;   // of vertices
const uint kBindingVolumeMotions = 3u;

// Uniform block beside the step's.
const uint kBindingVolumeFactsRead = 1u;
// Texture units beside those of the simulation (shared/bindings.h).
const uint kUnitVolumeLength = 4u;
const uint kUnitVolumeRank = 5u;
const uint kUnitVolumeRecord = 6u;
const uint kUnitVolumeCell = 7u;
const uint kUnitVolumeList = 8u;
const uint kUnitVolumeSum = 11u;
const uint kUnitVolumeMask = 12u;
const uint kUnitVolumeSegment = 13u;
const uint kUnitVolumeNode = 14u;
const uint kUnitVolumePlace = 15u;
const uint kUnitVolumeMotion = 9u;

// Elements of a table in front of the nodes (sim/volume.glsl).
const uint kVolumeHeader = 2u;
// Hair farther from the head joint than so many cells is outside; cells are counted from this far below it.
const uint kVolumeReach = 992u;
const uint kVolumeCellBias = 4096u;
// Nodes of a grid along x, at most: a row's segments of eight nodes have a bit each of two words.
const uint kVolumeMostAcross = 512u;
const uint kVolumeSegment = 8u;
// Bits of a sample's number on its segment (kMaxSegmentSamples), below the vertex; a rank that is none.
const uint kVolumePartBits = 3u;
const uint kVolumeOutside = 0xffffffffu;
const uint kVolumeLocalSize = 64u;
// Groups of an indirect dispatch along x, at most.
const uint kVolumeGroupsAcross = 32768u;
// Samples in a cell from which on a group sums it, and not an invocation: llvmpipe leaves loops after 65,535
// turns.
const uint kVolumeCrowd = 512u;

// Words of the facts of a volume under way. Bounds of what is there, in cells + bias.
const uint kFactLow = 0u;
const uint kFactHigh = 3u;
const uint kFactMostMomentum = 6u;      // bits of the largest component of velocity x length
const uint kFactMostCount = 7u;         // samples in a cell, at most
const uint kFactPlaced = 8u;            // samples in the grid
const uint kFactCells = 9u;             // with samples
const uint kFactCrowds = 10u;           // with more than kVolumeCrowd
const uint kFactSegments = 11u;         // of nodes that something comes to
const uint kFactNodes = 12u;            // along each axis
const uint kFactMomentum = 15u;         // bits of the largest component of momentum, kept
const uint kFactFirst = 16u;            // lattice point of node 0 + bias
// Groups of the indirect dispatches.
const uint kFactRowGroups = 20u;
const uint kFactCellGroups = 24u;
const uint kFactCrowdGroups = 28u;
const uint kFactSegmentGroups = 32u;
const uint kFactCount = 36u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
