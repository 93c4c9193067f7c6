#include "server/sim/solvers/direct_rod/direct_rod_rest.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/sim/directions.h"
#include "server/sim/solvers/direct_rod/direct_rod_style.h"

namespace strandcast {
namespace {

/// Hair in the air, 1/s: a wisp of diameter D takes the drag of a solid cylinder, Cd rho U^2 D / 2 per length
/// with Cd = 1 at its Reynolds number of about 500 (Hoerner, Fluid-Dynamic Drag, 1965, chapter 3), on the
/// mass phi rho_hair pi D^2 / 4 of its hair: 2 Cd rho U / (pi phi rho_hair D), which is 1.8 for D = 5 mm, a
/// tenth of it hair (phi), in the 1.5 m/s of a light breeze. A single hair of 0.1 mm (Reynolds number 10, Cd
/// = 2.8) would have 25: its neighbours shield it. Less than this, as in thicker locks, leaves swings that
/// the air alone damps going on for more than ten seconds.
constexpr double kWispDragPerS = 2.0;

constexpr double kSoftShare = 0.1;
constexpr double kMinSoftLengthM = 1e-5;
// Float positions say nothing about the direction of edges below.
constexpr double kShortestShare = 1e-3;
constexpr double kShortestRestM = 1e-6;
// 1 + cos below this: the edge folds back, any rotation will do.
constexpr double kFoldedRest = 1e-6;

/// Directions of all edges; an edge too short for one continues the one before it.
std::vector<glm::dvec3> edge_directions(const StrandLayout& layout, uint32_t strand_index,
                                        double shortest_m) {
  const uint32_t n = layout.vertex_count;
  std::vector<glm::dvec3> direction(n, glm::dvec3(0.0, 1.0, 0.0));
  bool has_any = false;
  for (uint32_t i = 1; i < n; ++i) {
    const glm::dvec3 edge = glm::dvec3(layout.rest[layout.index(i, strand_index)]) -
                            glm::dvec3(layout.rest[layout.index(i - 1, strand_index)]);
    const double length = glm::length(edge);
    direction[i] = length > shortest_m ? edge / length : direction[i - 1];
    if (length > shortest_m && !has_any) std::fill(direction.begin(), direction.begin() + i, direction[i]);
    has_any = has_any || length > shortest_m;
  }
  return direction;
}

glm::dvec3 rotated(const glm::dvec3& vector, const glm::dvec3& axis, double angle_rad) {
  return glm::angleAxis(angle_rad, axis) * vector;
}

/// The stiffnesses are moments per angle over mass per length.
JointStrain strain_under(const glm::dvec3& moment, const glm::dvec3& tangent, double bend_stiffness,
                         double twist_stiffness) {
  JointStrain strain;
  const double along = glm::dot(moment, tangent);
  const glm::dvec3 across = moment - along * tangent;
  const double size = glm::length(across);
  if (size > 0.0 && bend_stiffness > 0.0) {
    strain.bend_axis = across / size;
    strain.bend_rad = std::min(size / bend_stiffness, kMaxRestAngleRad);
  } else {
    strain.bend_axis = any_perpendicular(tangent);
  }
  // The twist turns about (sum of the tangents) / (1 + cos theta), which is longer than one.
  if (twist_stiffness > 0.0) {
    const double twist = along * std::cos(0.5 * strain.bend_rad) / twist_stiffness;
    strain.twist_rad = std::clamp(twist, -kMaxRestAngleRad, kMaxRestAngleRad);
  }
  return strain;
}

/// A direction turned from the joint's unstrained side to its middle.
glm::dvec3 half_strained(const JointStrain& strain, const glm::dvec3& tangent, const glm::dvec3& vector,
                         double sign) {
  return rotated(rotated(vector, strain.bend_axis, sign * 0.5 * strain.bend_rad), tangent,
                 sign * 0.5 * strain.twist_rad);
}

struct JointEdges {
  glm::dvec3 before{0.0};
  glm::dvec3 after{0.0};
  glm::dvec3 side{0.0};
  bool is_clamp = false;
};

/// The strain under which a joint between two directions carries a moment. Its axes stand relative to the
/// mean tangent, which in turn depends on the strain: found by repetition. A clamp (no edge before) has the
/// edge's direction for the tangent. `side` is the tangent of edges that fold back onto each other.
RodJoint joint_under(const glm::dvec3& moment, const JointEdges& edges, double bend_stiffness,
                     double twist_stiffness) {
  const auto& [before, after, side, is_clamp] = edges;
  constexpr int kRounds = 60;
  RodJoint joint;
  joint.bend_stiffness = bend_stiffness;
  joint.twist_stiffness = twist_stiffness;
  const glm::dvec3 sum = is_clamp ? after : before + after;
  joint.tangent = glm::dot(sum, sum) > 2.0 * kFoldedRest ? glm::normalize(sum) : side;
  glm::dvec3 last_but_one(0.0);
  for (int round = 0; round < kRounds; ++round) {
    joint.strain = strain_under(moment, joint.tangent, bend_stiffness, twist_stiffness);
    const glm::dvec3 end = half_strained(joint.strain, joint.tangent, after, -1.0);
    const glm::dvec3 start = half_strained(joint.strain, joint.tangent, before, 1.0);
    const glm::dvec3 middle = is_clamp ? end : start + end;
    if (glm::dot(middle, middle) <= 2.0 * kFoldedRest) break;
    const glm::dvec3 tangent = glm::normalize(middle);
    // What repeats itself has settled, into one value or two that differ by a rounding: nothing new comes.
    const bool is_settled = tangent == joint.tangent;
    const bool ends_here = tangent == last_but_one && (kRounds - 1 - round) % 2 == 0;
    last_but_one = joint.tangent;
    joint.tangent = tangent;
    if (is_settled || ends_here) break;
  }
  // The bend axis of the last round, at right angles to the last tangent.
  joint.strain = strain_under(moment, joint.tangent, bend_stiffness, twist_stiffness);
  return joint;
}

/// Tangents and frames of all joints behind the clamp's direction.
void set_joints(const RodShape& shape, const RodParameters& parameters, RodRest& rest) {
  const uint32_t n = shape.vertex_count();
  const uint32_t first = shape.first;
  const std::vector<glm::dvec3>& direction = shape.direction;
  rest.joint_tangent.assign(n, glm::dvec3(0.0, 0.0, 1.0));
  rest.axis.assign(n, glm::dvec3(1.0, 0.0, 0.0));
  if (first >= n) {
    rest.clamp_direction = direction[n - 1];
    rest.clamp_axis = any_perpendicular(rest.clamp_direction);
    return;
  }
  for (uint32_t i = first; i < n; ++i) {
    const RodJoint joint = joint_at(shape, i, parameters, glm::cross(direction[i - 1], rest.axis[i - 1]));
    const JointStrain& strain = joint.strain;
    // Half a bend, the twist, half a bend: from the frame on one side of the joint to that on the other.
    const auto strained = [&](const glm::dvec3& vector, double sign) {
      const glm::dvec3 half = rotated(vector, strain.bend_axis, sign * 0.5 * strain.bend_rad);
      return rotated(rotated(half, joint.tangent, sign * strain.twist_rad), strain.bend_axis,
                     sign * 0.5 * strain.bend_rad);
    };
    const glm::dvec3 start_tangent = rotated(joint.tangent, strain.bend_axis, -0.5 * strain.bend_rad);
    if (i == first) {
      rest.clamp_direction = start_tangent;
      rest.clamp_axis = any_perpendicular(start_tangent);
      rest.axis[i] = strained(rest.clamp_axis, 1.0);
    } else {
      const glm::dvec3& before = direction[i - 1];
      const glm::dvec3& axis = rest.axis[i - 1];
      rest.joint_tangent[i] = {glm::dot(start_tangent, axis),
                               glm::dot(start_tangent, glm::cross(before, axis)),
                               glm::dot(start_tangent, before)};
      const glm::dvec3 unstrained = strained(direction[i], -1.0);
      rest.axis[i] = strained(carried_axis(axis, before, unstrained), 1.0);
      if (i < shape.tail_begin + 1)
        rest.turn_rad += 2.0 * std::acos(std::clamp(rest.joint_tangent[i].z, -1.0, 1.0));
    }
    // Roundings of the rotations above.
    rest.axis[i] = glm::normalize(rest.axis[i] - direction[i] * glm::dot(rest.axis[i], direction[i]));
  }
}

}  // namespace

RodParameters read_rod_parameters(const SolverParameters& parameters) {
  const double radius = parameters.at("radius_m");
  RodParameters result;
  // EI / (rho A) of a full circle: E pi r^4 / 4 over rho pi r^2.
  result.stiffness_m4ps2 =
      parameters.at("young_modulus_pa") * radius * radius / (4.0 * parameters.at("density_kgpm3"));
  // J = 2 I for a full circle, G = E / (2 (1 + nu)).
  result.twist_stiffness_m4ps2 = result.stiffness_m4ps2 / (1.0 + parameters.at("poisson_ratio"));
  result.spin_inertia_m2 = 0.5 * radius * radius;
  const double mass_per_length = parameters.at("density_kgpm3") * std::numbers::pi * radius * radius;
  result.tip_length_m = parameters.at("tip_mass_kg") / mass_per_length;
  result.bending_damping_s = parameters.at("bending_damping_s");
  result.air_drag_per_s = parameters.at("air_drag_per_s");
  result.collider_friction = parameters.at("collider_friction");
  result.max_speed_mps = parameters.at("max_speed_mps");
  result.solves = read_count(parameters, "solves");
  result.order = read_count(parameters, "order");
  result.sag_free = parameters.at("sag_free");
  result.style_margin = parameters.at("style_margin");
  return result;
}

double RodShape::soft_m(uint32_t i) const {
  return soft_length_m(segment_m[i], mean_segment_m);
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
  const double sum = std::max(1.0 + glm::dot(from, to), kFoldedRest);
  glm::dvec3 result = axis - (glm::dot(axis, to) / sum) * (from + to);
  result -= to * glm::dot(result, to);
  return glm::normalize(result);
}

glm::dvec3 untwisted_axis(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to,
                          const glm::dvec3& joint_tangent) {
  const glm::dvec3& c = joint_tangent;
  const glm::dvec3 tangent = c.x * axis + c.y * glm::cross(from, axis) + c.z * from;
  const glm::dvec3 unstrained = 2.0 * glm::dot(tangent, from) * tangent - from;
  return carried_axis(carried_axis(axis, from, unstrained), unstrained, to);
}

RodParameters stiffened(const RodParameters& parameters, double factor) {
  RodParameters result = parameters;
  result.stiffness_m4ps2 *= factor;
  result.twist_stiffness_m4ps2 *= factor;
  return result;
}

RodShape make_rod_shape(const StrandLayout& layout, uint32_t strand_index, const RodParameters& parameters,
                        const glm::dvec3& groom_gravity_in_head_mps2) {
  const uint32_t n = layout.vertex_count;
  RodShape shape;
  const uint32_t first = shape.first = layout.pinned_root_count;
  shape.tail_begin = n - layout.tail_count(strand_index);
  shape.segment_m.assign(n, 0.0);
  for (uint32_t i = 1; i < n; ++i) {
    shape.segment_m[i] = static_cast<double>(layout.rest[layout.index(i, strand_index)].w);
    if (i >= first) shape.free_length_m += shape.segment_m[i];
  }
  shape.mean_segment_m =
      first < n ? std::max(shape.free_length_m / (n - first), kMinSoftLengthM) : kMinSoftLengthM;
  shape.shortest_m = std::max(kShortestShare * shape.mean_segment_m, kShortestRestM);
  shape.direction = edge_directions(layout, strand_index, shape.shortest_m);

  const double share = layout.tail_count(strand_index) == 0 ? parameters.sag_free : 0.0;
  shape.load.assign(n, glm::dvec3(0.0));
  shape.tension_m2ps2.assign(n, 0.0);
  double beyond = parameters.tip_length_m;
  for (uint32_t i = n - 1; i >= first && i > 0; --i) {
    shape.load[i] = share * (beyond + 0.5 * shape.soft_m(i)) * groom_gravity_in_head_mps2;
    beyond += shape.soft_m(i);
    shape.tension_m2ps2[i] = glm::dot(shape.load[i], shape.direction[i]);
  }
  // From the tip: what the edge after a joint and the next joint leave over.
  shape.moment.assign(n + 1, glm::dvec3(0.0));
  for (uint32_t i = n - 1; i >= first && i > 0; --i)
    shape.moment[i] = shape.moment[i + 1] + shape.soft_m(i) * glm::cross(shape.direction[i], shape.load[i]);
  return shape;
}

RodJoint joint_at(const RodShape& shape, uint32_t i, const RodParameters& parameters,
                  const glm::dvec3& side_when_folded) {
  const bool is_clamp = i == shape.first;
  const double b = parameters.stiffness_m4ps2;
  const double soft = shape.soft_m(i);
  const double per_length = is_clamp ? 2.0 / soft : 2.0 / (shape.soft_m(i - 1) + soft);
  const double bend = is_clamp ? clamp_stiffness(b, shape.tension_m2ps2[i], soft) : b * per_length;
  const JointEdges edges = {shape.direction[i - 1], shape.direction[i], side_when_folded, is_clamp};
  return joint_under(shape.moment[i], edges, bend, parameters.twist_stiffness_m4ps2 * per_length);
}

RodRest make_rod_rest(const RodShape& shape, const RodParameters& parameters, double stiffening) {
  RodRest rest;
  rest.stiffening = stiffening;
  rest.segment_m = shape.segment_m;
  rest.tension_m2ps2 = shape.tension_m2ps2;
  rest.mean_segment_m = shape.mean_segment_m;
  rest.shortest_m = shape.shortest_m;
  set_joints(shape, stiffened(parameters, stiffening), rest);
  const uint32_t tail = std::min(shape.tail_begin, shape.vertex_count() - 1);
  rest.tail_direction = shape.direction[tail];
  rest.tail_axis = rest.axis[tail];
  return rest;
}

SolverRow direct_rod_row() {
  SolverRow row;
  row.name = "direct_rod";
  row.summary =
      "elastic rod with the constants of hair: exact lengths, bending, twist, natural curvature, implicit";
  row.source =
      "Kirchhoff rod in vertices: bending as in Bergou et al., Discrete Elastic Rods, SIGGRAPH 2008, section "
      "4.2, with theta^2 for the curvature, and its quasi-static twist, section 5; frames carried in time as "
      "in Discrete Viscous Threads, SIGGRAPH 2010; tension as a multiplier, the banded solve and the clamp "
      "are "
      "ours";
  row.parameters = {
      {"radius_m", 5e-5, 1e-6, 1e-2, "m", "radius of the circular cross section"},
      {"density_kgpm3", 1300.0, 1.0, 1e5, "kg/m^3", "density"},
      {"young_modulus_pa", 3e9, 0.0, 1e16, "Pa", "Young's modulus; 0 = a chain"},
      {"poisson_ratio", 0.45, -0.9, 10.0, "",
       "twist softens with it: shear modulus = Young's modulus / (2 (1 + ratio)); measured hairs reach 1.2"},
      {"bending_damping_s", 2e-3, 0.0, 1.0, "s",
       "material damping: time by which bending and twisting moments lead"},
      {"tip_mass_kg", 0.0, 0.0, 1.0, "kg", "a bead at the tip"},
      {"air_drag_per_s", kWispDragPerS, 0.0, 1000.0, "1/s",
       "rate at which strands take on the velocity of the air: hair in a wisp of 5 mm, whose hairs shield "
       "each "
       "other; in a lock of 1 cm it is 1, of a single hair 10 to 25"},
      {"sag_free", 0.0, 0.0, 1.0, "",
       "share of the groom's weight that its rest shape carries: 1 = the groom as loaded is the equilibrium"},
      {"style_margin", kHangingMargin, 0.0, 10.0, "",
       "strands whose groomed shape would not last get the least stiffness with which it does: its softest "
       "motion then has this times g / length for its frequency squared; 1.446 = as a chain that hangs, 0 = "
       "real hair, which may leave its style"},
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
                            {"poisson_ratio", hair.poisson_ratio},
                            {"bending_damping_s", 0.0},
                            {"air_drag_per_s", 0.0}};
  };
  row.prepare = prepare_rod_style;
  row.make = make_direct_rod;
  row.make_reference = make_direct_rod_reference;
  return row;
}

}  // namespace strandcast
