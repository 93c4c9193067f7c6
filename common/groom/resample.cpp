#include "common/groom/resample.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "common/base/check.h"

namespace strandcast {
namespace {

/// Arc length up to each vertex, in double: strands as short as 1e-6 keep their shape.
std::vector<double> arc_lengths(std::span<const glm::vec3> strand) {
  std::vector<double> arc(strand.size(), 0.0);
  for (size_t i = 1; i < strand.size(); ++i) {
    arc[i] = arc[i - 1] + glm::length(glm::dvec3(strand[i]) - glm::dvec3(strand[i - 1]));
  }
  return arc;
}

/// Where a vertex of the resampled strand lies: between two of the strand, so far along.
struct ArcPlace {
  size_t segment = 0;
  double blend = 0.0;
};

/// Places of all vertices; the first and the last are those of the strand.
std::vector<ArcPlace> arc_places(std::span<const glm::vec3> strand, uint32_t vertex_count) {
  const std::vector<double> arc = arc_lengths(strand);
  std::vector<ArcPlace> places{{0, 0.0}};
  size_t segment = 0;
  for (uint32_t vertex = 1; vertex + 1 < vertex_count; ++vertex) {
    const double target = arc.back() * vertex / (vertex_count - 1);
    while (segment + 2 < strand.size() && arc[segment + 1] < target) ++segment;
    const double span = arc[segment + 1] - arc[segment];
    places.push_back({segment, span > 0.0 ? std::clamp((target - arc[segment]) / span, 0.0, 1.0) : 0.0});
  }
  places.push_back({strand.size() - 2, 1.0});
  return places;
}

void append_pins(std::span<const uint8_t> pinned, uint32_t vertex_count, std::vector<uint8_t>& pins) {
  const auto is_free = [](uint8_t pin) { return pin == 0; };
  const auto head = std::find_if(pinned.begin(), pinned.end(), is_free) - pinned.begin();
  const auto tail = std::find_if(pinned.rbegin(), pinned.rend(), is_free) - pinned.rbegin();
  const bool is_all_pinned = head == static_cast<std::ptrdiff_t>(pinned.size());
  for (std::ptrdiff_t vertex = 0; vertex < vertex_count; ++vertex) {
    const bool is_tail = !is_all_pinned && vertex >= static_cast<std::ptrdiff_t>(vertex_count) - tail;
    pins.push_back(vertex < head || is_tail ? 1 : 0);
  }
}

}  // namespace

Groom resample(const Groom& groom, uint32_t vertex_count) {
  CHECK(vertex_count >= kMinVertexCount && vertex_count <= kMaxVertexCount);
  Groom result;
  result.name = groom.name;
  result.file_unit_m = groom.file_unit_m;
  result.root_uv = groom.root_uv;
  const size_t vertex_total = size_t{groom.strand_count()} * vertex_count;
  result.offset.reserve(groom.offset.size());
  result.rest_position_m.reserve(vertex_total);
  result.pinned.reserve(vertex_total);
  result.offset.push_back(0);
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const uint32_t begin = groom.offset[strand], count = groom.vertex_count(strand);
    const auto points = std::span(groom.rest_position_m).subspan(begin, count);
    for (const ArcPlace& place : arc_places(points, vertex_count))
      result.rest_position_m.emplace_back(
          glm::mix(glm::dvec3(points[place.segment]), glm::dvec3(points[place.segment + 1]), place.blend));
    append_pins(std::span(groom.pinned).subspan(begin, count), vertex_count, result.pinned);
    result.offset.push_back(static_cast<uint32_t>(result.rest_position_m.size()));
  }
  return result;
}

std::vector<float> resample(const Groom& groom, const std::vector<float>& values, uint32_t vertex_count) {
  std::vector<float> resampled;
  for (uint32_t strand = 0; !values.empty() && strand < groom.strand_count(); ++strand) {
    const uint32_t begin = groom.offset[strand];
    const auto points = std::span(groom.rest_position_m).subspan(begin, groom.vertex_count(strand));
    for (const ArcPlace& place : arc_places(points, vertex_count))
      resampled.push_back(std::lerp(values[begin + place.segment], values[begin + place.segment + 1],
                                    static_cast<float>(place.blend)));
  }
  return resampled;
}

}  // namespace strandcast
