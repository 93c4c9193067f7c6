// What the frame thread runs, as passes: it follows the strand frames, paints, and codes. Values, any thread.
#pragma once

#include <array>

#include "common/base/profile.h"
#include "common/gl/pass_list.h"
#include "common/pictures/picture.h"
#include "common/render/render_device.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Of the frame thread's own work; its painter has its own.
struct PictureTimers {
  StageTimer decode;                                       // strand frames
  std::array<StageTimer, kPictureCodecs.size()> encode{};  // by codec
};

/// `painted`: what the painter runs. A codec that is not `wanted` runs for nobody.
gl::PassReports picture_passes(const PictureTimers& timers, const gl::PassReports& painted,
                               PictureCodecs wanted);

/// The same before there is a frame thread. BadInput for an asset that cannot be drawn.
Result<gl::PassReports> plan_picture_passes(const SceneAsset& asset, const LookDesc& look, RendererKind kind,
                                            PictureCodecs wanted);

}  // namespace strandcast
