// Geometry of the "tangent" codec: predicted positions of vertices, and the integers that correct them.
// Both sides compute the same floats: only + - * / and square roots in a fixed order, without contraction.
// Private to common/strands/tangent. Functions touch only their own slice of the arrays, so slices of one
// frame may be processed in parallel.
//
// A prediction is the last decoded position plus a weighted sum of features (listed in row.h). It is then
// moved to the known distance from the decoded vertex before it. Two integers correct it in the plane across
// the segment; a third one, rarely needed, corrects its length. All lengths are in lattice steps.
//
// Cost of 10,000 x 16 on a turning head, one thread of a Zen 5 at 3.8 GHz, shares of CPU time by perf. Floors
// are operations and bytes counted by hand: two eight-lane multiplications and additions a cycle, four
// instructions a cycle, 32 bytes a cycle from the second-level cache.
//   encode 7.5 ms                         ms   floor  which is
//   read snapshots (take_row)            0.3   0.15  480,000 values gathered, one a cycle
//   fit of the motion                    1.8   0.6   435 sums over 36,864 samples; samples lie in many lines
//   expect, quantise, search             2.3   0.9   20,000 blocks of about 700 instructions, each waiting
//                                                    for its neighbours' block before it; 160 bytes a vertex
//   symbols and their contexts           1.0   0.6   480,000 symbols of about 20 instructions
//   rANS                                 0.7   0.7   480,000 divisions of six cycles, four chains at once
//   order and hash                       0.6   0.38  240,000 words, each waiting six cycles for the last
//   decode 4.7 ms
//   symbols, contexts, rANS              1.9   1.3   480,000 symbols of about 60 instructions, four slices
//   expect and place                     1.5   0.6   20,000 blocks of about 400 instructions; as above
//   order, check and hash                0.7   0.38  as above
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/worker_pool.h"
#include "common/simd/variants.h"
#include "common/strands/tangent/head.h"
#include "common/strands/tangent/layout.h"
#include "common/strands/value_coder.h"

namespace strandcast::tangent {

inline constexpr int32_t kStepsPerBound = 256;  // lattice steps in the announced bound
inline constexpr uint32_t kMotionFeatureCount = 28;
inline constexpr uint32_t kMotionClassCount = 16;    // of rows that share weights, at most
inline constexpr uint32_t kFewMotionClasses = 3;     // as many of them when there are fewer vertices than
inline constexpr uint32_t kManyVertices = 16'384;    // this, where more cost more than they save
inline constexpr float kMotionWeight = 1.0f / 4096;  // unit of the weights on the wire
inline constexpr float kShapeWeight = 1.0f / 1024;
inline constexpr float kDriftShare = 0.85f;         // of the drift that is left one frame later
inline constexpr float kLengthWeight = 1.0f / 16;   // unit of the length blend
inline constexpr uint8_t kMaxLengthBlend = 16;      // all of the last length
inline constexpr int32_t kEscapedLength = 1 << 20;  // in place of a length correction
inline constexpr uint32_t kEscapedFolded = fold_sign(kEscapedLength);
inline constexpr uint32_t kShapeFeatureCount = 16;
inline constexpr uint32_t kShapeClassCount = 16;  // roots; first segments; and so on; the rest

template <class T>
using Planes = std::array<std::vector<T>, 3>;  // one for each axis, (vertex_count x stride)

using MotionWeights = std::array<std::array<int16_t, kMotionFeatureCount>, kMotionClassCount>;

using FloatWeights = std::array<float, kMotionFeatureCount>;
/// Weights of one class as prediction applies them: as floats, with the head's motion multiplied in.
struct MotionClass {
  FloatWeights weights{};
  std::array<std::array<float, 4>, 3> head{};  // the steps of the head, weighted
};

/// Share of an anchor's steps that nobody sees: vertices are within 0.3 bounds.
inline constexpr float kFineShare = 0.29f;

using ShapeWeights = std::array<std::array<int16_t, kShapeFeatureCount>, kShapeClassCount>;

/// State of both sides after the frames so far.
struct History {
  float quantum_m = 0.0f;
  HeadMotion head;
  Planes<int32_t> lattice;
  Planes<float> velocity;  // since the frame before
  Planes<float> velocity_before;
  Planes<float> residual;  // decoded less predicted position
  Planes<float> residual_before;
  Planes<float> drift;      // sum of all velocities, older ones fading: where strands swing back from
  bool has_motion = false;  // any of velocities, residual_before and drift is not 0
  bool has_residual = false;

  void reset(const Layout& layout);
  /// Forgets everything except strand positions and pose, which are all that a keyframe gives a late joiner.
  void forget_motion();
  /// Forgets what a frame of steps does not know.
  void forget_all_but_residual();
  void forget_residual();
};

/// A vertex coded directly: its position less its last one (in an anchor: less its parent's), in steps of a
/// cubic lattice.
struct Escape {
  size_t at = 0;  // place in a plane
  std::array<int32_t, 3> step{};
};

/// Integers of one frame, folded to be unsigned (fold_sign).
struct Codes {
  std::vector<uint32_t> first;  // (vertex_count x stride) first coordinate across the segment
  std::vector<uint32_t> second;
  std::vector<uint32_t> length;              // correction along the segment, or kEscapedFolded
  std::vector<std::vector<Escape>> escapes;  // of each slice, in coding order

