// HeadsPainter: the server's pictures of several heads: draws the head whose viewers ask for them, and beside
// it all others of the server as they were published last (not as a viewer decodes them: that is within the
// announced bound). Made, used and destroyed on the frame thread of its head.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "server/encode/picture_painter.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

/// What a painter has to know of another head. The hub outlives the painter.
struct PaintedHead {
  StreamHub* hub = nullptr;
  std::shared_ptr<const SceneAsset> asset;
};

/// A maker of painters with a device of their own, for the head of `config`. `scene_camera`: from which all
/// heads are to be seen. `others`: asked when a painter is made. `on_news`: another head has moved; called by
/// whoever publishes it.
MakePicturePainter heads_picture_painter(PainterConfig config, const CameraDesc& scene_camera,
                                         std::function<std::vector<PaintedHead>()> others,
                                         std::function<void()> on_news);

}  // namespace strandcast
