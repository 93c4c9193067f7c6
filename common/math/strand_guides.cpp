#include "common/math/strand_guides.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

/// Strands by their roots that are looked at for the nearest in shape. Else hair beside a parting is guided
/// from its other side.
constexpr uint32_t kCandidates = 10;
/// How much a difference in shape counts beside one of the roots, both as squared distances.
constexpr float kShapeWeight = 1.0f;
/// Nearer than this two strands are one, m.
constexpr float kSameStrandM = 1e-3f;

}  // namespace

std::vector<StrandGuides> choose_guides(std::span<const glm::vec3> rest_m, uint32_t vertex_count,
                                        uint32_t guide_count) {
  CHECK(vertex_count > 0 && guide_count > 0 && rest_m.size() % vertex_count == 0);
  const size_t strand_count = rest_m.size() / vertex_count;
  CHECK(guide_count <= strand_count);
  const PointTree roots(rest_m.first(guide_count));
  // Mean square of how far apart two strands are with their roots in one place.
  const auto shape_squared = [&](size_t a, size_t b) {
    float sum = 0.0f;
    for (size_t v = 1; v < vertex_count; ++v) {
      const glm::vec3* here = rest_m.data() + v * strand_count;
      const glm::vec3 apart_m = (here[a] - rest_m[a]) - (here[b] - rest_m[b]);
      sum += glm::dot(apart_m, apart_m);
    }
    return vertex_count > 1 ? sum / static_cast<float>(vertex_count - 1) : 0.0f;
  };
  std::vector<StrandGuides> all(strand_count - guide_count);
  for (size_t i = 0; i < all.size(); ++i) {
    const size_t strand = guide_count + i;
    std::vector<PointTree::Neighbour> near = roots.nearest(rest_m[strand], kCandidates);
    for (PointTree::Neighbour& guide : near)
      guide.distance_squared += kShapeWeight * shape_squared(strand, guide.index);
    std::sort(near.begin(), near.end());
    float sum = 0.0f;
    for (size_t g = 0; g < std::min<size_t>(kGuidesOfStrand, near.size()); ++g) {
      all[i].strand[g] = near[g].index;
      all[i].weight[g] = 1.0f / (near[g].distance_squared + kSameStrandM * kSameStrandM);
      sum += all[i].weight[g];
    }
    for (float& weight : all[i].weight) weight /= sum;
  }
  return all;
}

}  // namespace strandcast
