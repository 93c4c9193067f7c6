// Render paths: ways to draw a scene, each a list of passes over the same RenderScene. A path declares its
// passes; what runs of them, the renderer's list decides. No GL calls in here.
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
  /// Adds all passes in the order in which they run; the last one writes scene.picture.
  void (*add_passes)(RenderScene& scene, RenderPassList& passes);
  /// Samples per pixel side that RenderTurn::view counts.
  uint32_t view_samples = 1;
  /// For RenderScene::methods, before passes are added; none: those of the look.
  std::optional<RenderMethods> methods = std::nullopt;
};

/// Strands as exact coverage, blended in tiles by compute kernels: the main methods.
const RenderPath& tile_path();
/// Segments of strands as camera-facing quads with a depth test and a fixed pattern of coverage.
const RenderPath& segment_path();
/// Whether a look names nothing but what every renderer draws in its own best way.
bool has_main_methods(const LookDesc& look);
/// What draws a look: tiles where it names no other methods than the main ones.
const RenderPath& path_for(const LookDesc& look);
/// The same quads with other methods, which go together.
RenderPath segment_path_with(const RenderMethods& methods);

}  // namespace strandcast
