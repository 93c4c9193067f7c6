// HairVolume: length of hair per space, and the mean velocity of the hair there, on the nodes of a lattice in
// head space (Petrovic, Henne, Anderson 2005; Woodhouse 2017, equations 2.2 to 2.4). Computed on the
// processors from strands in blocks; who reads it says when. The same bits from every instruction set and
// number of threads. From one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/base/worker_pool.h"
#include "common/kernels/strand_blocks.h"
#include "common/kernels/volume/volume_desc.h"
#include "common/kernels/volume/volume_grid.h"
#include "common/kernels/volume/volume_scatter.h"
#include "common/simd/variants.h"

namespace strandcast {

struct VolumeOptions {
  uint32_t resolution = 32;       // kMinVolumeResolution .. kMaxVolumeResolution
  uint32_t smoothing = 1;         // passes of [1 2 1] / 4 along each axis, 0 .. kMaxVolumeSmoothing
  WorkerPool* workers = nullptr;  // outlives the volume; nullptr: the process's
  Priority priority = Priority::Simulation;
  simd::InstructionSet set = simd::widest_set();
  float cell_m = 0.0f;  // 0: from the groom's box and the resolution
};

/// What strands are made of.
struct VolumeStrands {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  /// (vertex_count x strand_count), strand fastest; w = length of the segment before a vertex
  std::span<const glm::vec4> rest_in_head_m;
  /// Number of hairs that each strand stands for, empty if it is one; a strand of 0 hairs is left out.
  std::span<const float> hairs;
};

/// Where the strands are, and how they move.
struct VolumeInput {
  StrandBlocksView position_m;    // head-relative world axes
  StrandBlocksView velocity_mps;  // world; values = nullptr: nothing moves
  float velocity_scale = 1.0f;    // velocities are this times what stands there
  glm::mat3 head_from_world{1.0f};
  glm::vec3 head_velocity_mps{0.0f};
  float ahead_s = 0.0f;  // the volume is that of the strands after this time
};

class HairVolume {
 public:
  /// BadInput for a groom without extent or too far away, and for options out of range.
  static Result<HairVolume> make(const VolumeStrands& strands, const VolumeOptions& options);

  /// Fills `nodes` with mean velocity (world axes, relative to the head joint, m/s) and density (m/m^3), as
  /// many as grid() then says; the caller has room for most_nodes().
  void update(const VolumeInput& input, std::span<glm::vec4> nodes);

  const VolumeGrid& grid() const { return grid_; }
  size_t most_nodes() const { return most_nodes_; }
  float cell_m() const { return grid_.cell_m; }
  /// Samples of the last update, and those of them that were not in the grid: beyond its limits, or no
  /// number.
  uint64_t sample_count() const { return sample_count_; }
  uint64_t outside_count() const { return outside_count_; }
  /// Box of the groom at rest, lattice points.
  const glm::ivec3& home_low() const { return home_low_; }
  const glm::ivec3& home_high() const { return home_high_; }
  /// Samples of each segment; 1: vertices are the samples.
  uint32_t segment_samples() const { return samples_; }
  /// (blocks x vertex_count x 16) hair that a vertex stands for, m, or with several samples the segment
  /// before it.
  std::span<const float> sample_lengths_m() const { return length_m_; }
  /// Returns the length of all strands together.
  double length_m() const { return total_length_m_; }
  uint64_t size_bytes() const;

 private:
  struct Share {  // of the blocks of strands: what one thread counts and places
    uint32_t begin = 0;
    uint32_t end = 0;
    std::vector<uint32_t> places;
    VolumeBounds bounds{};
  };
  struct Slab {  // of the layers of cells: what one thread sums
    uint32_t begin = 0;
    uint32_t end = 0;
    uint64_t outside = 0;
    std::vector<glm::vec4> last_sums;
    std::vector<uint8_t> last_rows;
  };
  /// Memory of a thread that sums: two layers of nodes.
  struct Scratch {
    std::vector<double> layers;
    std::vector<uint8_t> rows;
  };
  /// Lattice layers from the first that has hair to behind the last, from 0.
  struct LayerRange {
    uint32_t begin = 0;
    uint32_t end = 0;
  };
  /// A field under way: values at nodes, and which rows of them count.
  struct Field {
    glm::vec4* values = nullptr;
    uint8_t* rows = nullptr;
  };

  HairVolume() = default;
  void fit_grid();
  void choose_places();
  void choose_slabs();
  void sum_layers(const Field& sums);
  void add_last_layers(const Field& sums);
  void smooth(const Field& field, const Field& other, bool is_velocity);
  void divide(const Field& field);
  template <class Work>
  void for_layers(const Work& work);

  VolumeOptions options_;
  WorkerPool* workers_ = nullptr;
  VolumeGrid grid_;
  glm::ivec3 home_low_{0};  // box of the groom at rest, lattice points
  glm::ivec3 home_high_{0};
  size_t most_nodes_ = 0;
  uint32_t samples_ = 1;
  double total_length_m_ = 0.0;
  uint64_t sample_count_ = 0;
  uint64_t outside_count_ = 0;

  std::vector<float> length_m_;  // (blocks x vertex_count x 16)
  std::vector<Share> shares_;
  std::vector<uint32_t> layer_begin_;  // (kMaxLayers + 1) records of each lattice layer
  LayerRange counted_;                 // that shares have counts of
  std::vector<VolumeRecord> records_;
  std::vector<Slab> slabs_;
  std::vector<Scratch> scratch_;  // of each worker
  std::vector<glm::vec4> other_;  // (most_nodes_) between two passes of smoothing
  std::vector<uint8_t> rows_;
  std::vector<uint8_t> other_rows_;
};

/// The volume at a point in head space, as kernels look it up (shaders/sim/volume.glsl): trilinear between
/// the eight nodes around it.
VolumeSample sample_volume(const VolumeGrid& grid, std::span<const glm::vec4> nodes,
                           const glm::dvec3& point_in_head_m);

}  // namespace strandcast
