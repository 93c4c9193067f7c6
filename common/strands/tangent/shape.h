// ShapeRow: where the vertices of one row are expected from the shape of the strands alone, four strands at a
// time: from the edges nearer to the root, the neighbours and the rest shape, without any frame before. What
// keyframes of the "tangent" codec are predicted by. Private to common/strands/tangent.
#pragma once

#include "common/strands/tangent/row.h"

namespace strandcast::tangent {

// Features of a vertex, each a vector: an edge (for a root its position, which tells nothing to others) or
// what follows from edges. A bend is an edge less what it would be had it turned from its rest edge like its
// parent; an edge x *turned* by another one is x after the smallest rotation that takes that one's rest edge
// to its direction.
//   0 rest             1 parent            2 grandparent      3 parent's rest
//   4 neighbour        5 its parent        6 its rest         7 to 9 second neighbour likewise
//  10 rest turned by the parent           11 by the neighbour                 12 by the second neighbour
//  13 parent's bend                       14 neighbour's bend                 15 second neighbour's bend
using ShapeFeatures = std::array<LaneVectors, kShapeFeatureCount>;

/// Which weights serve a row.
inline uint32_t shape_class(uint32_t v) {
  return std::min(v, kShapeClassCount - 1);
}

class ShapeRow {
 public:
  /// `position` is known for earlier rows and for earlier blocks of this one.
  ShapeRow(const Layout& layout, float quantum_m, const Planes<int32_t>& position, uint32_t v)
      : layout_(layout), quantum_m_(quantum_m), position_(position), v_(v) {}

  ShapeFeatures features(size_t place) const;
  Expected expect(size_t place, const ShapeWeights& weights) const;
  size_t at(size_t place) const { return v_ * static_cast<size_t>(layout_.stride) + place; }
  /// Of the vertices before, or the origin.
  IntLaneVectors base(size_t place) const;

 private:
  const Layout& layout_;
  float quantum_m_;
  const Planes<int32_t>& position_;
  uint32_t v_;
};

}  // namespace strandcast::tangent
