#include "common/motion/bvh_skeleton.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/motion/bvh.h"

namespace strandcast {
namespace {

constexpr uint32_t kMaxJointChannels = 6;
constexpr double kMaxChannelValue = 1e9;

class HierarchyParser {
 public:
  explicit HierarchyParser(TextCursor& cursor) : cursor_(cursor) {}

  /// Reads from HIERARCHY up to and including the word MOTION.
  Result<BvhSkeleton> parse() {
    if (!equals_ignoring_case(cursor_.next_token(), "HIERARCHY"))
      return cursor_.fail(ErrorCode::BadInput, "a BVH file begins with HIERARCHY");
    for (;;) {
      const auto word = cursor_.next_token();
      if (equals_ignoring_case(word, "MOTION")) break;
      if (!equals_ignoring_case(word, "ROOT")) return unexpected(word, "ROOT or MOTION");
      RETURN_IF_ERROR(parse_joint_head(kNoJoint));
      RETURN_IF_ERROR(parse_tree());
    }
    if (skeleton_.joints.empty()) return cursor_.fail(ErrorCode::BadInput, "the hierarchy has no ROOT");
    return std::move(skeleton_);
  }

 private:
  Error unexpected(std::string_view word, const char* expected) const {
    if (word.empty())
      return cursor_.fail(ErrorCode::BadInput, "the file ends where {} is expected", expected);
    return cursor_.fail(ErrorCode::BadInput, "found \"{}\" where {} is expected", shown(word), expected);
  }

  /// Name and opening brace. The name is the rest of the line: it may hold blanks.
  Status parse_joint_head(uint32_t parent) {
    std::string_view name = cursor_.rest_of_line();
    const bool has_brace = name.ends_with('{');
    if (has_brace) name = trim(name.substr(0, name.size() - 1));
    if (skeleton_.joints.size() >= kMaxBvhJoints)
      return cursor_.fail(ErrorCode::LimitExceeded, "more than {} joints", kMaxBvhJoints);
    BvhJoint joint;
    joint.name = std::string(name);
    joint.parent = parent;
    joint.first_channel = skeleton_.channel_count;
    skeleton_.joints.push_back(std::move(joint));
    return has_brace ? Status{} : expect_brace();
  }

  Status expect_brace() {
    const auto word = cursor_.next_token();
    return word == "{" ? Status{} : Status(unexpected(word, "{"));
  }

  /// Body of a root and everything under it, up to its closing brace. A loop, so that depth costs no stack.
  Status parse_tree() {
    std::vector<uint32_t> open{static_cast<uint32_t>(skeleton_.joints.size() - 1)};  // kNoJoint = an end site
    while (!open.empty()) {
      const auto word = cursor_.next_token();
      const bool is_end_site = open.back() == kNoJoint;
      if (word == "}") {
        open.pop_back();
      } else if (equals_ignoring_case(word, "OFFSET")) {
        ASSIGN_OR_RETURN(const glm::dvec3 offset, parse_offset());
        if (is_end_site)
          skeleton_.end_sites.push_back({open[open.size() - 2], offset});
        else
          skeleton_.joints[open.back()].offset = offset;
      } else if (equals_ignoring_case(word, "CHANNELS") && !is_end_site) {
        RETURN_IF_ERROR(parse_channels(open.back()));
      } else if (equals_ignoring_case(word, "JOINT") && !is_end_site) {
        if (open.size() >= kMaxBvhDepth)
          return cursor_.fail(ErrorCode::LimitExceeded, "joints nest deeper than {}", kMaxBvhDepth);
        RETURN_IF_ERROR(parse_joint_head(open.back()));
        open.push_back(static_cast<uint32_t>(skeleton_.joints.size() - 1));
      } else if (equals_ignoring_case(word, "End") && !is_end_site) {
        const auto site = cursor_.next_token();
        if (!equals_ignoring_case(site, "Site")) return unexpected(site, "Site");
        RETURN_IF_ERROR(expect_brace());
        open.push_back(kNoJoint);
      } else {
        return unexpected(word, "OFFSET, CHANNELS, JOINT, End Site or }");
      }
    }
    return {};
  }

  Result<glm::dvec3> parse_offset() {
    glm::dvec3 offset{0.0};
    for (int axis = 0; axis < 3; ++axis) {
      const auto word = cursor_.next_token();
      const auto value = bvh_number(word);
      if (!value) return unexpected(word, "a number (OFFSET takes three)");
      offset[axis] = *value;
    }
    return offset;
  }

  Status parse_channels(uint32_t joint_index) {
    BvhJoint& joint = skeleton_.joints[joint_index];
    if (!joint.channels.empty())
      return cursor_.fail(ErrorCode::BadInput, "a second CHANNELS for joint {}", shown(joint.name));
    const auto word = cursor_.next_token();
    const auto count = parse_number(word);
    if (!count || *count < 0 || *count > kMaxJointChannels || *count != std::floor(*count))
      return unexpected(word, "a channel count within 0 .. 6");
    joint.first_channel = skeleton_.channel_count;
    for (int i = 0; i < static_cast<int>(*count); ++i) {
      const auto name = cursor_.next_token();
      BvhChannel channel;
      channel.is_rotation = name.size() > 1 && equals_ignoring_case(name.substr(1), "rotation");
      const bool is_position = name.size() > 1 && equals_ignoring_case(name.substr(1), "position");
      const size_t axis = name.empty() ? std::string::npos : std::string_view("XYZxyz").find(name[0]);
      if (axis == std::string::npos || !(channel.is_rotation || is_position))
        return unexpected(name, "a channel name (Xposition .. Zrotation)");
      channel.axis = static_cast<uint8_t>(axis % 3);
      joint.channels.push_back(channel);
    }
    skeleton_.channel_count += static_cast<uint32_t>(joint.channels.size());
    return {};
  }

