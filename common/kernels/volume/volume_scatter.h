// The first half of a hair volume on processors: strands into the nodes of a lattice. Vertices are sorted by
// layer of cells (counted, then placed as records), and each layer is summed by one thread in the order of
// strands, so that sums are the same bits from every instruction set and number of threads. Any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>

#include "common/kernels/strand_blocks.h"
#include "common/simd/variants.h"

namespace strandcast {

/// Layers of cells that a strand can be in: lattice points -kMaxLayers / 2 to kMaxLayers / 2 along z. What is
/// farther away, or no number, is outside.
inline constexpr int32_t kMaxLayers = 2048;
/// Largest distance from the centre in cells; it leaves room for the margins of a grid.
inline constexpr float kVolumeReachCells = kMaxLayers / 2 - 32;
/// Samples of a segment that is longer than a cell, at most.
inline constexpr uint32_t kMaxSegmentSamples = 8;

/// One sample of a strand.
struct VolumeRecord {
  float at[3];  // in cells, from the grid's first node
  float length_m;
  float velocity_mps[3];
  float unused;
};

/// Bounds of what was counted, in cells.
struct VolumeBounds {
  std::array<float, 3> low;
  std::array<float, 3> high;
};

struct VolumeScatter {
  StrandBlocksView position_m;      // head-relative world axes
  StrandBlocksView velocity_mps;    // world; values = nullptr: nothing moves
  float velocity_scale = 1.0f;      // velocities are this times what stands there
  const float* length_m = nullptr;  // (blocks x vertex_count x 16) hair that a vertex stands for, or, with
                                    // several samples, the segment before it
  uint32_t samples = 1;             // of each segment; 1: vertices are the samples
  glm::mat3 cells_from_world{1.0f};
  glm::vec3 head_velocity_mps{0.0f};
  float ahead_s = 0.0f;  // strands are put where they are after this time

  // Counting
  uint32_t* counts = nullptr;  // (kMaxLayers) of this share
  VolumeBounds* bounds = nullptr;
  // Placing
  uint32_t* places = nullptr;  // (kMaxLayers) where this share's next record of each layer goes
  glm::ivec3 first{0};
  VolumeRecord* records = nullptr;
};

struct VolumeScatterRange {
  const VolumeScatter* work = nullptr;
  uint32_t begin = 0;  // blocks
  uint32_t end = 0;
};

/// Samples per layer, and their bounds.
void count_records(simd::InstructionSet set, const VolumeScatterRange& range);
/// The same samples as records.
void place_records(simd::InstructionSet set, const VolumeScatterRange& range);

/// Layers that one thread sums, one behind the other.
struct VolumeSlab {
  const VolumeRecord* records = nullptr;  // of all layers
  const uint32_t* layer_begin = nullptr;  // of each layer of cells, and the end of the last one
  uint32_t begin = 0;                     // layers of cells
  uint32_t end = 0;
  glm::uvec3 nodes{0u};
  double* scratch = nullptr;        // 2 layers of nodes x 4, 64-byte aligned; zero before and after
  uint8_t* scratch_rows = nullptr;  // 2 x nodes.y; zero before and after
  /// (nodes) velocity x length, length; empty rows stay unchanged.
  glm::vec4* sums = nullptr;
  uint8_t* rows = nullptr;  // (nodes.z x nodes.y) whether something is in a row of nodes
  // The layer of nodes behind the last layer of cells, which the next slab sums too.
  glm::vec4* last_sums = nullptr;
  uint8_t* last_rows = nullptr;
  uint64_t* outside = nullptr;  // records beside the grid
};

void sum_slab(simd::InstructionSet set, const VolumeSlab& slab);

}  // namespace strandcast
