#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace strandcast {
namespace {

constexpr double kTinyLength = 1e-10;
constexpr double kSoftShare = 0.1;
constexpr double kMinSoftLengthM = 1e-5;
// 1 + cos below this: the edge folds back, any rotation will do.
constexpr double kFoldedBack = 1e-6;
// A joint that would have to turn further than this holds no more load.
constexpr double kMaxRestAngleRad = 2.5;

glm::dvec3 any_perpendicular(const glm::dvec3& direction) {
  const glm::dvec3 other =
      std::abs(direction.x) < 0.6 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  return glm::normalize(glm::cross(direction, other));
}

/// Directions of all edges; an edge without length continues the one before it.
std::vector<glm::dvec3> edge_directions(const StrandLayout& layout, uint32_t strand_index) {
  const uint32_t n = layout.vertex_count;
  std::vector<glm::dvec3> direction(n, glm::dvec3(0.0, 1.0, 0.0));
  bool has_any = false;
  for (uint32_t i = 1; i < n; ++i) {
    const glm::dvec3 edge = glm::dvec3(layout.rest[layout.index(i, strand_index)]) -
                            glm::dvec3(layout.rest[layout.index(i - 1, strand_index)]);
    const double length = glm::length(edge);
    direction[i] = length > kTinyLength ? edge / length : direction[i - 1];
    if (length > kTinyLength && !has_any) std::fill(direction.begin(), direction.begin() + i, direction[i]);
    has_any = has_any || length > kTinyLength;
  }
  return direction;
}

/// Rest directions, in head space, under which the shape carries its own weight: from the tip to the root,
/// the moment of each joint is what the edge after it and the next joint leave over.
void make_sag_free(const StrandLayout& layout, const RodParameters& parameters,
                   const std::vector<glm::dvec3>& direction, const std::vector<glm::dvec3>& load,
                   RodRest& rest, std::vector<glm::dvec3>& rest_in_head) {
  const uint32_t first = layout.pinned_root_count;
  const double b = parameters.stiffness_m4ps2;
  glm::dvec3 moment_after(0.0);
  for (uint32_t i = layout.vertex_count - 1; i >= first; --i) {
    const glm::dvec3& t = direction[i];
    const double length = soft_length_m(rest.segment_m[i], rest.mean_segment_m);
    const glm::dvec3 across = moment_after - t * glm::dot(t, moment_after);
    const glm::dvec3 moment = length * glm::cross(t, load[i]) + across;
    const double before = i > first ? soft_length_m(rest.segment_m[i - 1], rest.mean_segment_m) : 0.0;
    const double stiffness =
        i > first ? 2.0 * b / (before + length) : clamp_stiffness(b, rest.tension_m2ps2[i], length);
    const double size = glm::length(moment);
    if (size > 0.0 && stiffness > 0.0) {
      const double angle = std::min(size / stiffness, kMaxRestAngleRad);
      rest_in_head[i] = std::cos(angle) * t - std::sin(angle) * glm::cross(moment / size, t);
    }
    moment_after = moment;
  }
}

}  // namespace

RodParameters read_rod_parameters(const SolverParameters& parameters) {
  const double radius = parameters.at("radius_m");
  RodParameters result;
  // EI / (rho A) of a full circle: E pi r^4 / 4 over rho pi r^2.
  result.stiffness_m4ps2 =
      parameters.at("young_modulus_pa") * radius * radius / (4.0 * parameters.at("density_kgpm3"));
  result.bending_damping_s = parameters.at("bending_damping_s");
  result.air_drag_per_s = parameters.at("air_drag_per_s");
  result.collider_friction = parameters.at("collider_friction");
  result.max_speed_mps = parameters.at("max_speed_mps");
  result.solves = static_cast<uint32_t>(std::lround(parameters.at("solves")));
  result.order = static_cast<uint32_t>(std::lround(parameters.at("order")));
  result.is_sag_free = parameters.at("sag_free") >= 0.5;
  return result;
}

double soft_length_m(double segment_m, double mean_segment_m) {
  return std::max({segment_m, kSoftShare * mean_segment_m, kMinSoftLengthM});
}

double clamp_stiffness(double stiffness_m4ps2, double tension_m2ps2, double segment_m) {
  const double b = stiffness_m4ps2;
  const double pull = std::max(tension_m2ps2, 0.0) * segment_m * segment_m;
  return (b + 0.5 * std::sqrt(b * pull) + std::sqrt(b * (b + 0.25 * pull))) / segment_m;
}

glm::dvec3 carried_axis(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to) {
  const double sum = std::max(1.0 + glm::dot(from, to), kFoldedBack);
  glm::dvec3 result = axis - (glm::dot(axis, to) / sum) * (from + to);
  result -= to * glm::dot(result, to);
  return glm::normalize(result);
}