  TextCursor& cursor_;
  BvhSkeleton skeleton_;
};

/// The name of a joint, "Head#2" for the second of that name: performers may be named alike.
std::string label_of(const BvhSkeleton& skeleton, uint32_t joint) {
  const std::string& name = skeleton.joints[joint].name;
  const auto before = std::count_if(skeleton.joints.begin(), skeleton.joints.begin() + joint,
                                    [&](const BvhJoint& other) { return other.name == name; });
  return before == 0 ? name : fmt::format("{}#{}", name, before + 1);
}

}  // namespace

std::optional<double> bvh_number(std::string_view word) {
  std::optional<double> value = parse_number(word);
  if (!value && std::count(word.begin(), word.end(), ',') == 1) {
    std::string pointed(word);
    pointed[pointed.find(',')] = '.';
    value = parse_number(pointed);
  }
  return value && std::abs(*value) <= kMaxChannelValue ? value : std::nullopt;
}

Result<BvhSkeleton> parse_bvh_skeleton(TextCursor& cursor) {
  return HierarchyParser(cursor).parse();
}

std::string known_joints(const BvhSkeleton& skeleton) {
  std::string known;
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i)
    known += fmt::format("{}{}", known.empty() ? "" : ", ", shown(label_of(skeleton, i)));
  return known;
}

Result<uint32_t> find_head(const BvhSkeleton& skeleton, const std::string& wanted) {
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i) {
    const std::string& name = skeleton.joints[i].name;
    if (wanted.empty() ? is_head_name(name) : name == wanted || label_of(skeleton, i) == wanted) return i;
  }
  return make_error(ErrorCode::NotFound, "no joint named {} (--joint NAME takes another, known: {})",
                    wanted.empty() ? "Head or head" : shown(wanted), known_joints(skeleton));
}

uint32_t find_moving_head(TextCursor rows, const BvhSkeleton& skeleton, uint32_t head) {
  constexpr size_t kMostRows = 2'000;
  constexpr double kStill = 1e-3;  // degrees, or units of the file
  const BvhPath way = path_to(skeleton, head);
  std::vector<BvhPath> others;
  std::vector<uint32_t> other_heads;
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i) {
    if (!is_head_name(skeleton.joints[i].name)) continue;
    const BvhPath other = path_to(skeleton, i);
    const auto [mine, theirs] = std::mismatch(way.begin(), way.end(), other.begin(), other.end());
    if (mine == way.end() || theirs == other.end()) continue;
    others.emplace_back(theirs, other.end());
    other_heads.push_back(i);
  }
  if (others.empty()) return head;
  std::vector<double> low(skeleton.channel_count, std::numeric_limits<double>::max());
  std::vector<double> high(skeleton.channel_count, std::numeric_limits<double>::lowest());
  for (size_t row = 0; row < kMostRows; ++row) {
    auto line = rows.next_line();
    if (!line) break;
    for (size_t i = 0; i < low.size(); ++i) {
      const auto value = bvh_number(take_token(*line));
      low[i] = std::min(low[i], value.value_or(low[i]));
      high[i] = std::max(high[i], value.value_or(high[i]));
    }
  }
  const auto moves = [&](const BvhJoint* joint) {
    for (size_t i = joint->first_channel; i < joint->first_channel + joint->channels.size(); ++i)
      if (high[i] - low[i] > kStill) return true;
    return false;
  };
  if (std::any_of(way.begin(), way.end(), moves)) return head;
  for (size_t i = 0; i < others.size(); ++i)
    if (std::any_of(others[i].begin(), others[i].end(), moves)) return other_heads[i];
  return head;
}

uint32_t find_top(const BvhSkeleton& skeleton, uint32_t head) {
  std::vector<std::string> names;
  std::vector<uint32_t> parents;
  for (const BvhJoint& joint : skeleton.joints) {
    names.push_back(joint.name);
    parents.push_back(joint.parent);
  }
  return top_of_performer(names, parents, head);
}

bool is_own(const BvhSkeleton& skeleton, uint32_t joint) {
  while (joint != skeleton.top && joint != kNoJoint) joint = skeleton.joints[joint].parent;
  return joint == skeleton.top;
}

std::string taken_head(const BvhSkeleton& skeleton, uint32_t head) {
  std::string others;
  for (uint32_t i = 0; i < skeleton.joints.size(); ++i) {
    if (!is_head_name(skeleton.joints[i].name) || is_own(skeleton, i)) continue;
    others += fmt::format("{}{}", others.empty() ? "" : ", ", shown(label_of(skeleton, i)));
  }
  if (others.empty())
    return fmt::format("the head is {} (--joint takes another)", shown(label_of(skeleton, head)));
  return fmt::format("of several performers the one with {} is taken, others have {} (--joint takes another)",
                     shown(label_of(skeleton, head)), others);
}

BvhPath path_to(const BvhSkeleton& skeleton, uint32_t joint_index) {
  BvhPath path;
  for (; joint_index != kNoJoint; joint_index = skeleton.joints[joint_index].parent)
    path.push_back(&skeleton.joints[joint_index]);
  std::reverse(path.begin(), path.end());
  return path;
}

BvhPath own_path(const BvhSkeleton& skeleton, uint32_t joint_index) {
  BvhPath path = path_to(skeleton, joint_index);
  path.erase(path.begin(), std::find(path.begin(), path.end(), &skeleton.joints[skeleton.top]));
  return path;
}

}  // namespace strandcast
