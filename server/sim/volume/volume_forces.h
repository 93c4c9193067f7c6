// VolumeForces: the pass that makes strands feel each other, before each substep of whatever model's kernel:
// friction and repulsion over the volume that they fill (common/kernels/volume/volume_law.h). From the thread
// of its executor.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/kernels/volume/volume_law.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver.h"
#include "server/sim/strand_state.h"

namespace strandcast {

class VolumeForces {
 public:
  /// As VolumeLaw::make(), Executor::make_volume() and Executor::make_program(). `way`: the model's plane of
  /// how every vertex moved in the last substep, where its stored velocities are not that; may be null.
  /// `target`: hair in head space whose volume is the target; nullptr = the strands' own groom.
  static Result<std::unique_ptr<VolumeForces>> make(Executor& executor, const SceneFeatures& features,
                                                    const StrandLayout& layout, const VolumeDesc& volume,
                                                    const StrandPlane* way, const Groom* target = nullptr);

  /// The volume of the strands as they will be after this substep; the ones until the next call go by it.
  void gather(const StepInput& input, StrandState& strands, const StrandPlane* way);
  /// Before a substep's kernel: changes velocities.
  void apply(const StepBlock& step, StrandState& strands, StrandPlane* way);
  /// Strands were put somewhere else: the volume is too old.
  void forget() { next_in_ = 0; }

  /// What the volume is made by: a name of kVolumeScatters but "auto".
  const std::string& scatter() const { return scatter_; }
  uint64_t size_bytes() const;

 private:
  VolumeForces() = default;

  Status choose_scatter(Executor& executor, const StrandLayout& layout, const VolumeDesc& desc, bool has_way);

  std::unique_ptr<VolumeLaw> law_;
  std::string scatter_ = "host";
  std::unique_ptr<DeviceVolume> device_volume_;  // nullptr: the host makes it
  uint32_t interval_ = 1;
  uint32_t next_in_ = 0;  // steps until the volume is too old
  std::unique_ptr<LookupTable> table_;
  std::vector<glm::vec4> elements_;            // where the table's own memory is elsewhere
  std::unique_ptr<StrandPlane> rest_density_;  // (vertex_count / 4 rounded up x strand_count)
  std::unique_ptr<KernelProgram> program_;
  // Planes of executors that do not keep them in blocks.
  StrandBlocks position_blocks_;
  StrandBlocks velocity_blocks_;
  std::vector<glm::vec4> staging_;
};

}  // namespace strandcast
