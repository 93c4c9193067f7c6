// Strand pass: a camera-facing quad per expanded segment, shaded by the model that the look names, covered by
// a fixed pattern instead of sorted blending. All calls from the context's thread.
#pragma once

#include <memory>

#include "common/render/passes/strand_buffers.h"
#include "common/render/render_scene.h"
#include "common/render/render_turn.h"

namespace strandcast {

std::unique_ptr<RenderPass> make_strand_pass(RenderScene& scene, ExpandedStrands& expanded);

}  // namespace strandcast
