// Measures how well the drawn head, its colliders and the hair agree. Pure functions, any thread.
#pragma once

#include <string>
#include <vector>

#include "common/groom/distance_field.h"
#include "common/groom/groom.h"
#include "common/groom/mesh.h"
#include "common/kernels/body_input.h"

namespace strandcast {

/// Skin closer than this to a vertex of the groom as loaded counts as under hair.
inline constexpr float kUnderHairM = 0.02f;

struct HeadMeasure {
  double root_median_m = 0.0, root_most_m = 0.0;  // from the roots to the drawn skin: half, 95 %
  // From the drawn skin under hair to the spheres, either way: of half, of 95 % of its area.
  double sphere_median_m = 0.0, sphere_most_m = 0.0;
  double deepest_vertex_m = 0.0;  // of the groom inside the spheres; 0 when none is
};

/// Measures a head; `spheres` are its collision spheres (head_spheres.h).
HeadMeasure measure_head(const Mesh& head, const std::vector<FittedSphere>& spheres, const Groom& groom);

/// Describes the measure: "half of the roots lie within 1.2 mm of the skin ..."
std::string to_sentence(const HeadMeasure& measure, size_t sphere_count);

/// Vertices of a groom as loaded that lie inside a head with a distance field; the field leaves them there.
struct HairInside {
  size_t vertex_count = 0;  // free ones
  size_t strand_count = 0;  // that have such
  double deepest_m = 0.0;
};
HairInside measure_inside(const DistanceField& field, const Groom& groom);
/// Counts vertices inside a body's shapes at the end of the substep.
HairInside measure_inside(const BodyInput& body, const Groom& groom);
/// Describes the count: "the body has 6 capsules; no free vertex of the hair as loaded lies inside of them"
std::string to_sentence(const HairInside& inside, size_t capsule_count);

/// Describes field and count: "the head collides as a distance field of 55 x 69 x 37 nodes, 7.2 mm apart; 12
/// free vertices ..."
std::string to_sentence(const HairInside& inside, const DistanceField& field);

}  // namespace strandcast
