// What the encoder of the "tangent" codec decides: the cheapest integers that keep every vertex within the
// bound.
#include <vector>

#include "common/strands/tangent/shape_row.h"
#include "common/strands/tangent/step_row.h"

namespace strandcast::tangent {
namespace {

// What is left of the bound when positions were rounded to the lattice (sqrt(3) / 2) and to floats before.
constexpr int32_t kReach = kStepsPerBound - 3;
constexpr int32_t kFineReach = 76;

/// The cheapest integers that put vertices within reach of their targets. Cheap are those near `origin`: a
/// dead zone as wide as the bound allows.
struct Found {
  const Expected& expected;
  const IntLaneVectors& target;
  const CodeLanes& origin;
  float reach_squared = static_cast<float>(kReach * kReach);
  IntLanes is_open;  // worth trying
  IntLanes is_found;
  CodeLanes codes;
  IntLaneVectors position;

  STRANDCAST_LANES Found(const Expected& where, const IntLaneVectors& wanted, const CodeLanes& near)
      : expected(where), target(wanted), origin(near) {
    is_found = codes.first = codes.second = codes.length = IntLanes{};
    for (IntLanes& axis : position.axis) axis = IntLanes{};
  }

  /// Returns the codes to store: differences from the origin, or the values themselves in lanes that
  /// found none (escaped).
  STRANDCAST_LANES CodeLanes apart() const {
    return {is_found ? wrapping_differences(codes.first, origin.first) : codes.first,
            is_found ? wrapping_differences(codes.second, origin.second) : codes.second,
            is_found ? wrapping_differences(codes.length, origin.length) : codes.length};
  }

  /// Takes these integers for open lanes in which they reach the target.
  STRANDCAST_LANES void consider(const CodeLanes& tried) {
    const IntLaneVectors reached = expected.placed(tried);
    LaneVectors away;
    for (size_t axis = 0; axis < 3; ++axis)
      away.axis[axis] = to_floats(wrapping_differences(reached.axis[axis], target.axis[axis]));
    // Exact: squares this small are whole numbers below 2^24, and larger ones stay larger.
    const IntLanes is_taken = is_open & (dots(away, away) <= reach_squared);
    codes.first = is_taken ? tried.first : codes.first;
    codes.second = is_taken ? tried.second : codes.second;
    codes.length = is_taken ? tried.length : codes.length;
    for (size_t axis = 0; axis < 3; ++axis)
      position.axis[axis] = is_taken ? reached.axis[axis] : position.axis[axis];
    is_found |= is_taken;
    is_open &= ~is_taken;
  }
};

/// Coordinates across the segment, whole numbers around them: towards the origin, and away from it.
struct Corners {
  IntLanes low_a;
  IntLanes low_b;
  IntLanes high_a;
  IntLanes high_b;
  IntLanes is_a_farther;

  STRANDCAST_LANES Corners(const Expected::Coordinates& of, const CodeLanes& origin) {
    const IntLanes one = IntLanes{} + 1;
    const Lanes a = of.first - to_floats(origin.first);
    const Lanes b = of.second - to_floats(origin.second);
    const IntLanes whole_a = to_integers(a);
    const IntLanes whole_b = to_integers(b);
    low_a = wrapping_sums(origin.first, whole_a);
    low_b = wrapping_sums(origin.second, whole_b);
    high_a = wrapping_sums(low_a, a < 0.0f ? -one : one);
    high_b = wrapping_sums(low_b, b < 0.0f ? -one : one);
    is_a_farther = sizes_of(a - to_floats(whole_a)) > sizes_of(b - to_floats(whole_b));
  }

