#include "common/render/drawn_strands.h"

#include <algorithm>

#include "common/render/look_lights.h"
#include "common/render/passes/expand_pass.h"
#include "common/render/render_scene.h"
#include "common/render/tiles/light_lookup.h"
#include "common/strands/strand_limits.h"

namespace strandcast {
namespace {

// 256 MiB, as in a picture.
constexpr uint64_t kMostDrawnPoints = uint64_t{8} << 20;

struct DressArguments {
  const ShadingNumbers* look;
  float width_m, tip_scale, tip_fade;
  const StrandPoints* points;
  DrawnStrands* drawn;
};

/// Widths and colours by the laws that pictures are shaded with.
STRANDCAST_LANES void dress_strands_lanes(const DressArguments& a) {
  using namespace law;
  const HairLook look = hair_look(*a.look);
  for (uint32_t strand = 0; strand < a.points->strand_count(); ++strand) {
    const uint32_t first = a.points->first_point[strand];
    const uint32_t count = a.points->first_point[strand + 1] - first;
    const HairStrand hair = hair_strand(Uint(a.points->index[strand]), Uint(a.points->lock[strand]), look);
    const Float along_step = 1.0f / static_cast<float>(count > 1 ? count - 1 : 1);
    for (uint32_t k = 0; k < count; k += kLanes) {
      const Float along = min((lane_numbers() + Float(static_cast<float>(k))) * along_step, 1.0f);
      const Float width = a.width_m * (1.0f + (a.tip_scale - 1.0f) * along * along) *
                          strand_cover(along, along_step, a.tip_fade);
      const vec3 color = hair_color(look, hair, along);
      const uint32_t lanes = count - k < kLanes ? count - k : kLanes;
      for (uint32_t lane = 0; lane < lanes; ++lane) {
        a.drawn->width_m[first + k + lane] = width.v[lane];
        a.drawn->color[first + k + lane] = {color.x.v[lane], color.y.v[lane], color.z.v[lane]};
      }
    }
  }
}
STRANDCAST_KERNEL(dress_strands, DressArguments);

}  // namespace

DrawnHair::DrawnHair(const SceneAsset& asset, const LookDesc& look, const DetailFacts& facts)
    : look_(look), facts_(facts), expansion_(asset, facts.mean_length_m) {
  expansion_.set_look(look);
  detail_.segments_per_gap = std::clamp(look.segments, 1u, kMaxSegmentsPerGap);
  detail_.followers = facts.triangle_count > 0 ? look.followers : 0;
  detail_.strand_count = strandcast::strand_count(facts, detail_.followers);
}

Result<DrawnHair> DrawnHair::make(const SceneAsset& asset, const LookDesc& look) {
  RETURN_IF_ERROR(check_asset(asset));
  const RenderScene scene(asset, look, true);
  DrawnHair hair(asset, scene.look, detail_facts(scene));
  if (uint64_t{hair.detail_.strand_count} * points_per_strand(hair.facts_, hair.detail_) > kMostDrawnPoints)
    return make_error(ErrorCode::LimitExceeded,
                      "{} drawn strands are more than {} points; set look.followers lower",
                      hair.detail_.strand_count, kMostDrawnPoints);
  return hair;
}

DrawnStrands DrawnHair::strands(const std::vector<glm::vec3>& position_m) {
  DrawnStrands drawn;
  if (detail_.strand_count == 0) return drawn;
  const simd::InstructionSet set = simd::widest_set();
  expansion_.expand(position_m, detail_, shared_workers(), set, points_);
  drawn.first_point = points_.first_point;
  for (const StrandPoint& point : points_.point) drawn.position_m.emplace_back(point.x, point.y, point.z);
  drawn.width_m.resize(points_.point.size());
  drawn.color.resize(points_.point.size());
  ShadingNumbers look = shading_numbers(look_);
  look.root_darkening = 0.0f;  // it stands for the shadow of other hair
  dress_strands(set, {&look, drawn_width_m(facts_, look_, detail_.strand_count), look_.tip_scale,
                      look_.style.tip_fade, &points_, &drawn});
  return drawn;
}

}  // namespace strandcast
