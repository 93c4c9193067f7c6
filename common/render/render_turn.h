// Arguments of render passes: those of preparation, and those of each draw.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/glm.hpp>

#include "common/gl/pass_list.h"
#include "common/gl/program.h"
#include "common/render/debug_view.h"
#include "common/render/view.h"
#include "common/strands/posed_strands.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

struct Image;

struct RenderSetup {
  const gl::ShaderLibrary& shaders;
  const SceneAsset& asset;
};

/// Options of a draw: permitted loss of detail, abortion, debug view and backdrop.
struct DrawTerms {
  /// Share of the picture's strands that is drawn, in (0, 1]. Fewer strands are drawn wider, so that the
  /// total width is the same.
  float strand_share = 1.0f;
  /// Asked between batches of strands, which are small if it is set; true abandons the picture. Empty: never.
  std::function<bool()> is_unwanted;
  /// View shown instead of hair; renderers without this view draw hair.
  DebugView debug_view = DebugView::None;
  /// Picture shown where nothing is drawn, instead of the look's background. It has the picture's size and
  /// outlives the draw. Null: the background.
  const Image* backdrop = nullptr;
};

struct RenderTurn : gl::PassTurn {
  using Setup = RenderSetup;
  RenderTurn(const PosedStrands& drawn, const View& seen, glm::uvec2 size, const DrawTerms& wanted)
      : strands(drawn), view(seen), size_px(size), terms(wanted) {}

  const PosedStrands& strands;
  View view;
  glm::uvec2 size_px;  // of the picture; view.target_px counts the samples
  const DrawTerms& terms;
  float strands_shown = 1.0f;  // of the pixels: they show strands, the others what stands for them
  // Counted by the passes.
  uint64_t drawn_strands = 0;
  uint64_t drawn_segments = 0;
  bool is_whole = true;
  uint64_t left_out_fragments = 0;
  uint64_t left_out_strands = 0;
  uint64_t unusable_segments = 0;
};

using RenderPass = gl::Pass<RenderTurn>;
using RenderPassList = gl::PassList<RenderTurn>;

}  // namespace strandcast
