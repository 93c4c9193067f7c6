#include "server/report/contact_depth.h"

#include <algorithm>
#include <cmath>

#include "common/base/quantile.h"

namespace strandcast {
namespace {

constexpr double kUsualShare = 0.999;

}  // namespace

CollisionDepth DepthRecord::depth() const {
  CollisionDepth depth;
  if (vertex_m_.empty()) return depth;
  depth.vertex_most_m = *std::max_element(vertex_m_.begin(), vertex_m_.end());
  depth.vertex_usual_m = quantile(vertex_m_, kUsualShare);
  depth.middle_most_m = middle_most_m_;
  return depth;
}

void record_depths(const Groom& groom, const SolverState& state, const glm::dquat& world_from_head,
                   uint32_t stride, const DepthAt& depth_at, DepthRecord& record) {
  const uint32_t strands = groom.strand_count();
  const glm::dquat turn = glm::conjugate(world_from_head);
  for (uint32_t s = 0; s < strands; s += stride)
    for (uint32_t i = 1; i < groom.uniform_vertex_count(); ++i) {
      const uint32_t at = groom.offset[s] + i;
      if (groom.pinned[at] != 0) continue;
      const glm::dvec3 start = turn * glm::dvec3(state.position_m[(i - 1) * strands + s]);
      const glm::dvec3 end = turn * glm::dvec3(state.position_m[i * strands + s]);
      const glm::dvec3 groomed_start(groom.rest_position_m[at - 1]), groomed_end(groom.rest_position_m[at]);
      record.add_vertex(depth_at(end, groomed_end));
      record.add_middle(depth_at(0.5 * (start + end), 0.5 * (groomed_start + groomed_end)));
    }
}

double speed_rms_mps(const SolverState& before, const SolverState& after, double apart_s) {
  double squares = 0.0;
  for (size_t i = 0; i < after.position_m.size(); ++i) {
    const glm::dvec3 way_m(after.position_m[i] - before.position_m[i]);
    squares += glm::dot(way_m, way_m);
  }
  return std::sqrt(squares / static_cast<double>(after.position_m.size())) / apart_s;
}

}  // namespace strandcast
