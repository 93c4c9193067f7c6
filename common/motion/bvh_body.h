// Finds joints of a body by their usual names, as CMU's files and most programs use them: neck, chest,
// shoulders and elbows, and which are a left and a right one. Any thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace strandcast {

/// Returns pairs of a joint name of the body presets (common/scene/body_desc.h) and its index in the file's
/// names. Joints without a usual name are missing. Case and a prefix ending in ':' or '_' are ignored.
std::vector<std::pair<std::string, size_t>> usual_body(const std::vector<std::string>& joint_names);

/// Returns pairs of indices of names that say left and right and are alike otherwise: "LeftFoot" and
/// "RightFoot", "thigh_l" and "thigh_r", "Bip01 L Hand" and "Bip01 R Hand", "lShldr" and "rShldr".
std::vector<std::pair<size_t, size_t>> sided_pairs(const std::vector<std::string>& joint_names);

/// Returns true for "Head", "mixamorig:Head", "joint_head", "Bip01 Head", "root.head", "Head1", "head_01",
/// "Head_M" and "C_head_JNT", not for "Head_End".
bool is_head_name(std::string_view name);

inline constexpr uint32_t kNoJoint = UINT32_MAX;

/// Returns the topmost joint of the performer with this head. Who shares a root with others begins below it:
/// their branches have heads, and left and right joints, of their own. `parents` come before their children.
uint32_t top_of_performer(const std::vector<std::string>& joint_names, const std::vector<uint32_t>& parents,
                          uint32_t head);

}  // namespace strandcast
