// What double-precision strands do about a head that is a distance field. Written from the geometry, without
// a line in common with shaders/sim/field_collider.comp.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "common/groom/distance_field.h"
#include "common/kernels/step_input.h"

namespace strandcast {

/// No vertex comes nearer to the skin, unless the groom has it there.
inline constexpr double kFieldClearanceM = 0.0005;

/// One strand after its substep, seen from the head: m in head space. Neck and chest are where the bust has
/// them.
struct ReferenceFieldStrand {
  std::span<const glm::dvec3> groomed_m;
  std::span<const glm::dvec3> before_m;  // where it was after the substep before
  uint32_t first = 1;                    // free vertex
  double friction = 0.0;                 // Coulomb coefficient
  std::span<glm::dvec3> position_m;
  BustInput bust = {};
};

/// Turns segments whose end or middle is too near to the skin about their start until they are not (two
/// rounds for the end, then one for the middle), at their lengths; ends are held by friction. What hangs on a
/// moved vertex follows it towards where it was. False when nothing had to move.
bool keep_out_of(const DistanceField& field, const ReferenceFieldStrand& strand);

/// The field of the skin as the bust has it: distance and its gradient at a place.
DistanceField::Sample sample_on_bust(const DistanceField& field, const BustInput& bust,
                                     const glm::dvec3& point_m);

/// The clearance of a point that the groom has there.
double field_clearance_m(const DistanceField& field, const glm::dvec3& groomed_m);

}  // namespace strandcast
