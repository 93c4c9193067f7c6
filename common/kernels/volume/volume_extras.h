// What some readers want of a hair volume besides density and velocity, at the same nodes: by how much the
// density exceeds that of a target (Woodhouse 2017, 6.2), and what the hair upwind leaves of the wind.
// From one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

#include "common/kernels/volume/hair_volume.h"

namespace strandcast {

/// Densities to be reached, in head space.
struct TargetDensity {
  VolumeGrid grid;
  std::vector<float> density_mpm3;  // (nodes)
};
TargetDensity make_target(const VolumeGrid& grid, std::span<const glm::vec4> nodes);

/// What of the wind reaches each node: 1 where there is no hair upwind.
struct WindShadow {
  glm::vec3 along_in_head{0.0f, 0.0f, 1.0f};  // the way the wind goes, a unit vector
  float width_m = 0.0f;                       // by which a strand stops the wind
  bool is_arriving = false;  // true: what comes to a node's own hair, who looks up takes that away itself
};

class VolumeExtras {
 public:
  explicit VolumeExtras(const VolumeOptions& options)
      : options_(options), workers_(options.workers == nullptr ? &shared_workers() : options.workers) {}

  /// Updates what is asked for. Without a target the excess stays; without a shadow all wind comes through.
  void update(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const TargetDensity* target,
              const WindShadow* shadow);
  /// (nodes of the last update) density less the target's, m/m^3, smoothed as the density is, so that its
  /// slope is the exact derivative of half the sum of squares by a vertex's place, per length of hair and
  /// cell.
  std::span<const float> excess_mpm3() const { return excess_mpm3_; }
  /// (nodes of the last update) share of the wind that comes there.
  std::span<const float> wind_share() const { return wind_share_; }
  uint64_t size_bytes() const {
    const size_t floats =
        excess_mpm3_.size() + wind_share_.size() + all_density_.size() + left_.size() + density_.size();
    return (one_.size() + other_.size()) * sizeof(glm::vec4) + 2 * rows_.size() + floats * sizeof(float);
  }

 private:
  WorkerPool::Terms terms() const { return workers_->at(options_.priority); }
  void find_excess(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const TargetDensity& target);
  void sweep(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const WindShadow& shadow);

  VolumeOptions options_;
  WorkerPool* workers_;
  std::vector<float> excess_mpm3_;
  std::vector<float> wind_share_;
  // Between two passes of smoothing.
  std::vector<glm::vec4> one_;
  std::vector<glm::vec4> other_;
  std::vector<uint8_t> rows_;
  std::vector<uint8_t> other_rows_;
  // Of the sweep: density at all nodes, then two layers across the wind.
  std::vector<float> all_density_;
  std::vector<float> left_;
  std::vector<float> density_;
};

/// Numbers at nodes as shaders/sim/volume.glsl looks them up: to an element those of the node, of its next
/// along x, along y, and along both.
void pack_corners(const VolumeGrid& grid, std::span<const float> values, std::span<glm::vec4> elements);

}  // namespace strandcast
