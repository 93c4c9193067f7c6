// HeadsPainter: draws the server's pictures of several heads: the head whose viewers ask for them, and beside
// it all other heads in their newest published states. (A viewer sees decoded states, which are within the
// announced bound.) Made, used and destroyed on the frame thread of its head.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "server/encode/picture_painter.h"
#include "server/stream/stream_hub.h"

namespace strandcast {

/// Data about another head that a painter needs. The hub must outlive the painter.
struct PaintedHead {
  StreamHub* hub = nullptr;
  std::shared_ptr<const SceneAsset> asset;
};

/// Returns a maker of painters with a device of their own, for the head of `config`. `scene_camera`: shows
/// all heads. `others`: returns the other heads when a painter is made. `on_news`: is called by the
/// publishing thread when another head has moved.
MakePicturePainter heads_picture_painter(PainterConfig config, const CameraDesc& scene_camera,
                                         std::function<std::vector<PaintedHead>()> others,
                                         std::function<void()> on_news);

}  // namespace strandcast
