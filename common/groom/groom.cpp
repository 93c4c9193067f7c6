#include "common/groom/groom.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"

namespace strandcast {
namespace {

bool is_inside_extent(const glm::vec3& point) {
  // Written so that NaN is outside.
  return std::abs(point.x) <= kMaxGroomExtentM && std::abs(point.y) <= kMaxGroomExtentM &&
         std::abs(point.z) <= kMaxGroomExtentM;
}

Status validate_sizes(const Groom& groom) {
  if (groom.offset.size() < 2) return make_error(ErrorCode::BadInput, "the groom has no strands");
  if (groom.offset.size() - 1 > kMaxStrandCount) {
    return make_error(ErrorCode::LimitExceeded, "{} strands, at most {} are allowed: export fewer of them",
                      groom.offset.size() - 1, kMaxStrandCount);
  }
  const uint64_t vertex_total = groom.rest_position_m.size();
  if (vertex_total > kMaxGroomVertices) {
    return make_error(ErrorCode::LimitExceeded, "{} vertices, at most {} are allowed", vertex_total,
                      kMaxGroomVertices);
  }
  if (groom.offset.front() != 0 || groom.offset.back() != vertex_total ||
      groom.pinned.size() != vertex_total) {
    return make_error(ErrorCode::BadInput,
                      "offsets {}..{}, {} positions and {} pin flags do not belong together",
                      groom.offset.front(), groom.offset.back(), vertex_total, groom.pinned.size());
  }
  if (!groom.root_uv.empty() && groom.root_uv.size() != groom.strand_count()) {
    return make_error(ErrorCode::BadInput, "{} root coordinates for {} strands", groom.root_uv.size(),
                      groom.strand_count());
  }
  return {};
}

}  // namespace

uint32_t Groom::uniform_vertex_count() const {
  if (strand_count() == 0) return 0;
  const uint32_t first_count = vertex_count(0);
  for (uint32_t strand = 1; strand < strand_count(); ++strand) {
    if (vertex_count(strand) != first_count) return 0;
  }
  return first_count;
}

float Groom::length_m(uint32_t strand_index) const {
  double length = 0.0;
  for (uint32_t vertex = offset[strand_index] + 1; vertex < offset[strand_index + 1]; ++vertex) {
    length += glm::length(glm::dvec3(rest_position_m[vertex]) - glm::dvec3(rest_position_m[vertex - 1]));
  }
  return static_cast<float>(length);
}

Status validate(const Groom& groom) {
  RETURN_IF_ERROR(validate_sizes(groom));
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const uint32_t begin = groom.offset[strand], end = groom.offset[strand + 1];
    if (end < begin || end > groom.rest_position_m.size() || end - begin < kMinVertexCount) {
      return make_error(ErrorCode::BadInput,
                        "strand {} runs from vertex {} to {}, it needs at least {} vertices", strand, begin,
                        end, kMinVertexCount);
    }
    if (end - begin > kMaxSourceVertexCount) {
      return make_error(ErrorCode::LimitExceeded, "strand {} has {} vertices, at most {} are allowed", strand,
                        end - begin, kMaxSourceVertexCount);
    }
    if (groom.pinned[begin] == 0) {
      return make_error(ErrorCode::BadInput, "the root of strand {} is not pinned", strand);
    }
    for (uint32_t vertex = begin; vertex < end; ++vertex) {
      const glm::vec3& point = groom.rest_position_m[vertex];
      if (is_inside_extent(point)) continue;
      return make_error(ErrorCode::BadInput,
                        "strand {} vertex {} lies at ({}, {}, {}) m, allowed is +-{} m: check the unit",
                        strand, vertex - begin, point.x, point.y, point.z, kMaxGroomExtentM);
    }
  }
  return {};
}

Groom with_pinning(Groom groom, Pinning pinning) {
  const uint32_t head_count = pinning == Pinning::Root ? 1 : 2;
  const uint32_t tail_count = pinning == Pinning::BothEnds ? 2 : 0;
  groom.pinned.assign(groom.rest_position_m.size(), 0);
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const uint32_t count = groom.vertex_count(strand);
    const auto begin = groom.pinned.begin() + groom.offset[strand];
    std::fill_n(begin, std::min(head_count, count), uint8_t{1});
    std::fill_n(begin + (count - std::min(tail_count, count)), std::min(tail_count, count), uint8_t{1});
  }
  return groom;
}

Groom reorder(const Groom& groom, const std::vector<uint32_t>& order) {
  CHECK(order.size() == groom.strand_count());
  Groom sorted;
  sorted.name = groom.name;
  sorted.file_unit_m = groom.file_unit_m;
  sorted.offset.reserve(groom.offset.size());
  sorted.offset.push_back(0);
  sorted.rest_position_m.reserve(groom.rest_position_m.size());
  sorted.pinned.reserve(groom.pinned.size());
  std::vector<uint8_t> is_taken(order.size(), 0);
  for (const uint32_t strand : order) {
    CHECK(strand < groom.strand_count() && is_taken[strand] == 0);
    is_taken[strand] = 1;
    const uint32_t begin = groom.offset[strand], end = groom.offset[strand + 1];
    sorted.rest_position_m.insert(sorted.rest_position_m.end(), groom.rest_position_m.begin() + begin,
                                  groom.rest_position_m.begin() + end);
    sorted.pinned.insert(sorted.pinned.end(), groom.pinned.begin() + begin, groom.pinned.begin() + end);
    sorted.offset.push_back(static_cast<uint32_t>(sorted.rest_position_m.size()));
    if (!groom.root_uv.empty()) sorted.root_uv.push_back(groom.root_uv[strand]);
  }
  return sorted;
}

}  // namespace strandcast
