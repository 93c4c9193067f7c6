#include "server/sim/strand_layout.h"

#include <algorithm>

namespace strandcast {
namespace {

struct PinnedRuns {
  uint32_t root_count = 0;
  uint32_t tail_count = 0;
};

Result<PinnedRuns> read_pinned_runs(const Groom& groom, uint32_t strand_index) {
  const uint32_t begin = groom.offset[strand_index];
  const uint32_t count = groom.vertex_count(strand_index);
  PinnedRuns runs;
  while (runs.root_count < count && groom.pinned[begin + runs.root_count] != 0) ++runs.root_count;
  if (runs.root_count == 0) {
    return make_error(ErrorCode::BadInput, "groom '{}': vertex 0 of strand {} is not pinned", groom.name,
                      strand_index);
  }
  while (runs.root_count + runs.tail_count < count &&
         groom.pinned[begin + count - 1 - runs.tail_count] != 0) {
    ++runs.tail_count;
  }
  for (uint32_t i = runs.root_count; i < count - runs.tail_count; ++i) {
    if (groom.pinned[begin + i] != 0) {
      return make_error(
          ErrorCode::BadInput,
          "groom '{}': vertex {} of strand {} is pinned between free ones (known: root, root pair, "
          "both ends)",
          groom.name, i, strand_index);
    }
  }
  return runs;
}

Status check_shape(const Groom& groom, uint32_t most_vertices) {
  if (groom.strand_count() == 0)
    return make_error(ErrorCode::BadInput, "groom '{}' has no strands", groom.name);
  if (groom.strand_count() > kMaxStrandCount) {
    return make_error(ErrorCode::LimitExceeded, "groom '{}' has {} strands (at most {})", groom.name,
                      groom.strand_count(), kMaxStrandCount);
  }
  const size_t total = groom.offset.back();
  if (groom.rest_position_m.size() != total || groom.pinned.size() != total) {
    return make_error(ErrorCode::BadInput, "groom '{}' has {} vertices but {} positions and {} pinned flags",
                      groom.name, total, groom.rest_position_m.size(), groom.pinned.size());
  }
  const uint32_t vertex_count = groom.vertex_count(0);
  for (uint32_t i = 0; i < groom.strand_count(); ++i) {
    if (groom.offset[i + 1] < groom.offset[i] || groom.vertex_count(i) != vertex_count) {
      return make_error(ErrorCode::BadInput,
                        "groom '{}': strand {} does not have {} vertices like strand 0; resample", groom.name,
                        i, vertex_count);
    }
  }
  if (vertex_count < kMinVertexCount || vertex_count > most_vertices) {
    return make_error(ErrorCode::LimitExceeded,
                      "groom '{}' has {} vertices per strand (allowed: {} to {}); resample", groom.name,
                      vertex_count, kMinVertexCount, most_vertices);
  }
  return {};
}

void fill_strand(const Groom& groom, uint32_t strand_index, StrandLayout& layout) {
  const glm::vec3* points = groom.rest_position_m.data() + groom.offset[strand_index];
  double length_m = 0.0;
  std::vector<double> arc_m(layout.vertex_count, 0.0);
  for (uint32_t i = 0; i < layout.vertex_count; ++i) {
    double segment_m = 0.0;
    if (i > 0) segment_m = glm::distance(glm::dvec3(points[i]), glm::dvec3(points[i - 1]));
    length_m += segment_m;
    arc_m[i] = length_m;
    layout.rest[layout.index(i, strand_index)] = glm::vec4(points[i], static_cast<float>(segment_m));
  }
  layout.length_m[strand_index] = static_cast<float>(length_m);
  for (uint32_t i = 0; i < layout.vertex_count; ++i) {
    layout.arc[layout.index(i, strand_index)] =
        length_m > 0.0 ? static_cast<float>(arc_m[i] / length_m) : 0.0f;
  }
}

/// Roots alike; tips free, or with as many pinned vertices as others.
Status set_pins(const Groom& groom, StrandLayout& layout) {
  uint32_t tail_total = 0;
  for (uint32_t i = 0; i < layout.strand_count; ++i) {
    ASSIGN_OR_RETURN(const PinnedRuns runs, read_pinned_runs(groom, i));
    if (i == 0) layout.pinned_root_count = runs.root_count;
    if (layout.pinned_tail_count == 0) layout.pinned_tail_count = runs.tail_count;
    const bool has_tail = runs.tail_count > 0;
    if (runs.root_count != layout.pinned_root_count ||
        (has_tail && runs.tail_count != layout.pinned_tail_count)) {
      return make_error(ErrorCode::BadInput,
                        "groom '{}': strand {} pins {} + {} vertices but others pin {} + {}; strands must "
                        "agree, but tips may be free",
                        groom.name, i, runs.root_count, runs.tail_count, layout.pinned_root_count,
                        layout.pinned_tail_count);
    }
    layout.has_tail.push_back(has_tail ? 1 : 0);
    tail_total += has_tail ? 1 : 0;
  }
  if (tail_total == 0 || tail_total == layout.strand_count) layout.has_tail = {};
  if (layout.is_mixed() && layout.pinned_root_count >= layout.tail_begin())
    return make_error(ErrorCode::BadInput,
                      "groom '{}' pins all vertices of some strands but not of others; free their tips",
                      groom.name);
  return {};
}

}  // namespace

Result<StrandLayout> make_strand_layout(const Groom& groom, uint32_t most_vertices) {
  RETURN_IF_ERROR(check_shape(groom, most_vertices));
  StrandLayout layout;
  layout.strand_count = groom.strand_count();
  layout.vertex_count = groom.vertex_count(0);
  RETURN_IF_ERROR(set_pins(groom, layout));
  const size_t total = static_cast<size_t>(layout.strand_count) * layout.vertex_count;
  layout.rest.resize(total);
  layout.arc.resize(total);
  layout.length_m.resize(layout.strand_count);
  for (uint32_t i = 0; i < layout.strand_count; ++i) fill_strand(groom, i, layout);
  return layout;
}

}  // namespace strandcast
