// Sub-commands of strandcast-ctl that are separate scripts, installed beside it or in ../lib/strandcast.
#pragma once

#include <string>
#include <vector>

namespace strandcast {

/// Replaces this process by the script with these arguments; returns kBadInputExit if it cannot be started.
int run_script(const std::string& name, const std::vector<std::string>& words);

}  // namespace strandcast
