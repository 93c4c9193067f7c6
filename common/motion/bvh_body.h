// Which joints of a clip are neck, chest, shoulders and elbows, by the names that captures give them: those
// of the CMU files and of most programs. Any thread.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace strandcast {

/// Pairs of a name that body presets know (common/scene/body_desc.h) and an index into the names of a file;
/// what has no usual name is not there. A prefix ending in ':' or '_' does not count, nor does case.
std::vector<std::pair<std::string, size_t>> usual_body(const std::vector<std::string>& joint_names);

}  // namespace strandcast
