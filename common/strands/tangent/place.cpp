// What the decoder of the "tangent" codec does with the integers of a slice: positions and what follows from
// them.
#include <vector>

#include "common/strands/tangent/shape_row.h"
#include "common/strands/tangent/step_row.h"

namespace strandcast::tangent {
namespace {

STRANDCAST_LANES CodeLanes load_codes(const Codes& codes, size_t at) {
  return {unfold_lanes(load_lanes(codes.first.data() + at)),
          unfold_lanes(load_lanes(codes.second.data() + at)),
          unfold_lanes(load_lanes(codes.length.data() + at))};
}

/// Goes through the escapes of a slice with its blocks.
class EscapeWalk {
 public:
  explicit EscapeWalk(const std::vector<Escape>& escapes, int32_t step = kEscapeStep)
      : next_(escapes.data()), end_(escapes.data() + escapes.size()), step_(step) {}

  /// Puts the escaped vertices of the block that begins at `at` where they belong; from() is where their
  /// escapes count from.
  template <class From>
  STRANDCAST_LANES void place(size_t at, IntLaneVectors& position, From from) {
    if (next_ == end_ || next_->at >= at + kLaneCount) [[likely]]
      return;
    BlockPositions points(position);
    const BlockPositions begin(from());
    for (; next_ != end_ && next_->at < at + kLaneCount; ++next_) {
      const size_t lane = next_->at - at;
      points.set(lane, escaped(*next_, begin.get(lane), step_));
    }
    position = points.load();
  }

 private:
  const Escape* next_;
  const Escape* end_;
  const int32_t step_;
};

STRANDCAST_LANES void place_slice_lanes(const SliceWork& of) {
  EscapeWalk escapes(of.frame.codes.escapes[of.slice]);
  for_each_block(of, [&](const MotionRow& row, size_t place, const Expected& moved) STRANDCAST_LANES_LAMBDA {
    const size_t at = row.at(place);
    IntLaneVectors position = moved.placed(load_codes(of.frame.codes, at));
    escapes.place(at, position, [&]() STRANDCAST_LANES_LAMBDA { return row.last(place); });
    row.store(moved, place, position);
  });
}

STRANDCAST_LANES void place_step_lanes(const SliceWork& of) {
  EscapeWalk escapes(of.frame.codes.escapes[of.slice]);
  for_each_step_block(
      of, [&](const StepRow& row, size_t place, const Expected& expected) STRANDCAST_LANES_LAMBDA {
        const size_t at = row.at(place);
        IntLaneVectors position = expected.placed(load_codes(of.frame.codes, at));
        escapes.place(at, position, [&]() STRANDCAST_LANES_LAMBDA { return row.last(place); });
        row.store(expected, place, position);
      });
}

STRANDCAST_LANES void place_anchor_lanes(const SliceWork& of) {
  EscapeWalk escapes(of.frame.codes.escapes[of.slice], escape_step(of.frame.anchor_share));
  for_each_block(of, [&](const MotionRow& row, size_t place, const Expected& moved) STRANDCAST_LANES_LAMBDA {
    const ShapeRow shape(of.layout, of.beside(), of.history.quantum_m, of.frame.lattice, row.vertex());
    Expected expected = shape.expect(place, of.frame.shape_weights);
    expected.refine(of.frame.anchor_share);
    const size_t at = row.at(place);
    IntLaneVectors position =
        expected.placed(sum_of(expected.codes_of(moved), load_codes(of.frame.codes, at)));
    escapes.place(at, position, [&]() STRANDCAST_LANES_LAMBDA { return expected.base; });
    row.store(moved, place, position);
  });
}

STRANDCAST_LANES void place_shape_lanes(const SliceWork& of) {
  EscapeWalk escapes(of.frame.shape_codes.escapes[of.slice], escape_step(of.frame.anchor_share));
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    const ShapeRow shape(of.layout, of.beside(), of.history.quantum_m, of.frame.lattice, v);
    for (size_t place = of.layout.slice_begin[of.slice]; place < of.layout.slice_begin[of.slice + 1];
         place += kLaneCount) {
      Expected expected = shape.expect(place, of.frame.shape_weights);
      expected.refine(of.frame.anchor_share);
      const size_t at = shape.at(place);
      IntLaneVectors position = expected.placed(load_codes(of.frame.shape_codes, at));
      escapes.place(at, position, [&]() STRANDCAST_LANES_LAMBDA { return expected.base; });
      for (size_t axis = 0; axis < 3; ++axis)
        store_lanes(position.axis[axis], of.frame.lattice[axis].data() + at);
    }
  }
}

}  // namespace

STRANDCAST_KERNEL(place_slice, SliceWork);
STRANDCAST_KERNEL(place_anchor, SliceWork);
STRANDCAST_KERNEL(place_step, SliceWork);
STRANDCAST_KERNEL(place_shape, SliceWork);

}  // namespace strandcast::tangent
