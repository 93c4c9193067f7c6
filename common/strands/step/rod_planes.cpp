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
constexpr double kSoftShare = 0.1;
constexpr double kMaxRestAngleRad = 2.5;

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

double soft_m(const Line& line, uint32_t v) {
  return std::max({static_cast<double>(line.segment_m[v]), kSoftShare * line.mean_m, kMinSoftLengthM});
}

/// Sine and cosine for angles up to 2.5 rad.
struct Angle {
  double sine, cosine;
};
Angle angle_of(double rad) {
  constexpr int kTerms = 11;
  const double squared = rad * rad;
  Angle angle{0.0, 0.0};
  for (int k = kTerms; k > 0; --k) {
    angle.sine = 1.0 - squared / (2.0 * k * (2.0 * k + 1.0)) * (k == kTerms ? 1.0 : angle.sine);
    angle.cosine = 1.0 - squared / (2.0 * k * (2.0 * k - 1.0)) * (k == kTerms ? 1.0 : angle.cosine);
  }
  angle.sine *= rad;
  return angle;
}
glm::dvec3 rotated(const glm::dvec3& vector, const glm::dvec3& axis, const Angle& by) {
  return by.cosine * vector + by.sine * glm::cross(axis, vector) +
         ((1.0 - by.cosine) * glm::dot(axis, vector)) * axis;
}
Angle back(const Angle& angle) {
  return {-angle.sine, angle.cosine};
}

/// A joint that carries a moment: the middle of its edges' directions, and what it is strained by.
struct Joint {
  glm::dvec3 tangent;
  glm::dvec3 bend_axis{1.0, 0.0, 0.0};
  Angle half_bend{0.0, 1.0};
  Angle half_twist{0.0, 1.0};
  Angle twist{0.0, 1.0};

  void strain(const glm::dvec3& moment, double bend_stiffness, double twist_stiffness) {
    const double along = glm::dot(moment, tangent);
    const glm::dvec3 across = moment - along * tangent;
    const double size = std::sqrt(glm::dot(across, across));
    half_bend = {0.0, 1.0};
    bend_axis = size > 0.0 && bend_stiffness > 0.0 ? across / size : any_perpendicular(tangent);
    if (size > 0.0 && bend_stiffness > 0.0)
      half_bend = angle_of(0.5 * std::min(size / bend_stiffness, kMaxRestAngleRad));
    if (!(twist_stiffness > 0.0)) return;
    const double rad =
        std::clamp(along * half_bend.cosine / twist_stiffness, -kMaxRestAngleRad, kMaxRestAngleRad);
    half_twist = angle_of(0.5 * rad);
    twist = angle_of(rad);
  }
  /// From the unstrained joint to one that is strained, on the edge's side after it, and from there.
  glm::dvec3 strained(const glm::dvec3& vector) const {
    return rotated(rotated(rotated(vector, bend_axis, half_bend), tangent, twist), bend_axis, half_bend);
  }
  glm::dvec3 unstrained(const glm::dvec3& vector) const {
    const Angle bend = back(half_bend);
    return rotated(rotated(rotated(vector, bend_axis, bend), tangent, back(twist)), bend_axis, bend);
  }
  glm::dvec3 start() const { return rotated(tangent, bend_axis, back(half_bend)); }
};

/// What the edges of a strand have to carry; empty where nothing weighs.
struct Load {
  std::vector<glm::dvec3> moment;  // at the joint before each edge
  std::vector<double> tension_m2ps2;
};
Load load_of(const RodShapes& shapes, uint32_t strand, const Line& line) {
  Load load;
  if (shapes.weight_mps2 == glm::vec3(0.0f) || shapes.bend_m4ps2.empty() || shapes.tail_count(strand) > 0)
    return load;
  const uint32_t n = shapes.vertex_count;
  load.moment.assign(n + 1, glm::dvec3(0.0));
  load.tension_m2ps2.assign(n, 0.0);
  double beyond = shapes.tip_length_m;
  for (uint32_t v = n - 1; v >= shapes.pinned_root_count && v > 0; --v) {
    const double soft = soft_m(line, v);
    const glm::dvec3 weight = (beyond + 0.5 * soft) * glm::dvec3(shapes.weight_mps2);
    beyond += soft;
    load.tension_m2ps2[v] = glm::dot(weight, line.direction[v]);
    load.moment[v] = load.moment[v + 1] + soft * glm::cross(line.direction[v], weight);
  }
  return load;
}

double clamp_stiffness(double bend, double tension_m2ps2, double segment_m) {
  const double pull = std::max(tension_m2ps2, 0.0) * segment_m * segment_m;
  return (bend + 0.5 * std::sqrt(bend * pull) + std::sqrt(bend * (bend + 0.25 * pull))) / segment_m;
}