  void resize(const Layout& layout);
};

/// One frame, coded relative to a history.
///
/// An *anchor* is a frame that can also be decoded without a history: its integers count from the position
/// that the shape of the strands predicts. Decoders with the history receive the differences from the
/// integers that the motion predicts.
struct Frame {
  HeadMotion head;
  MotionWeights weights{};
  std::array<MotionClass, kMotionClassCount> motion;  // by apply_weights
  uint8_t length_blend = 0;  // of the last decoded length against the rest length, in 1/16
  Codes codes;
  ShapeWeights shape_weights{};                     // of an anchor
  float anchor_share = 1.0f;                        // of the steps of its integers
  Neighbours Layout::*beside = &Layout::neighbour;  // of an anchor
  Codes shape_codes;                                // of an anchor, for who has no history
  Planes<int32_t> lattice;
  Planes<float> velocity;
  Planes<float> residual;
  Planes<float> drift;
  // Of the row at work, each (stride).
  Planes<float> edge;                          // to the expected position, as far as whole rows tell
  std::array<Planes<float>, 2> neighbour_sum;  // what a vertex tells as a neighbour
  std::vector<float> zeros;
  std::vector<int32_t> zero_lattice;

  void resize(const Layout& layout);
  /// Prepares the weights for use; call it once `head` and `weights` are those of the frame.
  void apply_weights();
};

/// Workers for a groom. Small grooms use the calling thread only, since a part should take some tenths of a
/// millisecond.
inline WorkerPool::Terms encode_terms(const Layout& layout, WorkerPool& workers) {
  return workers.at(Priority::Encoding, layout.plane_size() >= kManyVertices ? kMaxWorkers : 1);
}
inline WorkerPool::Terms decode_terms(const Layout& layout, WorkerPool& workers) {
  constexpr size_t kManyDecoded = 40'000;
  return workers.at(Priority::Encoding, layout.plane_size() >= kManyDecoded ? kMaxWorkers : 1);
}
/// Calls work(part) once for every part below `count`, in any order.
template <class Work>
void for_each_part(const WorkerPool::Terms& terms, uint32_t count, const Work& work) {
  terms.for_ranges(count, 1, [&](size_t part, size_t) { work(static_cast<uint32_t>(part)); });
}

/// Returns the number of weight classes in a frame of this groom.
uint32_t motion_class_count(const Layout& layout);

/// Fits the weights and the length blend to `target` (planes of lattice positions) by least squares over a
/// sample of strands.
void fit_motion(simd::InstructionSet set, const Layout& layout, const History& history,
                const Planes<int32_t>& target, WorkerPool& workers, Frame& frame);

struct ShapeFit {
  const Neighbours& beside;
  bool is_fine;  // most strands are told well, and others cost what they cost
};
/// Fits the weights of the shape prediction to `target`.
ShapeWeights fit_shape(simd::InstructionSet set, const Layout& layout, const ShapeFit& how, float quantum_m,
                       const Planes<int32_t>& target, WorkerPool& workers);

/// Inputs of the work on one slice of a frame; `frame` is filled.
struct SliceWork {
  const Layout& layout;
  const History& history;
  uint32_t slice;
  Frame& frame;

  /// Where the slice is one of an anchor.
  const Neighbours& beside() const { return layout.*frame.beside; }
};
struct QuantiseWork {
  SliceWork of;
  const Planes<int32_t>& target;
};

// Kernels for every instruction set, all with the same bits (common/simd/variants.h).
/// Encoder: chooses the integers of a slice so that every vertex decodes within the bound of `target`, and
/// stores the decoded positions. For an anchor it fills both kinds of integers.
void quantise_slice(simd::InstructionSet set, const QuantiseWork& work);
void quantise_anchor(simd::InstructionSet set, const QuantiseWork& work);
/// Encodes a slice like quantise_slice(), but from the solver's step: its positions are in the history and no
/// weights are used (step_row.h).
void quantise_step(simd::InstructionSet set, const QuantiseWork& work);
/// Decoder: computes positions, velocities and residuals of a slice from its integers.
void place_slice(simd::InstructionSet set, const SliceWork& work);
void place_anchor(simd::InstructionSet set, const SliceWork& work);
void place_step(simd::InstructionSet set, const SliceWork& work);
/// Decoder: computes positions of an anchor's slice without a history.
void place_shape(simd::InstructionSet set, const SliceWork& work);

/// Makes the frame part of the history.
void remember(History& history, Frame& frame);
/// Makes a frame of quantise_step() or place_step() part of the history; only corrections count as motion.
void remember_step(History& history, Frame& frame);
/// Does so for a frame that is where the step led, which the history holds already.
void remember_exact(History& history, const Pose& world_from_head);

}  // namespace strandcast::tangent
