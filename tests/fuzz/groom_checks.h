// What every groom that a loader gives must stand, hostile files included.
#pragma once

#include <cmath>

#include "common/base/check.h"
#include "common/groom/groom.h"
#include "common/groom/groom_file.h"
#include "common/groom/resample.h"
#include "common/groom/tip_first.h"
#include "common/groom/usable_strands.h"

namespace strandcast {

inline void check_loaded_groom(const Groom& read) {
  // Readers of formats that state nothing leave this to their caller; a second time nothing is found.
  const auto usable = with_usable_strands({.groom = read});
  if (!usable) return;
  const Groom& groom = usable->groom;
  CHECK(groom.strand_count() >= 1 && groom.strand_count() <= kMaxStrandCount);
  CHECK(groom.offset.front() == 0 && groom.offset.back() == groom.rest_position_m.size());
  CHECK(groom.pinned.size() == groom.rest_position_m.size());
  CHECK(groom.root_uv.empty() || groom.root_uv.size() == groom.strand_count());
  for (uint32_t s = 0; s < groom.strand_count(); ++s) {
    CHECK(groom.vertex_count(s) >= kMinVertexCount && groom.vertex_count(s) <= kMaxSourceVertexCount);
    CHECK(groom.pinned[groom.offset[s]] == 1);
  }
  constexpr size_t kManyVertices = 2'000;  // more only cost time here
  if (groom.rest_position_m.size() > kManyVertices) return;
  const float unit_m = guess_unit_m(groom);
  CHECK(unit_m > 0.0f);
  CHECK(std::abs(guess_yaw_deg(groom).value) <= 180.0f);
  (void)guess_up(groom);
  Groom turned = groom;
  StrandLabels labels;
  if (turn_tips_first(turned, labels).empty()) CHECK(turned.rest_position_m == groom.rest_position_m);
  if (!validate(groom)) return;
  const Groom uniform = resample(groom, 5);
  CHECK(uniform.uniform_vertex_count() == 5 && validate(uniform).ok());
  for (const RootTriangle& triangle : make_root_triangles(uniform))
    for (int i = 0; i < 3; ++i) CHECK(triangle[i] < uniform.strand_count());
  CHECK(reorder(uniform, make_prefix_order(uniform)).strand_count() == uniform.strand_count());
}

}  // namespace strandcast
