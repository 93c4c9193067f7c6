// Passes of the frame thread: it follows the strand frames, paints and encodes. Values, any thread.
#pragma once

#include <array>

#include "common/base/profile.h"
#include "common/gl/pass_list.h"
#include "common/pictures/picture.h"
#include "common/render/render_device.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

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
