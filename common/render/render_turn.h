// What render passes are given: once to be prepared, and anew in each draw.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

#include "common/gl/pass_list.h"
#include "common/gl/program.h"
#include "common/render/view.h"
#include "common/strands/posed_strands.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

struct RenderSetup {
  const gl::ShaderLibrary& shaders;
  const SceneAsset& asset;
};

struct RenderTurn : gl::PassTurn {
  using Setup = RenderSetup;
  RenderTurn(const PosedStrands& drawn, const View& seen, glm::uvec2 size)
      : strands(drawn), view(seen), size_px(size) {}

  const PosedStrands& strands;
  View view;
  glm::uvec2 size_px;  // of the picture; view.target_px counts the samples
  // Counted by the passes.
  uint64_t drawn_strands = 0;
  uint64_t drawn_segments = 0;
};

using RenderPass = gl::Pass<RenderTurn>;
using RenderPassList = gl::PassList<RenderTurn>;

}  // namespace strandcast
