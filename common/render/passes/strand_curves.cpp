#include "common/render/passes/strand_curves.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/render/strand_style.h"
#include "shaders/shared/bindings.h"

namespace strandcast {

StrandCurves::StrandCurves(const SceneAsset& asset, const FollowerDesc& followers, CurveMethod curve)
    : followers_(followers), curve_(curve) {
  // A follower between strands that a parting divides would hang across it.
  const std::vector<RootTriangle> triangles = joined_triangles(asset);
  if (triangles.empty()) followers_.per_triangle = 0;
  if (followers_.per_triangle > 0) root_triangle_ = gl::Buffer::of("root triangle", triangles);
}

gl::Variant StrandCurves::variant() const {
  return {{"HAS_FOLLOWERS", followers_.per_triangle > 0 ? 1 : 0}, {"CURVE", static_cast<int>(curve_)}};
}

void StrandCurves::set(const gl::Program& program, const KeyStrands& keys, const ExpandLevel& level) const {
  CHECK(level.followers <= followers_.per_triangle);
  keys.position().bind_storage(shader::kBindingKeyPosition);
  program.set("u_key_count", keys.strand_count());
  program.set("u_vertex_count", keys.vertex_count());
  if (followers_.per_triangle == 0) return;
  root_triangle_.bind_storage(shader::kBindingRootTriangle);
  program.set("u_followers", followers_.per_triangle);
  program.set("u_drawn", std::max(level.followers, 1u));
  program.set("u_clump", followers_.clump);
  program.set("u_variation_m", followers_.variation_m);
  program.set("u_shorten", followers_.shorten);
}

}  // namespace strandcast
