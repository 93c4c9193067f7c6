#include "common/strands/asset/triangles.h"

#include <algorithm>
#include <bit>
#include <cstdint>

#include "common/base/check.h"
#include "common/math/point_tree.h"
#include "common/strands/asset/numbers.h"
#include "common/strands/wrapping.h"

namespace strandcast::asset {
namespace {

/// Writes or reads triangles. Returns false where a corner is no root.
template <class Coder>
bool code_triangles(Coder& coder, std::span<const glm::vec3> roots_m, std::span<RootTriangle> triangles) {
  constexpr uint32_t kSeen = 24;  // near roots, the first corner's own among them
  constexpr uint32_t kFirstKind = 0, kRankKind = 1;
  constexpr uint32_t kUsualRank = 2, kUsualStep = 1;
  const PointTree tree(roots_m);
  const auto root_count = static_cast<uint32_t>(roots_m.size());
  const auto index_bits = static_cast<uint32_t>(std::bit_width(root_count));
  std::vector<PointTree::Neighbour> near;
  uint32_t first = 0;
  for (RootTriangle& triangle : triangles) {
    if (coder.is_short()) return true;
    int32_t step = 0;
    if constexpr (!Coder::kReads) step = static_cast<int32_t>(triangle[0] - first);
    coder.code(step, kFirstKind, kUsualStep);
    first = static_cast<uint32_t>(wrapping_sum(static_cast<int32_t>(first), step));
    if (first >= root_count) return false;
    triangle[0] = first;
    if (near.empty() || step != 0) near = tree.nearest(roots_m[first], kSeen);
    for (int corner = 1; corner < 3; ++corner) {
      uint32_t rank = 0;  // beyond those that are seen
      if constexpr (!Coder::kReads) {
        const auto at = std::find_if(near.begin(), near.end(),
                                     [&](const auto& one) { return one.index == triangle[corner]; });
        if (at != near.end()) rank = static_cast<uint32_t>(at - near.begin()) + 1;
      }
      auto value = unfold_sign(rank);
      coder.code(value, kRankKind, kUsualRank);
      rank = fold_sign(value);
      if (rank > near.size()) return false;
      if (rank == 0)
        coder.code_bits(triangle[corner], index_bits);
      else
        triangle[corner] = near[rank - 1].index;
      if (triangle[corner] >= root_count) return false;
    }
  }
  return true;
}

}  // namespace

void append_triangles(std::span<const RootTriangle> triangles, std::span<const glm::vec3> roots_m,
                      std::vector<std::byte>& destination) {
  NumberWriter numbers;
  std::vector<RootTriangle> same(triangles.begin(), triangles.end());
  CHECK(code_triangles(numbers, roots_m, same));
  numbers.finish(destination);
}

Status read_triangles(std::span<const std::byte> source, std::span<const glm::vec3> roots_m,
                      std::span<RootTriangle> triangles) {
  ValueReader values;
  ASSIGN_OR_RETURN(const auto rest, values.open(source));
  NumberReader numbers(values);
  if (!code_triangles(numbers, roots_m, triangles) || !values.is_spent() || !rest.empty())
    return make_error(ErrorCode::BadInput,
                      "the bytes of the asset's root triangles are none of {} triangles between {} roots",
                      triangles.size(), roots_m.size());
  return {};
}

}  // namespace strandcast::asset