  /// Tries the corner of the cell nearest to the origin first, then the two beside it, then the opposite one.
  STRANDCAST_LANES void try_with(const IntLanes& correction, Found& found) const {
    found.consider({low_a, low_b, correction});
    for (uint32_t corner = 1; corner < 4 && is_any(found.is_open); ++corner) {
      const IntLanes nearer = corner == 1 ? is_a_farther : ~is_a_farther;
      const IntLanes is_high_a = corner == 3 ? IntLanes{} - 1 : nearer;
      const IntLanes is_high_b = corner == 3 ? IntLanes{} - 1 : ~nearer;
      found.consider({is_high_a ? high_a : low_a, is_high_b ? high_b : low_b, correction});
    }
  }
};

STRANDCAST_LANES void find_codes(Found& found) {
  LaneVectors edge;
  for (size_t axis = 0; axis < 3; ++axis)
    edge.axis[axis] =
        to_floats(wrapping_differences(found.target.axis[axis], found.expected.base.axis[axis]));
  const Expected::Coordinates of = found.expected.coordinates(edge);
  const Corners corners(of, found.origin);
  constexpr float kAsIs = 1.3f;  // length steps that the cell may do without a correction
  const IntLanes rounded = nearest_lanes(of.length);
  const IntLanes is_near = sizes_of(of.length - to_floats(found.origin.length)) <= kAsIs;
  found.is_open = of.is_possible;
  IntLanes length = is_near ? found.origin.length : rounded;
  for (uint32_t attempt = 0; attempt < 2 && is_any(found.is_open); ++attempt) {
    corners.try_with(length, found);
    found.is_open &= is_near & (rounded != found.origin.length);
    length = rounded;
  }
}

/// A block of which some vertices are to be escaped.
struct EscapingBlock {
  size_t at;
  BlockPositions target;
  BlockPositions from;  // where escapes count from
  BlockPositions position;
  BlockPositions codes;  // first, second and length
  int32_t step;
  int32_t is_found[kLaneCount];
};

__attribute__((noinline)) void escape_others(EscapingBlock& block, std::vector<Escape>& escapes) {
  for (uint32_t lane = 0; lane < kLaneCount; ++lane) {
    if (block.is_found[lane] != 0) continue;
    escapes.push_back(make_escape(block.at + lane, block.target.get(lane), block.from.get(lane), block.step));
    block.codes.set(lane, {0, 0, kEscapedLength});
    block.position.set(lane, escaped(escapes.back(), block.from.get(lane), block.step));
  }
}

/// Escapes the vertices of the block that begins at `at` for which nothing was found; from() is where their
/// escapes count from.
template <class From>
STRANDCAST_LANES void escape_others(Found& found, size_t at, std::vector<Escape>& escapes, From from,
                                    int32_t step = kEscapeStep) {
  if (!is_any(~found.is_found)) [[likely]]
    return;
  EscapingBlock block{at,
                      BlockPositions(found.target),
                      BlockPositions(from()),
                      BlockPositions(found.position),
                      BlockPositions({found.codes.first, found.codes.second, found.codes.length}),
                      step,
                      {}};
  store_lanes(found.is_found, block.is_found);
  escape_others(block, escapes);
  const IntLaneVectors codes = block.codes.load();
  found.codes = {codes.axis[0], codes.axis[1], codes.axis[2]};
  found.position = block.position.load();
}

STRANDCAST_LANES IntLaneVectors load_vectors(const Planes<int32_t>& planes, size_t at) {
  IntLaneVectors vectors;
  for (size_t axis = 0; axis < 3; ++axis) vectors.axis[axis] = load_lanes(planes[axis].data() + at);
  return vectors;
}

STRANDCAST_LANES void store_codes(const CodeLanes& codes, Codes& to, size_t at) {
  store_lanes(fold_lanes(codes.first), to.first.data() + at);
  store_lanes(fold_lanes(codes.second), to.second.data() + at);
  store_lanes(fold_lanes(codes.length), to.length.data() + at);
}

/// A block of a row of either kind, from where it is expected.
template <class Row>
STRANDCAST_LANES void quantise_block(const QuantiseWork& work, const Row& row, size_t place,
                                     const Expected& expected) {
  const SliceWork& of = work.of;
  const size_t at = row.at(place);
  const IntLaneVectors wanted = load_vectors(work.target, at);
  const CodeLanes origin{};
  Found found(expected, wanted, origin);
  find_codes(found);
  escape_others(found, at, of.frame.codes.escapes[of.slice],
                [&]() STRANDCAST_LANES_LAMBDA { return row.last(place); });
  store_codes(found.codes, of.frame.codes, at);
  row.store(expected, place, found.position);
}

STRANDCAST_LANES void quantise_slice_lanes(const QuantiseWork& work) {
  for_each_block(work.of, [&](const MotionRow& row, size_t place, const Expected& moved)
                              STRANDCAST_LANES_LAMBDA { quantise_block(work, row, place, moved); });
}

STRANDCAST_LANES void quantise_step_lanes(const QuantiseWork& work) {
  for_each_step_block(work.of, [&](const StepRow& row, size_t place, const Expected& expected)
                                   STRANDCAST_LANES_LAMBDA { quantise_block(work, row, place, expected); });
}

STRANDCAST_LANES void quantise_anchor_lanes(const QuantiseWork& work) {
  const SliceWork& of = work.of;
  for_each_block(of, [&](const MotionRow& row, size_t place, const Expected& moved) STRANDCAST_LANES_LAMBDA {
    const ShapeRow shape(of.layout, of.beside(), of.history.quantum_m, of.frame.lattice, row.vertex());
    Expected expected = shape.expect(place, of.frame.shape_weights);
    expected.refine(of.frame.anchor_share);
    const size_t at = row.at(place);
    const IntLaneVectors wanted = load_vectors(work.target, at);
    const CodeLanes origin = expected.codes_of(moved);
    Found found(expected, wanted, origin);
    if (of.frame.anchor_share < 1.0f) found.reach_squared = static_cast<float>(kFineReach * kFineReach);
    find_codes(found);
    escape_others(
        found, at, of.frame.shape_codes.escapes[of.slice],
        [&]() STRANDCAST_LANES_LAMBDA { return expected.base; }, escape_step(of.frame.anchor_share));
    store_codes(found.codes, of.frame.shape_codes, at);
    store_codes(found.apart(), of.frame.codes, at);
    row.store(moved, place, found.position);
  });
  of.frame.codes.escapes[of.slice] = of.frame.shape_codes.escapes[of.slice];
}

}  // namespace

STRANDCAST_KERNEL(quantise_slice, QuantiseWork);
STRANDCAST_KERNEL(quantise_anchor, QuantiseWork);
STRANDCAST_KERNEL(quantise_step, QuantiseWork);

}  // namespace strandcast::tangent
