// StatedGroom: strands of a groom file with the units and axes that the file states. Plain data.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/groom/groom.h"

namespace strandcast {

struct StatedGroom {
  Groom groom;                  // in file units
  std::optional<float> unit_m;  // metres per file unit; empty: the file does not say
  std::optional<bool> is_z_up;  // as GroomPlacement; empty: the file does not say
  std::string unit_reason;      // where the file says it: "its metersPerUnit says so"
  std::string up_axis_reason;
  std::vector<std::string> notes;  // a sentence for each thing about the file that a person should know
};

}  // namespace strandcast
