// VolumeForces: the pass that makes strands feel each other, before each substep of whatever model's kernel:
// friction and repulsion over the volume that they fill (shaders/sim/volume_forces.comp). From the thread of
// its executor.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/scene/scene_desc.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver.h"
#include "server/sim/strand_state.h"
#include "server/sim/volume/volume_extras.h"

namespace strandcast {

class VolumeForces {
 public:
  /// As HairVolume::make() and Executor::make_program(). `way`: the model's plane of how every vertex moved
  /// in the last substep, where its stored velocities are not that; may be null.
  static Result<std::unique_ptr<VolumeForces>> make(Executor& executor, const SceneFeatures& features,
                                                    const StrandLayout& layout, const VolumeDesc& volume,
                                                    const StrandPlane* way);

  /// The volume of the strands as they will be after this substep; the ones until the next call go by it.
  void gather(const StepInput& input, StrandState& strands, const StrandPlane* way);
  /// Before a substep's kernel: changes velocities.
  void apply(const StepBlock& step, StrandState& strands, StrandPlane* way);

  /// Strands were put somewhere else: the volume is too old.
  void forget() { next_in_ = 0; }

  const HairVolume& volume() const { return volume_; }
  uint64_t size_bytes() const;

 private:
  VolumeForces(const VolumeDesc& desc, HairVolume volume) : desc_(desc), volume_(std::move(volume)) {}
  bool is_implicit() const { return desc_.integration == "implicit"; }
  void find_rest_density(Executor& executor, const StrandLayout& layout);
  std::span<glm::vec4> table_memory();
  /// Density and velocity, behind the header.
  std::span<const glm::vec4> fill_nodes(const VolumeInput& input);
  void fill_extras(const VolumeInput& input, const glm::vec3& wind_mps);

  VolumeDesc desc_;
  HairVolume volume_;
  std::unique_ptr<VolumeExtras> extras_;  // where the scene wants a target or a wind's shadow
  TargetDensity target_;                  // of the groom
  double mean_density_mpm3_ = 1.0;        // over the groom's vertices
  uint32_t next_in_ = 0;                  // steps until the volume is too old
  std::unique_ptr<LookupTable> table_;
  std::vector<glm::vec4> nodes_;               // where the table's own memory is elsewhere
  std::unique_ptr<StrandPlane> rest_density_;  // (vertex_count / 4 rounded up x strand_count)
  std::unique_ptr<KernelProgram> program_;
  // Planes of executors that do not keep them in blocks.
  StrandBlocks position_blocks_;
  StrandBlocks velocity_blocks_;
  std::vector<glm::vec4> staging_;
};

}  // namespace strandcast
