// GpuBins: sorts segments into the tiles of a picture on the GPU, each tile's from front to back. All calls
// from the context's thread; the frame's uniform block must be bound.
#pragma once

#include "common/gl/pass_plan.h"
#include "common/gl/program.h"
#include "common/render/gl_tiles/grown_buffer.h"

namespace strandcast {

/// Largest number of (segment, tile) pairs in one picture on the GPU; beyond it fewer strands are drawn.
inline constexpr uint64_t kMaxGpuTilePairs = uint64_t{1} << 23;

/// Counts of the last picture.
struct GpuBinCounts {
  uint64_t pairs = 0;
  uint64_t segments = 0;    // on the picture
  uint64_t not_finite = 0;  // segments with a position that is no number
};

class GpuBins final : public gl::Resource {
 public:
  GpuBins();
  Status prepare(const gl::ShaderLibrary& shaders);
  /// Counts the (segment, tile) pairs of the points bound to kUnitTilePoints. Waits for the GPU.
  GpuBinCounts count(glm::uvec2 tiles, uint64_t segments);
  /// Fills and sorts the lists whose pairs count() has counted.
  void fill(glm::uvec2 tiles, uint64_t segments, uint64_t pairs);
  /// Binds the lists to the units kUnitTileOrder and kUnitTileFirst.
  void bind() const;
  uint64_t size_bytes() const override;

 private:
  gl::Program count_, fill_, offsets_, order_, merge_;
  GrownBuffer counts_{"tile counts"};
  GrownBuffer first_;
  GrownBuffer totals_{"tile totals"};
  GrownBuffer pairs_;
  GrownBuffer grouped_{"tile pairs by depth"};
  GrownBuffer full_{"full tiles"};
};

}  // namespace strandcast
