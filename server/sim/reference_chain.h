// ReferenceChain: common part of the double-precision references of chains of rigid segments. Frames are
// quaternions that map x to the first axis across a segment and z to its direction.
#pragma once

#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "server/sim/chain_parameters.h"
#include "server/sim/directions.h"
#include "server/sim/reference_strands.h"

namespace strandcast {

/// Returns the frame rotated by the smallest rotation to another direction.
glm::dquat carried_frame(const glm::dquat& frame, const glm::dvec3& along);

/// Moment, divided by the stiffness, that bends `to` back to `from`: their angle about the axis between them,
/// which decreases again beyond a right angle.
glm::dvec3 bend_between(const glm::dvec3& from, const glm::dvec3& to);

/// One segment during one substep. Everything is divided by the mass per length, so masses are lengths.
struct ChainSegment {
  double length_m = 0.0;                     // as it is
  double lever_m = 0.0;                      // as it counts in the matrix
  double mass_m = 0.0;                       // of the vertex at its end, with drag and pull
  glm::dvec3 aim_m{0.0};                     // of that vertex
  glm::dquat rest_turn{1.0, 0.0, 0.0, 0.0};  // rest frame, seen from the frame before
  glm::dquat frame{1.0, 0.0, 0.0, 0.0};      // now
  glm::dvec3 turn{0.0};                      // during the substep
  glm::dvec3 along() const { return frame * glm::dvec3(0.0, 0.0, 1.0); }
};

struct ReferenceChainState {
  glm::dvec3 root_m{0.0};
  glm::dquat clamp{1.0, 0.0, 0.0, 0.0};
  glm::dvec3 clamp_turn{0.0};
  std::vector<ChainSegment> segment;
};

class ReferenceChain : public ReferenceStrands {
 protected:
  ReferenceChain(const StrandParameters& shared, const ChainParameters& parameters)
      : ReferenceStrands(shared), parameters_(parameters) {}

  /// Rotates all segments once; returns false if a result is not finite.
  virtual bool turn_segments(ReferenceChainState& chain) const = 0;

  /// Returns the stiffness of the joint before segment i, as moment per angle; `tension` stretches the
  /// segment.
  double bend_stiffness(const ReferenceChainState& chain, size_t i, double tension_m2ps2) const;
  /// Rotates a segment by a rotation vector, within the limit per round.
  static void turn(ChainSegment& segment, const glm::dvec3& rotation);
  const ChainParameters& parameters() const { return parameters_; }

 private:
  /// Spin of every segment relative to its frame that is transported without twist.
  size_t memory_size() const final { return layout().vertex_count; }
  void solve(ReferenceStrand& strand) const final;
  glm::dvec3 rest_m(const ReferenceStrand& strand, uint32_t i) const;
  ReferenceChainState begin(const ReferenceStrand& strand) const;
  void finish(const ReferenceChainState& chain, bool is_sound, ReferenceStrand& strand) const;

  ChainParameters parameters_;
};

}  // namespace strandcast
