// What strandcast-server's --mocap means. Pure functions.
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
  double scale = 1.0;  // LiveDesc::scale
};

/// BadInput says what is meant instead.
Result<LiveDesc> parse_mocap(const std::string& text);

/// The scene with these inputs instead of its own, where any are given. `overrides` of live are applied
/// behind.
Result<SceneDesc> with_mocap(const SceneDesc& scene, const MocapOptions& options,
                             const std::vector<std::string>& overrides);

/// Whether an override is of live, and so waits for the inputs that the command line names.
bool is_live_override(const std::string& assignment);

}  // namespace strandcast
