#include "common/motion/bvh_body.h"

#include <array>
#include <string_view>

#include "common/motion/text_cursor.h"

namespace strandcast {
namespace {

/// Names in the order in which they are looked for. "LeftShoulder" is a collar bone beside a "LeftArm", and a
/// shoulder beside a "LeftCollar".
struct UsualJoint {
  const char* name;
  std::array<const char*, 5> in_files;
};
constexpr UsualJoint kUsualJoints[] = {
    {"neck", {"lowerneck", "Neck"}},
    {"chest", {"Chest2", "Spine3", "Spine2", "Spine1", "Chest"}},
    {"left_shoulder", {"LeftArm", "LeftUpperArm", "lShldr", "L UpperArm", "LeftShoulder"}},
    {"right_shoulder", {"RightArm", "RightUpperArm", "rShldr", "R UpperArm", "RightShoulder"}},
    {"left_elbow", {"LeftForeArm", "LeftLowerArm", "lForeArm", "L Forearm", "LeftElbow"}},
    {"right_elbow", {"RightForeArm", "RightLowerArm", "rForeArm", "R Forearm", "RightElbow"}},
};

/// "Neck" of "mixamorig:Neck" and "Bip01 Neck", "L UpperArm" of "Bip01 L UpperArm".
std::string_view without_prefix(std::string_view name) {
  size_t separator = name.find_last_of(":_");
  if (separator == std::string_view::npos) separator = name.find(' ');
  return separator == std::string_view::npos ? name : name.substr(separator + 1);
}

}  // namespace

std::vector<std::pair<std::string, size_t>> usual_body(const std::vector<std::string>& joint_names) {
  std::vector<std::pair<std::string, size_t>> found;
  for (const UsualJoint& joint : kUsualJoints) {
    bool is_found = false;
    for (const char* wanted : joint.in_files)
      for (size_t i = 0; i < joint_names.size() && wanted != nullptr && !is_found; ++i) {
        if (!equals_ignoring_case(without_prefix(joint_names[i]), wanted)) continue;
        found.emplace_back(joint.name, i);
        is_found = true;
      }
  }
  return found;
}

}  // namespace strandcast
