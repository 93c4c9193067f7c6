#include "common/scene/body_desc.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

namespace strandcast {
namespace {

/// Half widths of a grown-up's neck, shoulders, arms and chest (common/groom/head_field.cpp has the same
/// bust).
std::vector<BodyCapsuleDesc> upper_body() {
  constexpr double kNeckM = 0.055, kCollarM = 0.055, kShoulderM = 0.055, kElbowM = 0.042, kChestM = 0.105;
  // Up to below the nape's hair, and the chest's front no further forward than the sternum's.
  const glm::dvec3 towards_head(0.0, 0.065, 0.0), into_back(0.0, -0.02, 0.0);
  const auto between = [](const char* from, const char* to, double from_m, double to_m) {
    return BodyCapsuleDesc{from, to, glm::dvec3(0.0), glm::dvec3(0.0), from_m, to_m};
  };
  BodyCapsuleDesc neck = between(kNeckJoint, kNeckJoint, kNeckM, kNeckM);
  neck.to_m = towards_head;
  BodyCapsuleDesc chest = between(kChestJoint, kNeckJoint, kChestM, kCollarM);
  chest.from_m = into_back;
  return {neck,
          chest,
          between(kNeckJoint, kLeftShoulderJoint, kCollarM, kShoulderM),
          between(kNeckJoint, kRightShoulderJoint, kCollarM, kShoulderM),
          between(kLeftShoulderJoint, kLeftElbowJoint, kShoulderM, kElbowM),
          between(kRightShoulderJoint, kRightElbowJoint, kShoulderM, kElbowM)};
}

}  // namespace

size_t preset_size(const std::string& preset) {
  if (preset == kNoBody) return 0;
  return preset == kUpperBody ? upper_body().size() : kMaxBodyCapsules + 1;
}

std::vector<NamedCapsule> capsules_of(const BodyDesc& body) {
  std::vector<NamedCapsule> named;
  if (body.preset == kUpperBody)
    for (const BodyCapsuleDesc& capsule : upper_body())
      named.push_back({fmt::format("body.preset {}", body.preset), capsule});
  for (size_t i = 0; i < body.capsules.size() && named.size() < kMaxBodyCapsules; ++i)
    named.push_back({fmt::format("body.capsules.{}", i), body.capsules[i]});
  return named;
}

BodyShapes shapes_of(const BodyDesc& body, const JointPlaces& joints) {
  BodyShapes shapes;
  for (const auto& [field, desc] : capsules_of(body)) {
    const auto place = [&](const std::string& joint, const glm::dvec3& offset_m,
                           const char* end) -> std::optional<glm::dvec3> {
      if (joint.empty()) return offset_m;
      const auto found = std::find(joints.name.begin(), joints.name.end(), joint);
      if (found != joints.name.end())
        return joints.place_m[static_cast<size_t>(found - joints.name.begin())] + body.joint_offset_m +
               offset_m;
      std::string sentence =
          field.starts_with("body.preset")
              ? fmt::format("{}: the motion stream has no joint \"{}\"", field, joint)
              : fmt::format("{}.{}: the motion stream has no joint \"{}\"", field, end, joint);
      if (std::find(shapes.missing.begin(), shapes.missing.end(), sentence) == shapes.missing.end())
        shapes.missing.push_back(std::move(sentence));
      return std::nullopt;
    };
    const auto from_m = place(desc.from_joint, desc.from_m, "from_joint");
    const auto to_m = place(desc.to_joint, desc.to_m, "to_joint");
    if (!from_m || !to_m) continue;
    shapes.capsules.push_back({*from_m, *to_m, *from_m, *to_m, desc.from_radius_m, desc.to_radius_m});
  }
  for (std::string& sentence : shapes.missing)
    sentence += joints.name.empty() ? std::string(" (it has none)")
                                    : fmt::format(" (it has {})", fmt::join(joints.name, ", "));
  return shapes;
}

}  // namespace strandcast
