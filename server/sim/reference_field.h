// Collision of double-precision strands with a head's distance field. Written from the geometry, without
// sharing code with shaders/sim/field_collider.comp.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "common/groom/distance_field.h"
#include "common/kernels/step_input.h"

namespace strandcast {

/// Smallest distance of a vertex from the skin, unless the groom has it closer.
inline constexpr double kFieldClearanceM = 0.0005;

/// One strand after its substep, in head space (m). Neck and chest are where the bust has them.
struct ReferenceFieldStrand {
  std::span<const glm::dvec3> groomed_m;
  std::span<const glm::dvec3> before_m;  // where it was after the substep before
  uint32_t first = 1;                    // free vertex
  double friction = 0.0;                 // Coulomb coefficient
  std::span<glm::dvec3> position_m;
  BustInput bust = {};
};

/// Rotates segments about their starts until end and middle have their clearance: rounds for the end, until
/// it is there from either side, then one for the middle. Lengths are kept, and friction holds ends and
/// middles. The part beyond a moved vertex follows it towards its former position. Returns false if nothing
/// had to move.
bool keep_out_of(const DistanceField& field, const ReferenceFieldStrand& strand);

/// Samples the field of the skin in the bust's pose: distance and its gradient at a place.
DistanceField::Sample sample_on_bust(const DistanceField& field, const BustInput& bust,
                                     const glm::dvec3& point_m);

/// Returns the clearance of a point with this groomed position.
double field_clearance_m(const DistanceField& field, const glm::dvec3& groomed_m);

}  // namespace strandcast
