// RodRest: the rest shape of one strand in the terms of the rod, computed once in double when a groom is
// loaded; the numbers that both versions of the solver share. Plain data, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "server/sim/solvers/direct_rod/direct_rod.h"
#include "server/sim/strand_layout.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {

/// Head space. Entry i of a vector belongs to the edge that ends at vertex i; what a frame is given by: its
/// tangent and one axis at right angles to it.
struct RodRest {
  glm::dvec3 clamp_direction{0.0};  // rest direction of the first free edge, fixed in the head
  glm::dvec3 clamp_axis{0.0};
  glm::dvec3 tail_direction{
      0.0};  // of the last free edge, fixed in the head by a pinned tail of two vertices
  glm::dvec3 tail_axis{0.0};
  double mean_segment_m = 0.0;  // of the free edges
  double shortest_m = 0.0;      // edges shorter at rest continue the one before them
  double turn_rad = 0.0;        // natural bending angles of the joints between free edges, added up
  double stiffening = 1.0;      // of bending and twist, to hold the style; see direct_rod_style.h
  /// Rest tangent at the joint before the edge, in the frame (axis, direction x axis, direction) of the edge
  /// before; in the frame of the edge after it is (-x, -y, z).
  std::vector<glm::dvec3> joint_tangent;
  std::vector<glm::dvec3> axis;  // of the edges as loaded
  std::vector<double> segment_m;
  std::vector<double> tension_m2ps2;  // to start with: of a sag-free shape, else 0
};

/// A strand as loaded and what weighs on it, whatever its stiffness. Head space; entry i of a vector belongs
/// to the edge that ends at vertex i.
struct RodShape {
  uint32_t first = 1;  // free vertices are first .. tail_begin - 1
  uint32_t tail_begin = 0;
  double free_length_m = 0.0;
  double mean_segment_m = 0.0;  // of the free edges
  double shortest_m = 0.0;      // edges shorter at rest continue the one before them
  std::vector<double> segment_m;
  std::vector<glm::dvec3> direction;
  std::vector<glm::dvec3> load;       // weight that pulls at it, over mass per length; half of its own
  std::vector<glm::dvec3> moment;     // that the joint before it carries; one more, 0
  std::vector<double> tension_m2ps2;  // of that load
  uint32_t vertex_count() const { return static_cast<uint32_t>(segment_m.size()); }
  double soft_m(uint32_t i) const;  // soft_length_m() of the edge
};

/// `groom_gravity_in_head_mps2` counts for a sag-free shape only. A strand pinned at both ends is never
/// sag-free.
RodShape make_rod_shape(const StrandLayout& layout, uint32_t strand_index, const RodParameters& parameters,
                        const glm::dvec3& groom_gravity_in_head_mps2);

/// Strain of a joint that carries a moment: a bend about an axis at right angles to the mean tangent, and a
/// twist about the mean tangent.
struct JointStrain {
  glm::dvec3 bend_axis{1.0, 0.0, 0.0};
  double bend_rad = 0.0;
  double twist_rad = 0.0;
};

/// A joint as loaded.
struct RodJoint {
  JointStrain strain;
  glm::dvec3 tangent{0.0};      // mean tangent
  double bend_stiffness = 0.0;  // moment per angle over mass per length
  double twist_stiffness = 0.0;
};

/// The joint before edge i, under the moment that the shape puts on it. Edges that fold back onto each other
/// have no mean tangent: it is `side_when_folded`.
RodJoint joint_at(const RodShape& shape, uint32_t i, const RodParameters& parameters,
                  const glm::dvec3& side_when_folded);

/// Returns the parameters with the stiffness of bending and twist multiplied by `factor`.
RodParameters stiffened(const RodParameters& parameters, double factor);

RodRest make_rod_rest(const RodShape& shape, const RodParameters& parameters, double stiffening);

/// The axis of an edge's frame on the next edge: turned by the smallest rotation from one direction to the
/// other. All unit vectors, `axis` at right angles to `from`.
glm::dvec3 carried_axis(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to);

/// The axis behind a joint without twist: turned by the rest rotation, then by the smallest one to `to`.
glm::dvec3 untwisted_axis(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to,
                          const glm::dvec3& joint_tangent);

/// Length that stiffness and mass of an edge are computed from: no shorter than a share of the mean, so that
/// zero-length edges divide nothing by zero.
double soft_length_m(double segment_m, double mean_segment_m);

/// Stiffness of the joint at the clamp, moment per angle over mass per length. With tension T the angle
/// decays from the clamp over sqrt(b / T). The stiffness is b / l times 1 + kappa / 2 + sqrt(1 + kappa^2 / 4)
/// with kappa^2 = T l^2 / b. With it edges of length l reach the continuous rod's displacement beyond that
/// layer (sum of the difference equation c (2 t_i - t_(i-1) - t_(i+1)) = -T l t_i). Without tension it is
/// 2 b / l, the clamp at the vertex.
double clamp_stiffness(double stiffness_m4ps2, double tension_m2ps2, double segment_m);

// Penalty of the multiplier's update, over (length / step)^2: the square of how often a wave of stretch
// crosses the strand in one step. Any value has the same equilibrium. With less the strand gives way within a
// step and loses energy when its lengths are restored; with much more float loses the inertia beside it.
inline constexpr double kTensionPerCrossing = 3.0;
// A step starts from the motion going on as it changed before, by at most this share of a segment. One solve
// from a start that is wrong by more keeps a strand thrashing for ever.
inline constexpr double kMaxTrendPerSegment = 0.1;
// A rod whose joints turn by less than this in all, at rest, bends as a straight one: twist could move its
// tip by the square of it.
inline constexpr double kStraightTurnRad = 1e-3;
// A joint that would have to turn further than this at rest holds no more load.
inline constexpr double kMaxRestAngleRad = 2.5;
// theta / sin(theta) is held where sin^2(theta / 2) passes this (a right angle in one joint).
inline constexpr double kMaxHalfSineSquared = 0.5;
// A step of more than this times the one before starts with backward Euler. With ratio r order 2 multiplies
// what a step got wrong by r^2 / (1 + 2 r): above 1 after a jump up, but less than 1 over steps that come
// back to where they were, since the logarithm of that is concave in log r.
inline constexpr double kMaxStepRatio = 8.0;

}  // namespace strandcast
