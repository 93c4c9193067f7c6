#include "common/render/strand_detail.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/constants.hpp>
#include <limits>

#include "common/render/passes/expand_pass.h"
#include "common/render/strand_style.h"

namespace strandcast {
namespace {

// Another segment is worth it where even with it chords are this far off the curve of a strand that bends as
// most do: with two or more they are about 0.3 px off at most. For strands thinner than about kThinnestPx
// stand fewer and wider ones.
constexpr float kBendErrorPx = 0.16f;
constexpr float kThinnestPx = 0.45f;
// Hair in motion bends at least so much from vertex to vertex, however straight it is at rest.
constexpr float kLeastBendRad = 0.25f;

/// At least one, where the limit allows it. A size that is not a number takes the least detail.
uint32_t at_most(float wanted, uint32_t limit) {
  return wanted > 1.0f ? static_cast<uint32_t>(std::min(std::ceil(wanted), static_cast<float>(limit)))
                       : std::min(1u, limit);
}

/// How far a strand of the look bends between two vertices: as its keys, and by waves and frizz on top.
float bend_m(const DetailFacts& facts, const LookDesc& look, float gap_m) {
  const StyleNumbers style = style_numbers(look, facts.mean_length_m);
  const float gaps = static_cast<float>(std::max(facts.vertex_count, 2u) - 1);
  // They grow along the strand; half of their size stands for all of it.
  const auto of_waves = [&](float size_m, float count) {
    const float turn = glm::two_pi<float>() * count / gaps;
    return 0.5f * size_m * turn * turn;
  };
  const float keys_m = std::max(facts.mean_bend_m, kLeastBendRad * gap_m);
  return glm::length(glm::vec3(keys_m, of_waves(style.wave_m, style.wave_count),
                               of_waves(style.frizz_m, style.frizz_count)));
}

}  // namespace

DetailFacts detail_facts(const RenderScene& scene) {
  DetailFacts facts;
  facts.key_count = scene.key_strands.strand_count();
  facts.vertex_count = scene.key_strands.vertex_count();
  facts.triangle_count = scene.triangle_count;
  facts.mean_length_m = scene.rest.mean_length_m;
  facts.mean_bend_m = scene.rest.mean_bend_m;
  return facts;
}

uint32_t strand_count(const DetailFacts& facts, uint32_t followers) {
  return facts.key_count + facts.triangle_count * followers;
}

uint32_t points_per_strand(const DetailFacts& facts, const StrandDetail& detail) {
  return (std::max(facts.vertex_count, 2u) - 1) * detail.segments_per_gap + 2;
}

float drawn_width_m(const DetailFacts& facts, const LookDesc& look, uint32_t drawn) {
  const uint32_t all = strand_count(facts, look.followers);
  return 2.0f * look.strand_radius_m * static_cast<float>(all) / static_cast<float>(drawn);
}

StrandDetail choose_detail(const DetailFacts& facts, const LookDesc& look, const View& view,
                           const DrawTerms& terms) {
  StrandDetail detail;
  const uint32_t max_followers = facts.triangle_count > 0 ? look.followers : 0;
  const float px_per_m = view.focal_px / view.target_distance_m;
  const float gap_m = facts.mean_length_m / static_cast<float>(std::max(facts.vertex_count, 2u) - 1);
  const float width_px = 2.0f * look.strand_radius_m * px_per_m;
  // A chord of 1 / n of a gap is off its curve by an eighth of the second derivative over n^2.
  constexpr float kEighth = 0.125f;
  const float segments = std::sqrt(kEighth * bend_m(facts, look, gap_m) * px_per_m / kBendErrorPx);
  detail.segments_per_gap = at_most(std::floor(segments), look.segments);
  const float followers = std::floor(static_cast<float>(max_followers) * width_px / kThinnestPx + 0.5f);
  detail.followers = at_most(followers, max_followers);
  if (facts.is_finest) {
    detail.segments_per_gap = kMaxSegmentsPerGap;
    detail.followers = max_followers;
  }
  detail.strand_count = strand_count(facts, detail.followers);
  if (terms.strand_share < 1.0f) {
    // Followers of all triangles first, then key strands: any first so many of those cover the head evenly.
    const auto wanted = std::max(
        1u, static_cast<uint32_t>(std::ceil(terms.strand_share * static_cast<float>(detail.strand_count))));
    while (detail.followers > 0 && strand_count(facts, detail.followers) > wanted) --detail.followers;
    detail.strand_count = std::min(strand_count(facts, detail.followers), wanted);
  }
  const auto points = [&] { return uint64_t{points_per_strand(facts, detail)}; };
  while (detail.followers > 0 && detail.strand_count * points() > facts.max_points)
    detail.strand_count = strand_count(facts, --detail.followers);
  if (detail.strand_count * points() > facts.max_points * 2) detail.segments_per_gap = 1;
  detail.strand_count =
      static_cast<uint32_t>(std::min<uint64_t>(detail.strand_count, facts.max_points / points()));
  return detail;
}

uint32_t strands_without_room(const DetailFacts& facts, const LookDesc& look, const View& view,
                              const DrawTerms& terms, const StrandDetail& detail) {
  DetailFacts roomy = facts;
  roomy.max_points = std::numeric_limits<uint64_t>::max() / 2;
  const uint32_t wanted = choose_detail(roomy, look, view, terms).strand_count;
  return wanted - std::min(wanted, detail.strand_count);
}

}  // namespace strandcast
