// Collision of double-precision strands with a body of capsules and planes. Written from the geometry,
// without sharing code with shaders/sim/body_collider.comp.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>

#include "common/kernels/body_input.h"

namespace strandcast {

/// Returns the distance of a point from the body, m; negative inside, huge without a body.
double distance_to_body_m(const BodyInput& body, const glm::dvec3& point_m);
double distance_to_capsule_m(const BodyCapsule& capsule, const glm::dvec3& point_m);

/// One strand after its substep, in head space (m).
struct ReferenceBodyStrand {
  std::span<const glm::dvec3> before_m;  // where it was after the substep before
  std::span<const double> arc;           // 0 at the root, 1 at the tip
  uint32_t first = 1;                    // free vertex
  std::span<double> clearance_m;         // that a vertex has had; read and written
  std::span<glm::dvec3> position_m;
};

/// Moves a strand out of the body by rotating segments (BodyResponse::Turn and Sphere) or moving vertices
/// (Project). Returns false if nothing had to move.
bool keep_out_of(const BodyInput& body, const ReferenceBodyStrand& strand);

}  // namespace strandcast
