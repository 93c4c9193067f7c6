// Measures how deep hair penetrates its colliders, and whether it is at rest. Any thread.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "server/report/collision_study.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Penetration depths of many points over many steps.
class DepthRecord {
 public:
  void add_vertex(double depth_m) { vertex_m_.push_back(depth_m > 0.0 ? depth_m : 0.0); }
  void add_middle(double depth_m) { middle_most_m_ = depth_m > middle_most_m_ ? depth_m : middle_most_m_; }
  CollisionDepth depth() const;

 private:
  std::vector<double> vertex_m_;
  double middle_most_m_ = 0.0;
};

/// Returns the penetration of a point whose position in the loaded hair is `groomed_m`.
using DepthAt = std::function<double(const glm::dvec3& place_m, const glm::dvec3& groomed_m)>;

/// Records the free vertices and the midpoints before them of every `stride`-th strand, in head space.
void record_depths(const Groom& groom, const SolverState& state, const glm::dquat& world_from_head,
                   uint32_t stride, const DepthAt& depth_at, DepthRecord& record);

/// Returns the root mean square of the speed over all vertices.
double speed_rms_mps(const SolverState& before, const SolverState& after, double apart_s);

}  // namespace strandcast
