// The ways to get strands into a volume that document 003 tried (4.2.4), for strandcast-report volume, which
// holds them against those in use: points drawn into the layers of a texture, and nodes that look for their
// neighbours in bins. On a given grid, from samples that are on the device already. Needs a GL context.
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

/// "raster": additive blending, 003's choice. "counting": bins are cells, samples sorted by counting.
/// "hashing": bins are what lies on the same sides of random planes, of a fixed size.
inline constexpr std::string_view kStudiedScatters[] = {"raster", "counting", "hashing"};

class GlScatterStudy {
 public:
  virtual ~GlScatterStudy() = default;
  /// From samples to nodes.
  virtual void run() = 0;
  /// Until that is done.
  static void wait();
  /// (grid.size()) mean velocity, m/s, and density, m/m^3.
  std::vector<glm::vec4> read_nodes() const { return nodes_.read_all<glm::vec4>(); }
  /// Samples that were left out.
  virtual uint64_t lost_count() const { return 0; }

 protected:
  explicit GlScatterStudy(const VolumeGrid& grid)
      : grid_(grid), nodes_("study nodes", grid.size() * sizeof(glm::vec4)) {}

  const VolumeGrid grid_;
  gl::Buffer nodes_;
};

/// One of kStudiedScatters. Samples lie in the grid: their base nodes have neighbours. LimitExceeded where
/// the device has no room for them.
Result<std::unique_ptr<GlScatterStudy>> make_gl_scatter_study(const gl::ShaderLibrary& shaders,
                                                              const gl::DeviceLimits& limits,
                                                              std::string_view name, const VolumeGrid& grid,
                                                              std::span<const VolumeRecord> samples);

}  // namespace strandcast
