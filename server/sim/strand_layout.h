// StrandLayout: a groom in the order of the strand kernels, vertex-major with the strand index fastest. Plain
// data, any thread; no GL.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/kernels/step_input.h"
#include "common/kernels/strand_passes.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Layout of a groom. The element of vertex `vertex_index` of strand `strand_index` is vertex_index *
/// strand_count + strand_index.
struct StrandLayout {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;       // per strand
  uint32_t pinned_root_count = 0;  // leading vertices that follow the head, at least 1
  uint32_t pinned_tail_count = 0;  // trailing ones, 0 when all tips are free
  std::vector<uint8_t>
      has_tail;  // (strand_count) 1 = those are pinned, 0 = its tip is free; empty: all alike
  std::vector<glm::vec4>
      rest;                // (vertex_count x strand_count) head space, m; w = length of the segment before it
  std::vector<float> arc;  // (vertex_count x strand_count) rest arc length from the root over the total, 0..1
  std::vector<float> length_m;  // (strand_count) rest arc length

  size_t size() const { return rest.size(); }
  size_t index(uint32_t vertex_index, uint32_t strand_index) const {
    return static_cast<size_t>(vertex_index) * strand_count + strand_index;
  }
  /// First vertex of pinned tails; vertex_count if all tips are free.
  uint32_t tail_begin() const { return vertex_count - pinned_tail_count; }
  StrandCounts counts() const { return {strand_count, vertex_count, pinned_root_count, tail_begin()}; }
  StrandCounts counts(Tips tips) const {
    return {strand_count, vertex_count, pinned_root_count, tips == Tips::Free ? vertex_count : tail_begin()};
  }
  bool is_mixed() const { return !has_tail.empty(); }
  /// Returns whether any strand's tip is free.
  bool has_free_tips() const { return is_mixed() || pinned_tail_count == 0; }
  /// Trailing vertices that this strand pins.
  uint32_t tail_count(uint32_t strand_index) const {
    return is_mixed() && has_tail[strand_index] == 0 ? 0 : pinned_tail_count;
  }
};

/// Largest number of vertices per strand of a reference solution without a kernel, as reports use for
/// converged solutions.
inline constexpr uint32_t kMaxReferenceVertexCount = 256;

/// Makes the layout. BadInput unless all strands have the same vertex count (2..most_vertices) and pin as
/// many vertices at the root, those that pin any at the tip as many there, and none between.
Result<StrandLayout> make_strand_layout(const Groom& groom, uint32_t most_vertices = kMaxVertexCount);

}  // namespace strandcast
