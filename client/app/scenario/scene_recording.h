// Records a scene that a server of our own simulates in lockstep, as fast as it can: every state has a frame.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

struct SceneRecordingOptions {
  std::filesystem::path scene;         // scene file or hair file; empty: the built-in scene
  std::vector<std::string> overrides;  // "path=value"
  std::string motion = "builtin";      // builtin, still, none or a BVH file
  std::string wind = "gusts";          // gusts, none or a CSV file
  double seconds = 10.0;               // of simulation
  std::filesystem::path server;        // the program; empty: strandcast-server beside this one
};

/// Makes the recording `out` in an existing folder. BadInput for a wrong scene or motion, NotFound without a
/// server program, Unavailable with the server's words if it fails or if `stop` is set.
Status record_scene(const SceneRecordingOptions& options, const std::filesystem::path& out,
                    const std::atomic<bool>& stop);

}  // namespace strandcast
