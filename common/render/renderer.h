// The one renderer, used by the server's picture stream and by every client: runs the passes of a render path
// (render_path.h) over what it is given. Same inputs on one driver give the same pixels. Needs a current GL
// 4.5 core context; all calls from its thread. Does not simulate, decode or do I/O.
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

/// Of the last draw.
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

/// What a picture lacks, in words for people; empty when it has everything.
std::string left_out_text(const RenderProfile& profile);

class Renderer {
 public:
  /// Compiles, allocates and uploads only what asset and look need. `asset` outlives calls of set_look().
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
  /// From the next draw on; its pixels are then those of a renderer that was made with this look. On an error
  /// the look of before stays.
  virtual Status set_look(const LookDesc& look) = 0;
  /// Pixels of the last draw, top row first.
  virtual Image read_image() = 0;
  virtual const RenderProfile& profile() const = 0;
  /// The passes as they run, and those that do not.
  virtual const gl::PassListBase& passes() const = 0;
};

/// What every renderer refuses to draw. BadInput or LimitExceeded.
Status check_draw(const PosedStrands& strands, size_t position_count, RenderSize size,
                  const DrawTerms& terms);

/// The passes that a renderer of this would run, without any GL.
Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, bool is_software,
                                      const RenderPath& path = segment_path());

}  // namespace strandcast
