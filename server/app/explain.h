// What `strandcast-server` prints about itself: solvers, and for a scene its facts, passes, memory and times.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"
#include "server/scene/scene_content.h"

namespace strandcast {

/// Every solver with its parameters, ranges and source.
std::string list_solvers();

/// Milliseconds per pass, by its name in the plan; passes that were not run are missing.
using PassTimes = std::map<std::string, double>;

/// Runs a few steps of the scene in a GL context of its own and times its passes.
Result<PassTimes> measure_passes(const SceneDesc& scene, const SceneContent& content,
                                 const RuntimeFacts& facts, const std::string& gl_device,
                                 const std::optional<std::filesystem::path>& shader_folder);

/// Facts with reasons, then the plan: kept, not requested or unread, with bytes and milliseconds.
Result<std::string> explain_scene(const SceneDesc& scene, const SceneAsset& asset, const RuntimeFacts& facts,
                                  const PassTimes& times);

}  // namespace strandcast
