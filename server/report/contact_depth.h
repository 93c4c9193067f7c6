// How deep hair gets in what it collides with, and whether it rests. Any thread.
#pragma once

#include <functional>
#include <glm/glm.hpp>
#include <glm/gtc/quaternion.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "server/report/collision_study.h"
#include "server/sim/solver.h"

namespace strandcast {

/// Depths of many places over many steps.
class DepthRecord {
 public:
  void add_vertex(double depth_m) { vertex_m_.push_back(depth_m > 0.0 ? depth_m : 0.0); }
  void add_middle(double depth_m) { middle_most_m_ = depth_m > middle_most_m_ ? depth_m : middle_most_m_; }
  CollisionDepth depth() const;

 private:
  std::vector<double> vertex_m_;
  double middle_most_m_ = 0.0;
};

/// How deep a place is that hair as loaded has there.
using DepthAt = std::function<double(const glm::dvec3& place_m, const glm::dvec3& groomed_m)>;

/// Free vertices and the middles before them of every `stride`-th strand, seen from the head.
void record_depths(const Groom& groom, const SolverState& state, const glm::dquat& world_from_head,
                   uint32_t stride, const DepthAt& depth_at, DepthRecord& record);

/// Root mean square over all vertices.
double speed_rms_mps(const SolverState& before, const SolverState& after, double apart_s);

}  // namespace strandcast
