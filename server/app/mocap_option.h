// Parses strandcast-server's option --mocap, and places of its form. Pure functions.
#pragma once

#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/live_desc.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct MocapOptions {
  std::vector<std::string> inputs;  // PROTOCOL, PROTOCOL:PORT or PROTOCOL://HOST[:PORT]
  std::string subject;              // of all of them
  std::string axes;
  std::string timecode;  // how the spare word of freed counts frames; empty = it does not
  double scale = 1.0;    // LiveDesc::scale
};

/// Parses one value of --mocap, or of another `option` of that form. BadInput explains the accepted forms.
Result<LiveDesc> parse_mocap(const std::string& text, const char* option = "--mocap");

/// Returns the scene with the given inputs instead of its own; unchanged if there are none. `overrides` of
/// live inputs are applied afterwards.
Result<SceneDesc> with_mocap(const SceneDesc& scene, const MocapOptions& options,
                             const std::vector<std::string>& overrides);

/// Returns whether an override concerns live inputs, so that it must be applied after --mocap.
bool is_live_override(const std::string& assignment);

}  // namespace strandcast
