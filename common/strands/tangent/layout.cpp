#include "common/strands/tangent/layout.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/strands/morton.h"

namespace strandcast::tangent {
namespace {

constexpr uint32_t kThinnings = 8;          // the coarsest level has one strand in so many
constexpr uint32_t kStrandsPerSlice = 128;  // fewer than kThinnings times that: a single slice
constexpr uint32_t kWindow = 64;            // places before a block that are searched for neighbours
constexpr uint32_t kAlikeWindow = 512;  // along the curve, either way, that is searched for the most alike
constexpr size_t kMostAlike = 400'000;  // vertices; of more the nearest roots are taken instead
constexpr double kCells = 1024.0;       // of the curve, along each axis

/// Strands in the order of a Morton curve through their roots.
std::vector<uint32_t> curve_order(uint32_t strand_count, std::span<const glm::vec3> rest_in_head_m) {
  std::vector<uint32_t> order(strand_count);
  std::iota(order.begin(), order.end(), 0u);
  if (rest_in_head_m.empty()) return order;
  const auto roots = rest_in_head_m.first(strand_count);
  glm::dvec3 low(roots[0]);
  glm::dvec3 high(roots[0]);
  for (const glm::vec3& root : roots) {
    low = glm::min(low, glm::dvec3(root));
    high = glm::max(high, glm::dvec3(root));
  }
  const double extent = std::max({high.x - low.x, high.y - low.y, high.z - low.z, 1e-9});
  std::vector<uint32_t> code(strand_count);
  for (uint32_t s = 0; s < strand_count; ++s) {
    const glm::dvec3 cell = (glm::dvec3(roots[s]) - low) * ((kCells - 1.0) / extent);
    for (int axis = 0; axis < 3; ++axis) code[s] |= morton_bits(static_cast<uint32_t>(cell[axis])) << axis;
  }
  std::stable_sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return code[a] < code[b]; });
  return order;
}

/// The slice of the strand at position `i` on the curve: level 0 holds every eighth, level 1 those halfway
/// between, and so on; each level is cut along the curve into slices of an eighth of all strands.
uint32_t slice_of(uint32_t i, uint32_t strand_count) {
  const uint64_t eighth = uint64_t{i} * kThinnings / strand_count;  // along the curve
  if (i % 8 == 0) return 0;
  if (i % 8 == 4) return 1;
  if (i % 4 == 2) return 2 + static_cast<uint32_t>(eighth / 4);
  return 4 + static_cast<uint32_t>(eighth / 2);
}

/// The two best of those that are tried.
struct NearestTwo {
  std::array<float, 2> squared = {INFINITY, INFINITY};
  std::array<uint32_t, 2> place;

  void consider(uint32_t other, float distance_squared) {
    if (distance_squared < squared[0]) {
      squared = {distance_squared, squared[0]};
      place = {other, place[0]};
    } else if (distance_squared < squared[1]) {
      squared[1] = distance_squared;
      place[1] = other;
    }
  }
};

float squared_distance(const glm::vec3& a, const glm::vec3& b) {
  const glm::vec3 away = a - b;
  return (away.x * away.x + away.y * away.y) + away.z * away.z;
}

void find_neighbours(Layout& layout, std::span<const glm::vec3> rest_in_head_m) {
  for (auto& neighbour : layout.neighbour) neighbour.assign(layout.stride, layout.no_neighbour());
  if (rest_in_head_m.empty()) return;
  for (uint32_t slice = 0; slice < layout.slice_count(); ++slice) {
    const uint32_t begin = layout.slice_begin[slice];
    for (uint32_t place = begin; place < layout.slice_begin[slice + 1]; ++place) {
      if (layout.strand_at[place] == kNoStrand) continue;
      const glm::vec3 root = rest_in_head_m[layout.strand_at[place]];
      const uint32_t end = place / kBlockSize * kBlockSize;
      NearestTwo nearest{.place = {layout.no_neighbour(), layout.no_neighbour()}};
      for (uint32_t other = std::max(begin, end > kWindow ? end - kWindow : 0u); other < end; ++other)
        nearest.consider(other, squared_distance(rest_in_head_m[layout.strand_at[other]], root));
      for (size_t i = 0; i < 2; ++i) layout.neighbour[i][place] = nearest.place[i];
    }
  }
}

