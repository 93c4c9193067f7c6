// What some readers want of a hair volume besides density and velocity, at the same nodes: by how much the
// density exceeds that of a target (document 003, section 6.2), and what the hair upwind leaves of the wind.
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

  /// Fills `extras` (as many as the grid's nodes): x = density less the target's, smoothed as the density is,
  /// so that its slope is the exact derivative of half the sum of squares by a vertex's place, per length of
  /// hair and cell; y = share of the wind. What is not asked for is 0, and 1.
  void update(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const TargetDensity* target,
              const WindShadow* shadow, std::span<glm::vec4> extras);
  uint64_t size_bytes() const { return other_.size() * sizeof(glm::vec4) + 2 * rows_.size(); }

 private:
  WorkerPool::Terms terms() const { return workers_->at(options_.priority); }
  void find_excess(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const TargetDensity& target,
                   std::span<glm::vec4> extras);
  void sweep(const VolumeGrid& grid, std::span<const glm::vec4> nodes, const WindShadow& shadow,
             std::span<glm::vec4> extras) const;

  VolumeOptions options_;
  WorkerPool* workers_;
  std::vector<glm::vec4> other_;
  std::vector<uint8_t> rows_;
  std::vector<uint8_t> other_rows_;
};

}  // namespace strandcast
