// StepRow: predicts the vertices of one row from a solver step, whose positions the history holds. A
// prediction adds a share of the preceding vertex's error. Unlike MotionRow it uses no neighbours and no
// fitted weights, so blocks do not wait for each other. Private to common/strands/tangent.
//
// Cost of a vertex: 90 floating-point operations, two divisions and two roots; 76 bytes from and to memory.
#pragma once

#include "common/strands/tangent/row.h"

namespace strandcast::tangent {

/// Shares of the parent vertex's error and of the last frame's correction. These values gave the fewest bytes
/// on the built-in motions with a chain and with a rod; the optimum is flat.
inline constexpr float kParentShare = 0.73f;
inline constexpr float kCorrectedShare = -0.25f;

class StepRow {
 public:
  StepRow(const Layout& layout, const History& history, Frame& frame, uint32_t v)
      : vertex_(v), stride_(layout.stride), begin_(v * static_cast<size_t>(layout.stride)) {
    for (size_t axis = 0; axis < 3; ++axis) {
      expected_[axis] = history.lattice[axis].data() + begin_;
      corrected_[axis] = history.residual[axis].data() + begin_;
      now_[axis] = frame.lattice[axis].data() + begin_;
      base_[axis] = v == 0 ? frame.zero_lattice.data() : now_[axis] - stride_;
      residual_[axis] = frame.residual[axis].data() + begin_;
    }
  }

  size_t at(size_t place) const { return begin_ + place; }

  STRANDCAST_LANES void expect(size_t place, Expected& to) const {
    LaneVectors edge;
    LaneVectors step_edge{};
    for (size_t axis = 0; axis < 3; ++axis) {
      const IntLanes expected = load_lanes(expected_[axis] + place);
      to.base.axis[axis] = load_lanes(base_[axis] + place);
      edge.axis[axis] = to_floats(wrapping_differences(expected, to.base.axis[axis])) +
                        kCorrectedShare * load_lanes(corrected_[axis] + place);
      if (vertex_ == 0) continue;
      const IntLanes parent = load_lanes(expected_[axis] + place - stride_);
      edge.axis[axis] += kParentShare * to_floats(wrapping_differences(to.base.axis[axis], parent));
      step_edge.axis[axis] = to_floats(wrapping_differences(expected, parent));
    }
    to.aim(edge);
    if (vertex_ != 0) to.length = square_roots(dots(step_edge, step_edge));
  }

  STRANDCAST_LANES void store(const Expected& expected, size_t place, const IntLaneVectors& position) const {
    for (size_t axis = 0; axis < 3; ++axis) {
      const IntLanes now = position.axis[axis];
      const Lanes edge = to_floats(wrapping_differences(now, expected.base.axis[axis]));
      store_lanes(now, now_[axis] + place);
      store_lanes(edge - expected.along.axis[axis] * expected.length, residual_[axis] + place);
    }
  }

  /// Returns the positions that escapes count from.
  STRANDCAST_LANES IntLaneVectors last(size_t place) const {
    return {load_lanes(expected_[0] + place), load_lanes(expected_[1] + place),
            load_lanes(expected_[2] + place)};
  }

 private:
  uint32_t vertex_;
  size_t stride_;
  size_t begin_;
  std::array<const int32_t*, 3> expected_;
  std::array<const int32_t*, 3> base_;
  std::array<const float*, 3> corrected_;
  std::array<int32_t*, 3> now_;
  std::array<float*, 3> residual_;
};

/// Visits a slice like for_each_block() of row.h.
template <class Work>
STRANDCAST_LANES void for_each_step_block(const SliceWork& of, Work work) {
  const size_t begin = of.layout.slice_begin[of.slice];
  const size_t end = of.layout.slice_begin[of.slice + 1];
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    const StepRow row(of.layout, of.history, of.frame, v);
    for (size_t place = begin; place < end; place += kLaneCount) {
      Expected expected;
      row.expect(place, expected);
      work(row, place, expected);
    }
  }
}

}  // namespace strandcast::tangent
