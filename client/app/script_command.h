// Sub-commands of strandcast-ctl that are scripts of their own, installed beside it or in ../lib/strandcast.
#pragma once

#include <string>
#include <vector>

namespace strandcast {

/// Goes on as this script, with these words behind its name; returns kBadInputExit where it cannot be
/// started.
int run_script(const std::string& name, const std::vector<std::string>& words);

}  // namespace strandcast
