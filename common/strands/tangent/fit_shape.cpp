// Weights that an anchor of the "tangent" codec is predicted with.
#include <algorithm>

#include "common/strands/least_squares.h"
#include "common/strands/tangent/shape_row.h"

namespace strandcast::tangent {
namespace {

// Places of which some are samples.
constexpr size_t kStep = 16;
constexpr uint32_t kSampled = 4;

void add_block(const ShapeRow& row, const Planes<int32_t>& target, size_t place,
               LeastSquares<kShapeFeatureCount>& fit) {
  const ShapeFeatures value = row.features(place);
  const IntLaneVectors base = row.base(place);
  for (size_t axis = 0; axis < 3; ++axis) {
    const IntLanes end = load_lanes(target[axis].data() + row.at(place));
    const Lanes wanted = to_floats(wrapping_differences(end, base.axis[axis]));
    for (uint32_t lane = 0; lane < kSampled; ++lane) {
      std::array<float, kShapeFeatureCount> sample;
      for (uint32_t k = 0; k < kShapeFeatureCount; ++k) sample[k] = value[k].axis[axis][lane];
      fit.add(sample, wanted[lane], 1.0f);
    }
  }
}

}  // namespace

ShapeWeights fit_shape(const Layout& layout, const Neighbours& beside, float quantum_m,
                       const Planes<int32_t>& target, WorkerPool& workers) {
  constexpr double kNoise = 150.0;  // steps: what edges are off by
  std::array<double, kShapeFeatureCount> noise;
  noise.fill(kNoise);
  ShapeWeights weights;
  for_each_part(encode_terms(layout, workers), kShapeClassCount, [&](uint32_t c) {
    LeastSquares<kShapeFeatureCount> fit;
    for (uint32_t v = 0; v < layout.vertex_count; ++v) {
      if (shape_class(v) != c) continue;
      const ShapeRow row(layout, beside, quantum_m, target, v);
      for (size_t place = 0; place < layout.no_neighbour(); place += kStep)
        add_block(row, target, place, fit);
    }
    fit.flush();
    weights[c] = fit.weights(kShapeWeight, noise);
  });
  return weights;
}

}  // namespace strandcast::tangent
