// The scalar equations in double, written out: forces of every vertex beyond a segment are summed again for
// every segment, angles are turned as quaternions.
#include <cmath>

#include "server/sim/reference_chain.h"
#include "server/sim/solvers/angular_projection/angular_projection.h"

namespace strandcast {
namespace {

const glm::dvec3 kAcross[2] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}};  // of a frame
const glm::dvec3 kAlongBone(0.0, 0.0, 1.0);

class AngularProjectionReference final : public ReferenceChain {
 public:
  explicit AngularProjectionReference(const SolverParameters& parameters)
      : ReferenceChain(read_strand_parameters(parameters), read_chain_parameters(parameters, "sweeps")) {}

 private:
  glm::dquat frame_before(const ReferenceChainState& chain, size_t i) const {
    return i > 0 ? chain.segment[i - 1].frame : chain.clamp;
  }

  /// Moment of the joint before segment i on that segment.
  glm::dvec3 joint_moment(const ReferenceChainState& chain, size_t i, double stiffness) const {
    const ChainSegment& segment = chain.segment[i];
    const glm::dvec3 rest = frame_before(chain, i) * (segment.rest_turn * kAlongBone);
    const glm::dvec3 turn_before = i > 0 ? chain.segment[i - 1].turn : chain.clamp_turn;
    const glm::dvec3 rate = (segment.turn - turn_before) / h_s();
    return stiffness * (bend_between(segment.along(), rest) - parameters().damping_s * rate);
  }

  bool turn_segments(ReferenceChainState& chain) const override {
    const size_t n = chain.segment.size();
    bool is_sound = true;
    for (size_t i = 0; i < n && is_sound; ++i) is_sound = turn_segment(chain, i);
    for (size_t i = n; i-- > 0 && is_sound;) is_sound = turn_segment(chain, i);
    return is_sound;
  }

  bool turn_segment(ReferenceChainState& chain, size_t i) const {
    const size_t n = chain.segment.size();
    ChainSegment& segment = chain.segment[i];
    segment.frame = carried_frame(frame_before(chain, i), segment.along());
    double mass = 0.0;
    glm::dvec3 force(0.0);
    glm::dvec3 position = chain.root_m;
    for (size_t j = 0; j < n; ++j) {
      position += chain.segment[j].length_m * chain.segment[j].along();
      if (j < i) continue;
      mass += chain.segment[j].mass_m;
      force += chain.segment[j].mass_m * (chain.segment[j].aim_m - position);
    }
    const double h2 = h_s() * h_s();
    const double tension = glm::dot(force, segment.along());
    const double lag = 1.0 + parameters().damping_s / h_s();
    const double stiffness = h2 * bend_stiffness(chain, i, tension / h2);
    glm::dvec3 moment =
        glm::cross(segment.lever_m * segment.along(), force) + joint_moment(chain, i, stiffness);
    double inertia = mass * segment.lever_m * segment.lever_m + segment.lever_m * std::fmax(tension, 0.0) +
                     lag * stiffness;
    if (i + 1 < n) {
      const double next = h2 * bend_stiffness(chain, i + 1, 0.0);
      moment -= joint_moment(chain, i + 1, next);
      inertia += lag * next;
    }
    glm::dvec3 turned(0.0);
    for (const glm::dvec3& across : kAcross) {
      const glm::dvec3 normal = segment.frame * across;  // of the plane in which the angle changes
      turned += glm::dot(moment, normal) / inertia * normal;
    }
    if (!std::isfinite(glm::dot(turned, turned))) return false;
    turn(segment, turned);
    segment.frame = carried_frame(frame_before(chain, i), segment.along());
    return true;
  }
};

}  // namespace

std::unique_ptr<Solver> make_angular_projection_reference(const SolverParameters& parameters) {
  return std::make_unique<AngularProjectionReference>(parameters);
}

}  // namespace strandcast
