// Weights that an anchor of the "tangent" codec is predicted with.
#include <algorithm>

#include "common/strands/least_squares.h"
#include "common/strands/tangent/shape_row.h"

namespace strandcast::tangent {
namespace {

// Places of which some are samples.
constexpr size_t kStep = 16;
constexpr uint32_t kSampled = 4;

struct ShapeFitWork {
  const Layout& layout;
  const ShapeFit& how;
  float quantum_m;
  const Planes<int32_t>& target;
  uint32_t shape_class;
  size_t step;                                             // places from sample to sample
  const std::array<int16_t, kShapeFeatureCount>* weights;  // of an earlier fit; null: all samples count alike
  LeastSquares<kShapeFeatureCount>& fit;
};

/// Of a sample that an earlier fit tells badly, less: strands that lie unlike others must not decide.
STRANDCAST_LANES Lanes trust_in(const ShapeFeatures& value, const LaneVectors& wanted,
                                const std::array<int16_t, kShapeFeatureCount>& weights) {
  constexpr float kNear = 100.0f;  // steps, of the lattice: about one of a fine anchor
  LaneVectors away = wanted;
  for (uint32_t k = 0; k < kShapeFeatureCount; ++k)
    for (size_t axis = 0; axis < 3; ++axis)
      away.axis[axis] -= static_cast<float>(weights[k]) * kShapeWeight * value[k].axis[axis];
  const Lanes along = dots(away, wanted);
  const Lanes length_squared = dots(wanted, wanted);
  const IntLanes has = length_squared > 1.0f;
  const Lanes across_squared = dots(away, away) - along * along / (has ? length_squared : Lanes{} + 1.0f);
  const Lanes squared = across_squared > 0.0f ? across_squared : Lanes{};
  return 1.0f / square_roots(1.0f + squared / (2.0f * kNear * kNear));
}

STRANDCAST_LANES void add_shapes_lanes(const ShapeFitWork& of) {
  for (uint32_t v = 0; v < of.layout.vertex_count; ++v) {
    if (shape_class(v) != of.shape_class) continue;
    const ShapeRow row(of.layout, of.how.beside, of.quantum_m, of.target, v);
    for (size_t place = 0; place < of.layout.no_neighbour(); place += of.step) {
      const ShapeFeatures value = row.features(place);
      const IntLaneVectors base = row.base(place);
      LaneVectors wanted;
      for (size_t axis = 0; axis < 3; ++axis) {
        const IntLanes end = load_lanes(of.target[axis].data() + row.at(place));
        wanted.axis[axis] = to_floats(wrapping_differences(end, base.axis[axis]));
      }
      const Lanes trust = of.weights == nullptr ? Lanes{} + 1.0f : trust_in(value, wanted, *of.weights);
      for (size_t axis = 0; axis < 3; ++axis)
        for (uint32_t lane = 0; lane < kSampled; ++lane) {
          std::array<float, kShapeFeatureCount> sample;
          for (uint32_t k = 0; k < kShapeFeatureCount; ++k) sample[k] = value[k].axis[axis][lane];
          of.fit.add(sample, wanted.axis[axis][lane], trust[lane]);
        }
    }
  }
  of.fit.flush();
}
STRANDCAST_KERNEL(add_shapes, ShapeFitWork);

/// Of a fit that only says which samples are to be trusted, when there are many.
size_t rough_step(const Layout& layout) {
  constexpr size_t kFewPlaces = 2560;
  return kStep * std::max<size_t>(1, layout.no_neighbour() / kFewPlaces);
}

}  // namespace

ShapeWeights fit_shape(simd::InstructionSet set, const Layout& layout, const ShapeFit& how, float quantum_m,
                       const Planes<int32_t>& target, WorkerPool& workers) {
  constexpr double kNoise = 150.0;  // steps: what edges are off by
  constexpr double kFineNoise = 40.0;
  std::array<double, kShapeFeatureCount> noise;
  noise.fill(how.is_fine ? kFineNoise : kNoise);
  ShapeWeights weights;
  for_each_part(encode_terms(layout, workers), kShapeClassCount, [&](uint32_t c) {
    LeastSquares<kShapeFeatureCount> rough;
    add_shapes(set,
               {layout, how, quantum_m, target, c, how.is_fine ? rough_step(layout) : kStep, nullptr, rough});
    weights[c] = rough.weights(kShapeWeight, noise);
    if (!how.is_fine) return;
    LeastSquares<kShapeFeatureCount> fit;
    add_shapes(set, {layout, how, quantum_m, target, c, kStep, &weights[c], fit});
    weights[c] = fit.weights(kShapeWeight, noise);
  });
  return weights;
}

}  // namespace strandcast::tangent
