// PicturePainter: turns a decoded snapshot into pixels. Made, used and destroyed on the frame thread, whose
// passes are here, too.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>

#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/gl/pass_list.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/picture.h"
#include "common/render/render_device.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"
#include "common/strands/snapshot.h"
#include "server/encode/picture_views.h"

namespace strandcast {

class PicturePainter {
 public:
  virtual ~PicturePainter() = default;
  /// Paints a snapshot. It is shared so that a painter can keep the last one and recognise it by identity,
  /// since ticks repeat after a reset. BadInput and LimitExceeded concern this view alone; after any other
  /// error nothing can be painted any more.
  virtual Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) = 0;
  /// Changes the look from the next picture on. After an error the previous look stays and painting
  /// continues.
  virtual Status set_look(const LookDesc&) { return {}; }
  /// Returns the measurements of the newest picture.
  virtual RenderProfile profile() const { return {}; }
  /// Returns the passes that the painter runs.
  virtual gl::PassReports passes() const { return {}; }
};

using MakePicturePainter = std::function<Result<std::unique_ptr<PicturePainter>>()>;

struct PainterConfig {
  RenderDeviceConfig device;
  std::shared_ptr<const SceneAsset> asset;
  LookDesc look;
};

/// Returns the report line of the copy from the device to the processor.
gl::PassReport read_back_report(const StageTimer& timer);

/// Returns a maker of painters with a device of their own (common/render/render_device.h).
MakePicturePainter device_picture_painter(PainterConfig config);

/// Timers of the frame thread's own work; the painter has its own.
struct PictureTimers {
  StageTimer decode;                                       // strand frames
  std::array<StageTimer, kPictureCodecs.size()> encode{};  // by codec
};

/// Returns the passes; `painted` are those of the painter. Codecs that are not in `wanted` do not run.
gl::PassReports picture_passes(const PictureTimers& timers, const gl::PassReports& painted,
                               PictureCodecs wanted);

/// Returns the passes before there is a frame thread. BadInput for an asset that cannot be drawn.
Result<gl::PassReports> plan_picture_passes(const SceneAsset& asset, const LookDesc& look, RendererKind kind,
                                            PictureCodecs wanted);

}  // namespace strandcast
