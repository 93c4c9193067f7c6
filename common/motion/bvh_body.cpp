#include "common/motion/bvh_body.h"

#include <array>
#include <map>
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

enum class Side { None, Left, Right };

/// The side that a name says, and the rest of the name.
std::pair<Side, std::string> sided(const std::string& name) {
  constexpr std::string_view kSeparators = ":_ .";
  const auto is_upper = [](char c) { return c >= 'A' && c <= 'Z'; };
  std::string small = name;
  for (char& c : small) c = is_upper(c) ? static_cast<char>(c - 'A' + 'a') : c;
  for (const auto& [side, word] : {std::pair(Side::Left, "left"), {Side::Right, "right"}})
    if (const size_t found = small.find(word); found != std::string::npos)
      return {side, small.erase(found, std::string_view(word).size())};
  const auto side_of = [](char letter) { return letter == 'l' ? Side::Left : Side::Right; };
  const auto is_separator = [&](size_t i) {
    return i >= small.size() || kSeparators.find(small[i]) != std::string_view::npos;
  };
  for (size_t i = 0; i < small.size(); ++i) {
    if (small[i] != 'l' && small[i] != 'r') continue;
    const bool begins = i == 0 || is_separator(i - 1);
    const bool is_letter = begins && is_separator(i + 1);
    // "lShldr" and "LHip", but not "Lo" or "root".
    const bool is_prefix = begins && i + 1 < name.size() && is_upper(name[i + 1]);
    if (!is_letter && !is_prefix) continue;
    const Side side = side_of(small[i]);
    return {side, small.erase(i, 1)};
  }
  return {Side::None, small};
}

}  // namespace

std::vector<std::pair<size_t, size_t>> sided_pairs(const std::vector<std::string>& joint_names) {
  std::map<std::string, size_t> left;
  std::vector<std::pair<size_t, size_t>> pairs;
  for (size_t i = 0; i < joint_names.size(); ++i)
    if (const auto [side, rest] = sided(joint_names[i]); side == Side::Left) left.emplace(rest, i);
  for (size_t i = 0; i < joint_names.size(); ++i) {
    const auto [side, rest] = sided(joint_names[i]);
    const auto other = left.find(rest);
    if (side == Side::Right && other != left.end()) pairs.emplace_back(other->second, i);
  }
  return pairs;
}

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
