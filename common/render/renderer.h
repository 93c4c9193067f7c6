// Renderer: draws pictures for the server's picture stream and for every client, by running the passes of a
// render path (render_path.h). Equal inputs on one driver give equal pixels. Needs a current GL 4.5 core
// context; all calls from its thread. Does not simulate, decode or do I/O.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "common/base/picture_size.h"
#include "common/base/result.h"
#include "common/gl/egl_context.h"
#include "common/gl/pass_list.h"
#include "common/gl/program.h"
#include "common/pictures/image_codec.h"
#include "common/render/render_path.h"
#include "common/render/render_turn.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Measurements of the last draw.
struct RenderProfile {
  double total_ms = 0.0;  // of all passes
  uint64_t drawn_strands = 0;
  uint64_t drawn_segments = 0;
  bool is_whole = true;             // nobody gave it up half-way
  uint64_t left_out_fragments = 0;  // pieces of strands for which a method's memory was too small
  uint64_t left_out_strands = 0;    // for which there was no room, evenly
  uint64_t unusable_segments = 0;   // with a position that is no number

  bool operator==(const RenderProfile&) const = default;
};

/// Describes for a person what a picture lacks; empty if it is complete.
std::string left_out_text(const RenderProfile& profile);

class Renderer {
 public:
  /// Makes a renderer; compiles, allocates and uploads only what asset and look need. `asset` must outlive
  /// the renderer, since set_look() reads it.
  static Result<std::unique_ptr<Renderer>> make(const gl::ShaderLibrary& shaders,
                                                const gl::DeviceInfo& device, const SceneAsset& asset,
                                                const LookDesc& look,
                                                const RenderPath& path = segment_path());
  virtual ~Renderer() = default;

  /// Draws into an internal target of the given size with 2 x 2 samples per pixel, resolved to sRGB. Strands
  /// far thinner than a pixel are replaced by fewer and wider ones. BadInput or LimitExceeded for impossible
  /// input.
  virtual Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
                      const DrawTerms& terms = {}) = 0;
  /// Changes the look from the next draw on; pixels are those of a renderer made with this look. After an
  /// error the previous look stays.
  virtual Status set_look(const LookDesc& look) = 0;
  /// Returns the pixels of the last draw, top row first.
  virtual Image read_image() = 0;
  virtual const RenderProfile& profile() const = 0;
  /// Returns all passes, including those that do not run.
  virtual const gl::PassListBase& passes() const = 0;
};

/// Checks the inputs of a draw for every renderer. Returns BadInput or LimitExceeded for what none draws.
Status check_draw(const PosedStrands& strands, size_t position_count, RenderSize size,
                  const DrawTerms& terms);

/// Returns the passes that a renderer for these inputs would run, without any GL.
Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, bool is_software,
                                      const RenderPath& path = segment_path());

}  // namespace strandcast
