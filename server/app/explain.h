// Texts that `strandcast-server` prints about itself: its solvers, and a scene's facts, passes, memory and
// times.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/gl/pass_list.h"
#include "common/scene/features.h"
#include "common/strands/scene_asset.h"
#include "server/scene/scene_content.h"

namespace strandcast {

/// Lists every solver with its parameters, ranges and source.
std::string list_solvers();

inline constexpr int kMeasuredSteps = 13;

struct MeasureConfig {
  std::string sim_device = "auto";                     // as ExecutorConfig
  std::string gl_device = "auto";                      // as EglContext::make
  std::string renderer = "auto";                       // as RenderDeviceConfig
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
};

struct Measured {
  std::string sim_device;  // for people: what simulated
  gl::PassReports passes;
  double step_ms = 0.0;  // median of the steps
};

/// Plans the passes of a server with these viewers and runs the needed ones a few times, on an executor and a
/// renderer of its own.
Result<Measured> measure_passes(const SceneDesc& scene, const SceneContent& content,
                                const RuntimeFacts& facts, const MeasureConfig& config);

/// Returns what the scene's solver states about the groom, one sentence each.
Result<std::vector<std::string>> explain_groom(const SceneDesc& scene, const Groom& groom);

/// Returns the quality and its reason, the facts with theirs, the solver's notes on the groom, and the device
/// that simulated if it was measured. The passes follow: kept, not requested or unread, with bytes and
/// milliseconds.
Result<std::string> explain_scene(const SceneDesc& scene, const SceneAsset& asset, const RuntimeFacts& facts,
                                  const Measured& measured, const std::vector<std::string>& groom_notes = {});

}  // namespace strandcast
