// What render passes are given: once to be prepared, and anew in each draw.
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

/// What of the detail may be missing, and when to give up.
struct DrawTerms {
  /// Of the strands that a picture of this size shows, in (0, 1]: fewer, which together are as wide.
  float strand_share = 1.0f;
  /// Asked between batches of strands, which are small then: true leaves the picture unfinished. Empty:
  /// never.
  std::function<bool()> is_unwanted;
  /// Instead of hair; renderers that have none draw hair.
  DebugView debug_view = DebugView::None;
  /// Seen where nothing is drawn, instead of the look's background: a picture of the same size, which
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
