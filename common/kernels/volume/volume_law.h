// VolumeLaw: all of the forces between strands but the kernel's run: the volume, made anew for a step and put
// into the table that shaders/sim/volume_forces.comp looks it up in, how dense each vertex may lie, and the
// kernel's description. The simulation has one, and so has a codec that predicts by steps. From one thread.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <vector>

#include "common/kernels/kernel_desc.h"
#include "common/kernels/step_input.h"
#include "common/kernels/volume/volume_desc.h"
#include "common/kernels/volume/volume_extras.h"

namespace strandcast {

/// Strands where a substep begins.
struct VolumeState {
  StrandBlocksView position_m;  // head-relative world axes
  StrandBlocksView
      velocity_mps;  // world; or, of a model that keeps it, every vertex's way in the last substep
  bool is_way = false;
};

class VolumeLaw {
 public:
  /// As HairVolume::make(). `target`: hair in head space whose volume is the target, as much of it as there
  /// is of the strands; nullptr = the strands at rest.
  static Result<std::unique_ptr<VolumeLaw>> make(const VolumeStrands& strands, const VolumeDesc& desc,
                                                 const VolumeOptions& options,
                                                 const VolumeStrands* target = nullptr);

  /// Elements that a table needs.
  size_t most_elements() const {
    const size_t of_target = desc_.target_per_s2 > 0.0 ? 1 : 0;
    return kHeader + (extras_ ? 2 + of_target : 1) * volume_.most_nodes();
  }
  /// Density from which on each vertex is pushed away, four vertices of a strand to an element:
  /// (vertex_count / 4 rounded up x strand_count), strand fastest.
  const std::vector<glm::vec4>& rest_density() const { return rest_density_; }
  void forget_rest_density() { rest_density_ = {}; }
  /// For a model that keeps the way of every vertex in the last substep, or does not.
  KernelDesc kernel(bool has_way) const;
  /// Fills a table with the volume of the strands after this substep. Elements after the returned ones stay
  /// unchanged.
  std::span<const glm::vec4> fill(const StepBlock& step, const VolumeState& state,
                                  std::span<glm::vec4> table);

  const HairVolume& volume() const { return volume_; }
  uint64_t size_bytes() const;

 private:
  /// In front of the nodes (shaders/sim/volume.glsl).
  static constexpr size_t kHeader = 2;

  VolumeLaw(const VolumeDesc& desc, HairVolume volume) : desc_(desc), volume_(std::move(volume)) {}
  void find_rest_density(const VolumeStrands& strands);
  Status take_target(const VolumeStrands& hair, VolumeOptions options);

  VolumeDesc desc_;
  HairVolume volume_;
  std::unique_ptr<VolumeExtras> extras_;  // where a target or a wind's shadow is wanted
  TargetDensity target_;                  // where one is wanted
  double mean_density_mpm3_ = 1.0;        // over the groom's vertices
  double hairs_per_strand_ = 1.0;         // real ones
  std::vector<glm::vec4> rest_density_;
};

}  // namespace strandcast