/// Strands that lie alike at rest move alike: roots count most, middles and tips half as much. `order`: the
/// strands along the curve.
void find_alike(Layout& layout, std::span<const uint32_t> order, std::span<const glm::vec3> rest_in_head_m) {
  layout.alike = layout.neighbour;
  const uint32_t count = layout.strand_count;
  if (rest_in_head_m.empty() || rest_in_head_m.size() > kMostAlike) return;
  const auto middle = rest_in_head_m.subspan(size_t{count} * (layout.vertex_count / 2), count);
  const auto tip = rest_in_head_m.last(count);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t strand = order[i];
    const uint32_t place = layout.place_of[strand];
    const uint32_t end = place / kBlockSize * kBlockSize;
    NearestTwo nearest{.place = {layout.no_neighbour(), layout.no_neighbour()}};
    for (uint32_t k = i - std::min(i, kAlikeWindow); k < std::min(count, i + kAlikeWindow + 1); ++k) {
      const uint32_t other = order[k];
      if (layout.place_of[other] >= end) continue;
      const float apart = squared_distance(rest_in_head_m[other], rest_in_head_m[strand]);
      const float middles = 0.5f * squared_distance(middle[other], middle[strand]);
      nearest.consider(layout.place_of[other],
                       (apart + middles) + 0.5f * squared_distance(tip[other], tip[strand]));
    }
    for (size_t n = 0; n < 2; ++n) layout.alike[n][place] = nearest.place[n];
  }
}

}  // namespace

Layout make_layout(uint32_t strand_count, uint32_t vertex_count, std::span<const glm::vec3> rest_in_head_m) {
  CHECK(rest_in_head_m.empty() || rest_in_head_m.size() == size_t{strand_count} * vertex_count);
  const std::vector<uint32_t> order = curve_order(strand_count, rest_in_head_m);
  const bool is_sliced = strand_count >= kThinnings * kStrandsPerSlice;
  std::vector<std::vector<uint32_t>> slices(is_sliced ? kThinnings : 1);
  for (uint32_t i = 0; i < strand_count; ++i)
    slices[is_sliced ? slice_of(i, strand_count) : 0].push_back(order[i]);

  Layout layout;
  layout.strand_count = strand_count;
  layout.vertex_count = vertex_count;
  for (const auto& slice : slices) {
    layout.slice_begin.push_back(static_cast<uint32_t>(layout.strand_at.size()));
    layout.strands_in.push_back(static_cast<uint32_t>(slice.size()));
    layout.strand_at.insert(layout.strand_at.end(), slice.begin(), slice.end());
    while (layout.strand_at.size() % kBlockSize != 0) layout.strand_at.push_back(kNoStrand);
  }
  layout.slice_begin.push_back(static_cast<uint32_t>(layout.strand_at.size()));
  layout.strand_at.insert(layout.strand_at.end(), kBlockSize, kNoStrand);
  layout.stride = static_cast<uint32_t>(layout.strand_at.size());
  layout.place_of.resize(strand_count);
  for (uint32_t place = 0; place < layout.stride; ++place) {
    const uint32_t strand = layout.strand_at[place];
    layout.presence.push_back(strand == kNoStrand ? 0.0f : 1.0f);
    if (strand != kNoStrand) layout.place_of[strand] = place;
  }
  find_neighbours(layout, rest_in_head_m);
  find_alike(layout, order, rest_in_head_m);

  layout.rest_length_m.assign(layout.plane_size(), 0.0f);
  for (auto& edge : layout.rest_edge_m) edge.assign(layout.plane_size(), 0.0f);
  if (rest_in_head_m.empty()) return layout;
  for (size_t place = 0; place < layout.stride; ++place) {
    if (layout.strand_at[place] == kNoStrand) continue;
    const glm::vec3 root = rest_in_head_m[layout.strand_at[place]];
    for (int axis = 0; axis < 3; ++axis) layout.rest_edge_m[static_cast<size_t>(axis)][place] = root[axis];
  }
  for (size_t v = 1; v < vertex_count; ++v) {
    for (size_t place = 0; place < layout.stride; ++place) {
      const uint32_t strand = layout.strand_at[place];
      if (strand == kNoStrand) continue;
      const glm::vec3 edge =
          rest_in_head_m[v * strand_count + strand] - rest_in_head_m[(v - 1) * strand_count + strand];
      const size_t at = v * layout.stride + place;
      for (int axis = 0; axis < 3; ++axis) layout.rest_edge_m[static_cast<size_t>(axis)][at] = edge[axis];
      layout.rest_length_m[at] = std::sqrt((edge.x * edge.x + edge.y * edge.y) + edge.z * edge.z);
    }
  }
  return layout;
}

}  // namespace strandcast::tangent
