// GroomParts: judges the files of one head of hair by where their roots lie. Finds a file in another unit
// than the others. Any thread.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

/// One file of a head of hair.
struct GroomPart {
  std::filesystem::path path;
  StatedGroom stated;
};

/// Brings parts into one unit. What files state of it counts first. A part that states none is scaled where
/// its roots lie on the head of the largest part in another common unit, and in its own do not. Returns what
/// cannot be told: empty, or a sentence for --check.
std::string unify_units(std::vector<GroomPart>& parts);

}  // namespace strandcast
