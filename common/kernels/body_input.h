// BodyInput: what of a body strands are kept out of in one substep: capsules and planes in head space, where
// they are and where they were. Plain data, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

inline constexpr size_t kMaxBodyCapsules = 16;
inline constexpr size_t kMaxBodyPlanes = 4;

/// What strands do about it.
enum class BodyResponse : uint32_t {
  Turn,     // segments turn about their start, at their length, onto the plane that touches the body
  Sphere,   // likewise, but onto the sphere under them: Woodhouse, figure 4.1 in closed form
  Project,  // vertices move out the shortest way, whatever their segments' lengths
  Force     // velocities gain with depth, as Sams has it, 3.3
};
/// Names of the responses in scenes, in the order of their numbers.
inline constexpr std::array kBodyResponses = {"turn", "sphere", "project", "force"};

/// No vertex comes nearer to the body, unless it began there.
inline constexpr double kBodyClearanceM = 0.0005;

/// Two balls and what is between them; equal ends are one ball.
struct BodyCapsule {
  glm::dvec3 from_m{0.0}, to_m{0.0};                // at the end of the substep
  glm::dvec3 from_before_m{0.0}, to_before_m{0.0};  // at its beginning
  double from_radius_m = 0.05, to_radius_m = 0.05;

  bool operator==(const BodyCapsule&) const = default;
};

/// Strands stay on the side that the normal points to.
struct BodyPlane {
  glm::dvec3 point_m{0.0};
  glm::dvec3 normal{0.0, 1.0, 0.0};  // unit
  glm::dvec3 shift_m{0.0};           // of its surface along itself during the substep

  bool operator==(const BodyPlane&) const = default;
};

struct BodyInput {
  std::vector<BodyCapsule> capsules;  // at most kMaxBodyCapsules
  std::vector<BodyPlane> planes;      // at most kMaxBodyPlanes
  BodyResponse response = BodyResponse::Turn;
  double friction = 0.3;  // Coulomb coefficient
  double tip_clearance_m = kBodyClearanceM;
  double force_per_s2 = 0.0;  // of BodyResponse::Force
  /// Whether it was not there before: strands that begin inside of it keep their depth.
  bool is_new = false;

  bool acts() const { return !capsules.empty() || !planes.empty(); }
  bool operator==(const BodyInput&) const = default;
};

}  // namespace strandcast
