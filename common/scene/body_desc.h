// BodyDesc: description of the body under the head: planes, capsules between joints of the motion stream or
// points in head space, and the response of strands. Plain data, any thread.
#pragma once

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "common/kernels/body_input.h"

namespace strandcast {

struct BodyCapsuleDesc {
  std::string from_joint;  // of the motion stream; empty: from_m is a place in head space
  std::string to_joint = {};
  glm::dvec3 from_m{0.0};  // from the joint, along the axes of head space
  glm::dvec3 to_m{0.0};
  double from_radius_m = 0.05;
  double to_radius_m = 0.05;

  bool operator==(const BodyCapsuleDesc&) const = default;
};

struct BodyPlaneDesc {
  glm::dvec3 point_m{0.0, -0.25, 0.0};  // head space
  glm::dvec3 normal{0.0, 1.0, 0.0};     // hair stays on this side; of any length
  glm::dvec3 velocity_mps{0.0};         // of its surface, along itself, as a belt's

  bool operator==(const BodyPlaneDesc&) const = default;
};

inline constexpr const char* kNoBody = "none";
inline constexpr const char* kUpperBody = "upper_body";

struct BodyDesc {
  std::string preset = kNoBody;  // capsules that need not be listed: kNoBody or kUpperBody
  std::vector<BodyCapsuleDesc> capsules = {};
  std::vector<BodyPlaneDesc> planes = {};
  std::string response = kBodyResponses[0];
  double friction = 0.3;  // Coulomb coefficient
  /// Distance that vertices keep: kBodyClearanceM at the root, growing to this value at the tip (growing
  /// spheres of Nalu).
  double tip_clearance_m = kBodyClearanceM;
  double force_per_s2 = 1800.0;  // of the response "force": acceleration per depth
  /// Offset from a captured joint to its position under this head: captured heads are held at the top of the
  /// spine, this one in its middle.
  glm::dvec3 joint_offset_m{0.0, -0.09, -0.02};

  bool acts() const { return preset != kNoBody || !capsules.empty() || !planes.empty(); }
  bool operator==(const BodyDesc&) const = default;
};

/// Joint names that sources use (common/motion/body_joints.h) and that presets know.
inline constexpr const char* kNeckJoint = "neck";
inline constexpr const char* kChestJoint = "chest";
inline constexpr const char* kLeftShoulderJoint = "left_shoulder";
inline constexpr const char* kRightShoulderJoint = "right_shoulder";
inline constexpr const char* kLeftElbowJoint = "left_elbow";
inline constexpr const char* kRightElbowJoint = "right_elbow";

/// A capsule of a scene and its name for people.
struct NamedCapsule {
  std::string field;  // "body.capsules.2", "body.preset upper_body"
  BodyCapsuleDesc capsule;
};
/// Returns the preset's capsules followed by the scene's own; at most kMaxBodyCapsules.
std::vector<NamedCapsule> capsules_of(const BodyDesc& body);
/// Returns the number of capsules of a preset; kMaxBodyCapsules + 1 for an unknown one.
size_t preset_size(const std::string& preset);

/// Observed positions of joints by name; head space.
struct JointPlaces {
  std::vector<std::string> name;
  std::vector<glm::dvec3> place_m;  // as many

  bool operator==(const JointPlaces&) const = default;
};
inline constexpr size_t kMaxMotionJoints = 12;
inline constexpr size_t kMaxJointNameBytes = 32;
/// Greatest plausible distance of a joint from the head's joint; farther ones are ignored.
inline constexpr double kMaxJointDistanceM = 10.0;

/// Positions of a body's shapes whose joints are known. Head space.
struct BodyShapes {
  std::vector<BodyCapsule> capsules;  // as long as now, so before; in the order of capsules_of()
  std::vector<std::string> missing;   // joints that capsules need, with their fields, a sentence for each
};
BodyShapes shapes_of(const BodyDesc& body, const JointPlaces& joints);

}  // namespace strandcast
