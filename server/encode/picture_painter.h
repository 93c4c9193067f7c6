// PicturePainter: turns a decoded snapshot into pixels. Made, used and destroyed on the frame thread.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/codec/image_codec.h"
#include "common/codec/scene_asset.h"
#include "common/codec/snapshot.h"
#include "common/scene/scene_desc.h"
#include "server/encode/picture_views.h"

namespace strandcast {

class PicturePainter {
 public:
  virtual ~PicturePainter() = default;
  virtual Result<Image> paint(const Snapshot& snapshot, const PictureView& view) = 0;
};

using MakePicturePainter = std::function<Result<std::unique_ptr<PicturePainter>>()>;

struct GlPainterConfig {
  std::string gl_device = "auto";                      // as EglContext::make
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
  std::shared_ptr<const SceneAsset> asset;
  LookDesc look;
};

/// A maker of painters with a GL context of their own and the renderer of common/render.
MakePicturePainter gl_picture_painter(GlPainterConfig config);

}  // namespace strandcast
