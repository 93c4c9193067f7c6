// The hierarchy of a BVH file: its joints, and whose head is taken of several performers. Input is untrusted:
// bvh.h has the limits. Private to common/motion.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/motion/bvh_body.h"
#include "common/motion/text_cursor.h"

namespace strandcast {

struct BvhChannel {
  bool is_rotation = false;
  uint8_t axis = 0;
};

struct BvhJoint {
  std::string name;
  uint32_t parent = kNoJoint;
  glm::dvec3 offset{0.0};
  std::vector<BvhChannel> channels;
  uint32_t first_channel = 0;
};

struct BvhEndSite {
  uint32_t parent = kNoJoint;
  glm::dvec3 offset{0.0};
};

struct BvhSkeleton {
  std::vector<BvhJoint> joints;  // parents before children
  std::vector<BvhEndSite> end_sites;
  uint32_t channel_count = 0;
  uint32_t top = 0;  // of the performer whose head is taken
};

using BvhPath = std::vector<const BvhJoint*>;  // each joint below the one before it

/// Returns a number within bounds, also with the decimal comma of some programs.
std::optional<double> bvh_number(std::string_view word);

/// Reads from HIERARCHY up to and including the word MOTION.
Result<BvhSkeleton> parse_bvh_skeleton(TextCursor& cursor);

/// Lists all joints by names that are told apart, for errors.
std::string known_joints(const BvhSkeleton& skeleton);

/// Returns the joint of that name, or the first that is named like a head; NotFound lists the joints.
Result<uint32_t> find_head(const BvhSkeleton& skeleton, const std::string& wanted);

/// Returns that head, or the first one beside it that moves, where it does not: of a reference pose that was
/// exported with the character, say. `rows` is before the first frame.
uint32_t find_moving_head(TextCursor rows, const BvhSkeleton& skeleton, uint32_t head);

/// Returns the topmost joint of the performer with that head.
uint32_t find_top(const BvhSkeleton& skeleton, uint32_t head);

/// Returns whether a joint is of the performer whose head is taken.
bool is_own(const BvhSkeleton& skeleton, uint32_t joint);

/// Says which joint is taken as the head, and whose, where the file has several performers.
std::string taken_head(const BvhSkeleton& skeleton, uint32_t head);

/// Returns the joints from the root down to that one.
BvhPath path_to(const BvhSkeleton& skeleton, uint32_t joint_index);

/// Returns those from the performer's topmost joint on.
BvhPath own_path(const BvhSkeleton& skeleton, uint32_t joint_index);

}  // namespace strandcast