RodRest make_rod_rest(const StrandLayout& layout, uint32_t strand_index, const RodParameters& parameters,
                      const glm::dvec3& gravity_in_head_mps2) {
  const uint32_t n = layout.vertex_count;
  const uint32_t first = layout.pinned_root_count;
  const std::vector<glm::dvec3> direction = edge_directions(layout, strand_index);
  RodRest rest;
  rest.segment_m.assign(n, 0.0);
  double free_length = 0.0;
  for (uint32_t i = 1; i < n; ++i) {
    rest.segment_m[i] = static_cast<double>(layout.rest[layout.index(i, strand_index)].w);
    if (i >= first) free_length += rest.segment_m[i];
  }
  rest.mean_segment_m = first < n ? std::max(free_length / (n - first), kMinSoftLengthM) : kMinSoftLengthM;

  const bool is_sag_free = parameters.is_sag_free && layout.pinned_tail_count == 0;
  // Weight beyond each edge, per mass per length; half of every edge's mass at either end.
  std::vector<glm::dvec3> load(n, glm::dvec3(0.0));
  rest.tension_m2ps2.assign(n, 0.0);
  double beyond = 0.0;
  for (uint32_t i = n - 1; i >= first && i > 0; --i) {
    const double length = soft_length_m(rest.segment_m[i], rest.mean_segment_m);
    load[i] = gravity_in_head_mps2 * (beyond + 0.5 * length);
    beyond += length;
    if (is_sag_free) rest.tension_m2ps2[i] = glm::dot(load[i], direction[i]);
  }

  std::vector<glm::dvec3> rest_in_head = direction;
  if (is_sag_free) make_sag_free(layout, parameters, direction, load, rest, rest_in_head);

  // One pinned vertex: the strand leaves the head in the direction of its first edge.
  rest.clamp_direction = direction[first >= 2 || first >= n ? first - 1 : first];
  rest.frame_axis = any_perpendicular(rest.clamp_direction);
  rest.rest_direction.assign(n, glm::dvec3(0.0, 0.0, 1.0));
  glm::dvec3 axis = rest.frame_axis;
  glm::dvec3 before = rest.clamp_direction;
  for (uint32_t i = first; i < n; ++i) {
    const glm::dvec3& u = rest_in_head[i];
    rest.rest_direction[i] = {glm::dot(u, axis), glm::dot(u, glm::cross(before, axis)), glm::dot(u, before)};
    axis = carried_axis(axis, before, direction[i]);
    before = direction[i];
  }
  return rest;
}

SolverRow direct_rod_row() {
  SolverRow row;
  row.name = "direct_rod";
  row.summary = "elastic rod with the constants of hair: exact lengths, bending, natural curvature, implicit";
  row.source =
      "Kirchhoff rod in vertices: bending as in Bergou et al., Discrete Elastic Rods, SIGGRAPH 2008, section "
      "4.2, with theta^2 for the curvature; tension as a multiplier, the banded solve and the clamp are ours";
  row.parameters = {
      {"radius_m", 5e-5, 1e-6, 1e-2, "m", "radius of the circular cross section"},
      {"density_kgpm3", 1300.0, 1.0, 1e5, "kg/m^3", "density"},
      {"young_modulus_pa", 3e9, 0.0, 1e16, "Pa", "Young's modulus; 0 = a chain"},
      {"bending_damping_s", 2e-3, 0.0, 1.0, "s", "material damping: time by which bending moments lead"},
      {"air_drag_per_s", 4.0, 0.0, 1000.0, "1/s",
       "rate at which strands take on the velocity of the air; a single hair has about 10"},
      {"sag_free", 0.0, 0.0, 1.0, "", "1 = the groom as loaded is the equilibrium under gravity"},
      {"solves", 1.0, 1.0, 4.0, "", "linear solves per step (rounded)"},
      {"order", 2.0, 1.0, 2.0, "", "order of the time integration: 1 = backward Euler (rounded)"},
      {"collider_friction", 0.3, 0.0, 10.0, "", "Coulomb friction of strands on colliders"},
      {"max_speed_mps", 30.0, 0.1, 1000.0, "m/s",
       "largest speed relative to the head that a step starts from"},
  };
  row.effort_parameter = "solves";
  row.as_hair = [](const HairConstants& hair, double, double) {
    return SolverParameters{{"radius_m", hair.radius_m},
                            {"density_kgpm3", hair.density_kgpm3},
                            {"young_modulus_pa", hair.young_modulus_pa},
                            {"bending_damping_s", 0.0},
                            {"air_drag_per_s", 0.0}};
  };
  row.make_gpu = make_direct_rod_gpu;
  row.make_reference = make_direct_rod_reference;
  return row;
}

}  // namespace strandcast