/// The joint before edge v of a strand with this stiffness. Its middle depends on the strain, and that on the
/// middle: found by repetition.
Joint joint_at(const RodShapes& shapes, const Line& line, const Load& load, double bend, uint32_t v,
               const glm::dvec3& side) {
  constexpr int kRounds = 12;
  constexpr double kSettled = 1e-14;
  const bool is_clamp = v == shapes.pinned_root_count;
  const glm::dvec3& before = line.direction[v - 1];
  const glm::dvec3& after = line.direction[v];
  Joint joint{is_clamp ? after : unit(before + after, side)};
  if (load.moment.empty()) return joint;
  const double soft = soft_m(line, v);
  const double per_length = is_clamp ? 2.0 / soft : 2.0 / (soft_m(line, v - 1) + soft);
  const double stiffness = is_clamp ? clamp_stiffness(bend, load.tension_m2ps2[v], soft) : bend * per_length;
  const double twist_stiffness = bend * shapes.twist_over_bend * per_length;
  for (int round = 0; round < kRounds; ++round) {
    joint.strain(load.moment[v], stiffness, twist_stiffness);
    const glm::dvec3 end = rotated(rotated(after, joint.bend_axis, back(joint.half_bend)), joint.tangent,
                                   back(joint.half_twist));
    const glm::dvec3 start =
        rotated(rotated(before, joint.bend_axis, joint.half_bend), joint.tangent, joint.half_twist);
    const glm::dvec3 tangent = unit(is_clamp ? end : start + end, joint.tangent);
    const glm::dvec3 moved = tangent - joint.tangent;
    joint.tangent = tangent;
    if (glm::dot(moved, moved) < kSettled) break;
  }
  joint.strain(load.moment[v], stiffness, twist_stiffness);
  return joint;
}

/// Planes of one strand.
void fill_strand(const RodShapes& shapes, uint32_t s, const Line& line, RodPlanes& planes) {
  const uint32_t n = shapes.vertex_count;
  const uint32_t first = shapes.pinned_root_count;
  const uint32_t tail = std::min(n - shapes.tail_count(s), n - 1);
  const Load load = load_of(shapes, s, line);
  const double bend = shapes.bend_m4ps2.empty() ? 0.0 : static_cast<double>(shapes.bend_m4ps2[s]);
  const auto put = [&](uint32_t row, const glm::dvec3& vector, double w) {
    planes.strand[size_t{row} * shapes.strand_count + s] = glm::vec4(glm::dvec4(vector, w));
  };
  glm::dvec3 clamp = line.direction[n - 1];
  glm::dvec3 axis = any_perpendicular(clamp);
  put(0, clamp, line.mean_m);
  put(1, axis, line.shortest_m);
  for (uint32_t v = 0; v < n; ++v) {
    glm::dvec3 told(0.0, 0.0, 1.0);
    if (v >= first) {
      const glm::dvec3& before = line.direction[v - 1];
      const glm::dvec3 side = glm::cross(before, axis);
      const Joint joint = joint_at(shapes, line, load, bend, v, side);
      const glm::dvec3 start = joint.start();
      if (v == first) {
        put(0, start, line.mean_m);
        axis = any_perpendicular(start);
        put(1, axis, line.shortest_m);
      } else {
        told = {glm::dot(start, axis), glm::dot(start, side), glm::dot(start, before)};
        axis = carried_axis(axis, before, joint.unstrained(line.direction[v]));
      }
      axis = joint.strained(axis);
      axis = unit(axis - line.direction[v] * glm::dot(axis, line.direction[v]),
                  any_perpendicular(line.direction[v]));
    }
    if (v > n - shapes.tail_count(s)) told = {0.0, 0.0, 1.0};
    if (!shapes.has_twist) told = 2.0 * told.z * told - glm::dvec3(0.0, 0.0, 1.0);
    planes.edge[size_t{v} * shapes.strand_count + s] =
        glm::vec4(glm::dvec4(told, static_cast<double>(line.segment_m[v])));
    if (v == tail) {
      put(2, line.direction[tail], 0.0);
      put(3, axis, 0.0);
    }
  }
}

}  // namespace

RodPlanes natural_rods(const RodShapes& shapes) {
  RodPlanes planes;
  planes.edge.resize(size_t{shapes.vertex_count} * shapes.strand_count);
  planes.strand.resize(size_t{kRodStrandRows} * shapes.strand_count);
  Line line;
  for (uint32_t s = 0; s < shapes.strand_count; ++s) {
    measure(shapes, s, line);
    fill_strand(shapes, s, line, planes);
  }
  return planes;
}

}  // namespace strandcast::step
