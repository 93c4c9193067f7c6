// Chooses how finely a picture is drawn by its size on the screen: fewer segments where bends are invisible,
// fewer and wider strands where they are too thin to see. Pure functions, any thread.
#pragma once

#include <cstdint>

#include "common/render/render_scene.h"
#include "common/render/render_turn.h"
#include "common/render/view.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// Properties of a scene that decide and do not change between pictures.
struct DetailFacts {
  uint32_t key_count = 0;
  uint32_t vertex_count = 0;  // of each
  uint32_t triangle_count = 0;
  float mean_length_m = 0.0f;  // of a key strand at rest
  float mean_bend_m = 0.0f;    // likewise: RestFacts
  uint64_t max_points = 0;     // of all drawn strands
  bool is_finest = false;      // all followers and segments of the look, whatever the size of the picture
};

/// Resolution of one picture.
struct StrandDetail {
  uint32_t segments_per_gap = 1;  // >= 1
  uint32_t followers = 0;         // per triangle, at most those of the look
  uint32_t strand_count = 0;      // the first of keys and followers
};

/// Returns the facts of a scene except the limits.
DetailFacts detail_facts(const RenderScene& scene);
/// Returns the number of key strands plus `followers` followers per triangle.
uint32_t strand_count(const DetailFacts& facts, uint32_t followers);
/// Returns the largest number of points of a strand.
uint32_t points_per_strand(const DetailFacts& facts, const StrandDetail& detail);
/// Returns the width at the root of a picture's strands: if fewer are drawn, each is wider. `drawn` > 0.
float drawn_width_m(const DetailFacts& facts, const LookDesc& look, uint32_t drawn);
StrandDetail choose_detail(const DetailFacts& facts, const LookDesc& look, const View& view,
                           const DrawTerms& terms);

/// Returns how many more strands would be drawn than `detail` says, if DetailFacts::max_points were not a
/// limit.
uint32_t strands_without_room(const DetailFacts& facts, const LookDesc& look, const View& view,
                              const DrawTerms& terms, const StrandDetail& detail);

}  // namespace strandcast
