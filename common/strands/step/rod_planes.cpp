#include "common/strands/step/rod_planes.h"

#include <algorithm>
#include <cmath>

#include "common/kernels/step_model.h"

namespace strandcast::step {
namespace {

// As server/sim/solvers/direct_rod/direct_rod_rest.cpp.
constexpr double kMinSoftLengthM = 1e-5;
constexpr double kShortestShare = 1e-3;
constexpr double kShortestM = 1e-6;
constexpr double kFoldedBack = 1e-6;
constexpr double kMostSteep = 0.6;

glm::dvec3 unit(const glm::dvec3& vector, const glm::dvec3& otherwise) {
  const double squared = (vector.x * vector.x + vector.y * vector.y) + vector.z * vector.z;
  return squared > kFoldedBack * kFoldedBack ? vector / std::sqrt(squared) : otherwise;
}

glm::dvec3 any_perpendicular(const glm::dvec3& direction) {
  const glm::dvec3 other =
      std::abs(direction.x) < kMostSteep ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  return unit(glm::cross(direction, other), other);
}

glm::dvec3 carried_axis(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to) {
  const double sum = std::max(1.0 + glm::dot(from, to), kFoldedBack);
  glm::dvec3 result = axis - (glm::dot(axis, to) / sum) * (from + to);
  result -= to * glm::dot(result, to);
  return unit(result, any_perpendicular(to));
}

/// One strand: lengths of its segments, and their directions.
struct Line {
  std::vector<float> segment_m;
  std::vector<glm::dvec3> direction;
  double mean_m = 0.0;
  double shortest_m = 0.0;
};

void measure(const RodShapes& shapes, uint32_t strand, Line& line) {
  const uint32_t n = shapes.vertex_count;
  line.segment_m.assign(n, 0.0f);
  line.direction.assign(n, glm::dvec3(0.0, 1.0, 0.0));
  double length_m = 0.0;
  for (uint32_t v = 1; v < n; ++v) {
    const size_t at = v * size_t{shapes.strand_count} + strand;
    const glm::dvec3 edge =
        glm::dvec3(shapes.rest_in_head_m[at]) - glm::dvec3(shapes.rest_in_head_m[at - shapes.strand_count]);
    line.segment_m[v] = static_cast<float>(std::sqrt((edge.x * edge.x + edge.y * edge.y) + edge.z * edge.z));
    line.direction[v] = edge;
    if (v >= shapes.pinned_root_count) length_m += static_cast<double>(line.segment_m[v]);
  }
  const uint32_t free = n - std::min(n, shapes.pinned_root_count);
  line.mean_m = free > 0 ? std::max(length_m / free, kMinSoftLengthM) : kMinSoftLengthM;
  line.shortest_m = std::max(kShortestShare * line.mean_m, kShortestM);
  bool has_any = false;
  for (uint32_t v = 1; v < n; ++v) {
    const bool has = static_cast<double>(line.segment_m[v]) > line.shortest_m;
    line.direction[v] = has ? unit(line.direction[v], line.direction[v - 1]) : line.direction[v - 1];
    if (has && !has_any) std::fill(line.direction.begin(), line.direction.begin() + v, line.direction[v]);
    has_any = has_any || has;
  }
}

}  // namespace

RodPlanes natural_rods(const RodShapes& shapes) {
  const uint32_t n = shapes.vertex_count;
  const uint32_t first = shapes.pinned_root_count;
  const uint32_t tail = std::min(n - shapes.pinned_tail_count, n - 1);
  RodPlanes planes;
  planes.edge.resize(size_t{n} * shapes.strand_count);
  planes.strand.resize(size_t{kRodStrandRows} * shapes.strand_count);
  Line line;
  for (uint32_t s = 0; s < shapes.strand_count; ++s) {
    measure(shapes, s, line);
    glm::dvec3 axis = any_perpendicular(line.direction[std::min(first, n - 1)]);
    const auto put = [&](uint32_t row, const glm::dvec3& vector, double w) {
      planes.strand[size_t{row} * shapes.strand_count + s] = glm::vec4(glm::dvec4(vector, w));
    };
    put(0, line.direction[std::min(first, n - 1)], line.mean_m);
    put(1, axis, line.shortest_m);
    for (uint32_t v = 0; v < n; ++v) {
      glm::dvec3 joint(0.0, 0.0, 1.0);
      if (v > first) {
        const glm::dvec3& before = line.direction[v - 1];
        const glm::dvec3& after = line.direction[v];
        const glm::dvec3 side = glm::cross(before, axis);
        const glm::dvec3 tangent = unit(before + after, side);
        joint = {glm::dot(tangent, axis), glm::dot(tangent, side), glm::dot(tangent, before)};
        axis = carried_axis(axis, before, after);
      }
      if (v > n - shapes.pinned_tail_count) joint = {0.0, 0.0, 1.0};
      if (!shapes.has_twist) joint = 2.0 * joint.z * joint - glm::dvec3(0.0, 0.0, 1.0);
      planes.edge[size_t{v} * shapes.strand_count + s] =
          glm::vec4(glm::dvec4(joint, static_cast<double>(line.segment_m[v])));
      if (v == tail) {
        put(2, line.direction[tail], 0.0);
        put(3, axis, 0.0);
      }
    }
  }
  return planes;
}

}  // namespace strandcast::step
