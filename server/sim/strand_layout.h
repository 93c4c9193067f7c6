// StrandLayout: a groom in the order the strand kernels use, vertex-major with the strand index fastest, and
// the limits every solver puts on its inputs. Plain data, any thread; no GL.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Element of vertex `vertex_index` of strand `strand_index`: vertex_index * strand_count + strand_index.
struct StrandLayout {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;       // per strand
  uint32_t pinned_root_count = 0;  // leading vertices that follow the head, at least 1
  uint32_t pinned_tail_count = 0;  // trailing ones, 0 when the tip is free
  std::vector<glm::vec4>
      rest;                // (vertex_count x strand_count) head space, m; w = length of the segment before it
  std::vector<float> arc;  // (vertex_count x strand_count) rest arc length from the root over the total, 0..1
  std::vector<float> length_m;  // (strand_count) rest arc length

  size_t size() const { return rest.size(); }
  size_t index(uint32_t vertex_index, uint32_t strand_index) const {
    return static_cast<size_t>(vertex_index) * strand_count + strand_index;
  }
  /// First vertex of the pinned tail, vertex_count when the tip is free.
  uint32_t tail_begin() const { return vertex_count - pinned_tail_count; }
};

/// Vertices per strand of a reference that no kernel has to follow: converged solutions of reports.
inline constexpr uint32_t kMaxReferenceVertexCount = 256;

/// Whether roots are held in this substep; no number, and no angle, is no limit.
inline bool has_follicle_limit(const StepInput& input) {
  return input.follicle_limit_rad >= 0.0 && input.follicle_limit_rad < kFreeFollicleRad;
}

/// BadInput unless all strands have the same vertex count (2..most_vertices) and the same pinned vertices: a
/// run at the root, optionally a run at the tip, nothing between.
Result<StrandLayout> make_strand_layout(const Groom& groom, uint32_t most_vertices = kMaxVertexCount);

// Bounds on what a step may ask for. Far outside anything physical; they keep squares of floats finite.
inline constexpr double kMaxSubstepS = 0.1;
inline constexpr double kMinSubstepS = 1e-6;
inline constexpr double kMaxHeadShiftM = 1e4;
inline constexpr double kMaxGravityMps2 = 1e5;
inline constexpr double kMaxWindMps = 1e4;
inline constexpr double kMaxColliderM = 1e4;  // |centre| and radius
inline constexpr double kMaxPhaseRad = 1e6;   // phases and wave numbers of gusts

/// The value within [-bound, bound]; 0 for NaN.
inline double limited(double value, double bound) {
  if (std::isnan(value)) return 0.0;
  return std::fmin(std::fmax(value, -bound), bound);
}
inline glm::dvec3 limited(const glm::dvec3& value, double bound) {
  return {limited(value.x, bound), limited(value.y, bound), limited(value.z, bound)};
}

/// The input's substep within its bounds; kMinSubstepS for NaN and non-positive values.
double limited_substep_s(const StepInput& input);

/// Unit quaternion; the identity for a zero or non-finite one.
glm::dquat limited_rotation(const glm::dquat& rotation);

}  // namespace strandcast
