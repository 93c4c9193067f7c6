// BendExpander: adaptive tessellation. Each gap between vertices gets as many segments as keep the chords
// within a fraction of a pixel of the curve. The GPU counts the segments, sums the counts and writes the
// segments in strand order; only the total is read back. All calls from the context's thread.
#pragma once

#include <cstdint>

#include "common/gl/objects.h"
#include "common/gl/program.h"
#include "common/render/detail/running_sum.h"
#include "common/render/passes/strand_buffers.h"
#include "common/render/passes/strand_curves.h"
#include "common/render/view.h"

namespace strandcast {

class BendExpander {
 public:
  BendExpander() = default;
  /// Makes an expander; `max_gaps` counts all strands that are expanded at once.
  static Result<BendExpander> make(const gl::ShaderLibrary& shaders, StrandCurves curves, uint64_t max_gaps);
  /// Does what StrandExpander::run() does, for this view; `level` limits the segments of a gap.
  uint32_t run(const KeyStrands& keys, const ExpandedStrands& expanded, uint32_t first, uint32_t count,
               const ExpandLevel& level, const View& view) const;
  static uint64_t size_bytes(uint64_t max_gaps) { return RunningSum::size_bytes(max_gaps); }

 private:
  StrandCurves curves_;
  RunningSum sum_;
  gl::Program count_program_;
  gl::Program write_program_;
};

}  // namespace strandcast
