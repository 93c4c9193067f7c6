// Alternative methods to sum strands into a volume, for the comparison of strandcast-report volume. They are
// those of Woodhouse 2017 (4.2.4): points drawn into the layers of a texture, and nodes that search their
// neighbours in bins. They work on a given grid with samples that are already on the device. Needs a GL
// context.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/gl/device_limits.h"
#include "common/gl/program.h"
#include "common/kernels/volume/volume_grid.h"
#include "common/kernels/volume/volume_scatter.h"

namespace strandcast {

/// Names of the methods. "raster": additive blending, Woodhouse's choice. "counting": bins are cells, samples
/// are sorted by counting. "hashing": fixed-size bins of samples on the same sides of random planes.
inline constexpr std::string_view kStudiedScatters[] = {"raster", "counting", "hashing"};

class GlScatterStudy {
 public:
  virtual ~GlScatterStudy() = default;
  /// Computes the nodes from the samples.
  virtual void run() = 0;
  /// Waits until the device has finished.
  static void wait();
  /// Returns mean velocity (m/s) and density (m/m^3) of the nodes, (grid.size()) values.
  std::vector<glm::vec4> read_nodes() const { return nodes_.read_all<glm::vec4>(); }
  /// Returns the number of samples that were left out.
  virtual uint64_t lost_count() const { return 0; }

 protected:
  explicit GlScatterStudy(const VolumeGrid& grid)
      : grid_(grid), nodes_("study nodes", grid.size() * sizeof(glm::vec4)) {}

  const VolumeGrid grid_;
  gl::Buffer nodes_;
};

/// Makes one of kStudiedScatters. All samples must lie inside the grid, so that their base nodes have
/// neighbours. LimitExceeded if the device has too little memory.
Result<std::unique_ptr<GlScatterStudy>> make_gl_scatter_study(const gl::ShaderLibrary& shaders,
                                                              const gl::DeviceLimits& limits,
                                                              std::string_view name, const VolumeGrid& grid,
                                                              std::span<const VolumeRecord> samples);

}  // namespace strandcast
