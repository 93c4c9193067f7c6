// Render paths: ways to draw a scene, each a list of passes over the same RenderScene. A path declares its
// passes; the renderer's list decides which of them run. No GL calls here.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/render/render_scene.h"
#include "common/render/render_turn.h"
#include "common/scene/shadow_methods.h"

namespace strandcast {

struct RenderPath {
  std::string name;
  std::string summary;
  /// Adds all passes in running order; the last one writes scene.picture.
  void (*add_passes)(RenderScene& scene, RenderPassList& passes);
  /// Samples per pixel side on which RenderTurn::view is based.
  uint32_t view_samples = 1;
  /// Methods that replace RenderScene::methods before passes are added; empty: those of the look.
  std::optional<RenderMethods> methods = std::nullopt;
};

/// The path of the main methods: strands with exact coverage, blended in tiles by compute kernels.
const RenderPath& tile_path();
/// The path that draws segments as camera-facing quads, with a depth test and a fixed coverage pattern.
const RenderPath& segment_path();
/// Returns whether a look names only main methods, which every renderer draws in its own way.
bool has_main_methods(const LookDesc& look);
/// Returns the path for a look: tiles if it names only main methods.
const RenderPath& path_for(const LookDesc& look);
/// Returns the segment path with other methods, which must be combinable.
RenderPath segment_path_with(const RenderMethods& methods);

}  // namespace strandcast
