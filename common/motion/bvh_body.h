// Finds neck, chest, shoulders and elbows among a clip's joints by their usual names, as CMU's files and most
// programs use them. Any thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace strandcast {

/// Returns pairs of a joint name of the body presets (common/scene/body_desc.h) and its index in the file's
/// names. Joints without a usual name are missing. Case and a prefix ending in ':' or '_' are ignored.
std::vector<std::pair<std::string, size_t>> usual_body(const std::vector<std::string>& joint_names);

}  // namespace strandcast
