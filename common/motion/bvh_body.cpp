#include "common/motion/bvh_body.h"

#include <algorithm>
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

bool is_head_name(std::string_view name) {
  constexpr std::string_view kDigits = "0123456789";
  while (!name.empty()) {
    const size_t separator = name.find_last_of(":_ .-|");
    std::string_view word = separator == std::string_view::npos ? name : name.substr(separator + 1);
    word = word.substr(0, word.find_last_not_of(kDigits) + 1);
    if (equals_ignoring_case(word, "head")) return true;
    // What may follow it: a number, the middle, what it is.
    const bool is_passed = word.empty() || equals_ignoring_case(word, "m") ||
                           equals_ignoring_case(word, "jnt") || equals_ignoring_case(word, "joint") ||
                           equals_ignoring_case(word, "bone");
    if (separator == std::string_view::npos || !is_passed) return false;
    name = name.substr(0, separator);
  }
  return false;
}

uint32_t top_of_performer(const std::vector<std::string>& joint_names, const std::vector<uint32_t>& parents,
                          uint32_t head) {
  const auto way_to = [&](uint32_t joint) {
    std::vector<uint32_t> way;
    for (; joint != kNoJoint; joint = parents[joint]) way.insert(way.begin(), joint);
    return way;
  };
  // A hammer's head is in a hand: no arm has a left and a right one.
  const auto has_sides = [&](uint32_t branch) {
    std::vector<std::string> names(joint_names.size());
    std::vector<uint8_t> is_below(joint_names.size());
    for (uint32_t i = branch; i < parents.size(); ++i) {
      is_below[i] = i == branch || (parents[i] != kNoJoint && is_below[parents[i]] != 0) ? 1 : 0;
      if (is_below[i] != 0) names[i] = joint_names[i];
    }
    return !sided_pairs(names).empty();
  };
  const std::vector<uint32_t> way = way_to(head);
  size_t top = 0;
  for (uint32_t i = 0; i < joint_names.size(); ++i) {
    if (!is_head_name(joint_names[i])) continue;
    const std::vector<uint32_t> other = way_to(i);
    const auto [mine, theirs] = std::mismatch(way.begin(), way.end(), other.begin(), other.end());
    if (mine == way.end() || theirs == other.end() || !has_sides(*mine) || !has_sides(*theirs)) continue;
    top = std::max(top, static_cast<size_t>(mine - way.begin()));
  }
  return way[top];
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
