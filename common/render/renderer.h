// The one renderer, used by the server's picture stream and by every client: expands key strands and
// followers by tessellation (isolines, cubic Hermite along the strand, barycentric between three key
// strands), draws camera-facing quads with Kajiya-Kay diffuse and Sadeghi specular lobes, and the head. Same
// inputs on one driver give the same pixels. Needs a current GL 4.5 core context; all calls from its thread.
// Does not simulate, decode or do I/O.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/base/picture_size.h"
#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/gl/egl_context.h"
#include "common/gl/program.h"
#include "common/pictures/image_codec.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Milliseconds of the last draw, by pass.
struct RenderProfile {
  double expand_ms = 0.0;  // light volume, upload and tessellation
  double strands_ms = 0.0;
  double head_ms = 0.0;
  double resolve_ms = 0.0;
  uint64_t drawn_strands = 0;
  uint64_t drawn_segments = 0;
};

class Renderer {
 public:
  /// Compiles, allocates and uploads only what asset and look need.
  static Result<std::unique_ptr<Renderer>> make(const gl::ShaderLibrary& shaders,
                                                const gl::DeviceInfo& device, const SceneAsset& asset,
                                                const LookDesc& look);
  virtual ~Renderer() = default;

  /// Draws into an internal target of the given size with 2 x 2 samples per pixel, resolved to sRGB. Strands
  /// far thinner than a pixel are replaced by fewer and wider ones. BadInput or LimitExceeded for impossible
  /// input.
  virtual Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size) = 0;
  /// Pixels of the last draw, top row first.
  virtual Image read_image() = 0;
  /// Copies the last draw to the framebuffer object `target` (0 = window), scaled to its size.
  virtual void blit_to(uint32_t target, RenderSize target_size) = 0;
  virtual const RenderProfile& profile() const = 0;
};

}  // namespace strandcast
