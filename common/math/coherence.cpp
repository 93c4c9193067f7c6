#include "common/math/coherence.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/base/check.h"

namespace strandcast {
namespace {

constexpr uint32_t kMostSkippedVertices = 4;
constexpr uint32_t kVerticesPerSkipped = 4;
/// Cells along an axis to either side of the origin: 15 km. What is farther lies in the last one.
constexpr double kMostCells = 1 << 20;
/// Of the energy of what all moves alike, what roundings leave of it.
constexpr double kRounding = 1e-20;

/// A point of a strand, with what its neighbours are averaged over.
struct StrandPoint {
  glm::dvec3 position_m{0.0};
  glm::dvec3 value{0.0};
  uint32_t strand_index = 0;
  uint64_t cell = 0;
};

/// Mean value of a point's neighbours.
struct Surroundings {
  glm::dvec3 mean{0.0};
  uint32_t count = 0;
  bool is_alone() const { return count < kLeastNeighbours; }
};

/// Cells of one row along x have consecutive keys.
uint64_t cell_key(const glm::ivec3& cell) {
  constexpr int kBits = 21;
  constexpr int kMiddle = 1 << 20;
  const auto part = [](int value) { return static_cast<uint64_t>(value + kMiddle); };
  return part(cell.z) << (2 * kBits) | part(cell.y) << kBits | part(cell.x);
}

glm::ivec3 cell_of(const glm::dvec3& position_m) {
  return glm::ivec3(
      glm::clamp(glm::floor(position_m / kNeighbourReachM), 1.0 - kMostCells, kMostCells - 2.0));
}

bool is_finite_point(const glm::dvec3& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

/// Finds neighbours among points: sorted by cells as wide as neighbours reach.
class NeighbourGrid {
 public:
  explicit NeighbourGrid(std::vector<StrandPoint> points) : points_(std::move(points)) {
    for (StrandPoint& point : points_) point.cell = cell_key(cell_of(point.position_m));
    std::stable_sort(points_.begin(), points_.end(),
                     [](const StrandPoint& a, const StrandPoint& b) { return a.cell < b.cell; });
  }

  /// For each point, in an order that depends on the points alone.
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (size_t begin = 0; begin < points_.size();) {
      size_t end = begin;
      while (end < points_.size() && points_[end].cell == points_[begin].cell) ++end;
      find_rows(cell_of(points_[begin].position_m));
      for (size_t i = begin; i < end; ++i) visit(points_[i], around(points_[i]));
      begin = end;
    }
  }

 private:
  struct Row {
    const StrandPoint* begin = nullptr;
    const StrandPoint* end = nullptr;
  };

  /// The three cells along x in each of the nine rows around a cell.
  void find_rows(const glm::ivec3& cell) const {
    rows_.clear();
    const StrandPoint* const first = points_.data();
    const StrandPoint* const last = first + points_.size();
    const auto is_before = [](const StrandPoint& point, uint64_t key) { return point.cell < key; };
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y) {
        const uint64_t low = cell_key(cell + glm::ivec3(-1, y, z));
        const uint64_t high = cell_key(cell + glm::ivec3(1, y, z)) + 1;
        const StrandPoint* const begin = std::lower_bound(first, last, low, is_before);
        rows_.push_back({begin, std::lower_bound(begin, last, high, is_before)});
      }
  }

  Surroundings around(const StrandPoint& point) const {
    Surroundings found;
    for (const Row& row : rows_)
      for (const StrandPoint* other = row.begin; other != row.end; ++other) {
        if (other->strand_index == point.strand_index) continue;
        const glm::dvec3 way = other->position_m - point.position_m;
        if (!(glm::dot(way, way) < kNeighbourReachM * kNeighbourReachM)) continue;
        found.mean += other->value;
        ++found.count;
      }
    if (found.count > 0) found.mean /= static_cast<double>(found.count);
    return found;
  }

  std::vector<StrandPoint> points_;
  mutable std::vector<Row> rows_;  // around the cell that is visited
};

/// Vertices with their velocities.
std::vector<StrandPoint> vertices_of(const HairMoment& moment) {
  std::vector<StrandPoint> points;
  for (uint32_t vertex = first_measured_vertex(moment.vertex_count); vertex < moment.vertex_count; ++vertex)
    for (uint32_t strand = 0; strand < moment.strand_count; ++strand) {
      const size_t at = size_t{vertex} * moment.strand_count + strand;
      if (is_finite_point(moment.position_m[at]) && is_finite_point(moment.velocity_mps[at]))
        points.push_back({moment.position_m[at], moment.velocity_mps[at], strand});
    }
  return points;
}

/// Middles of segments with their directions.
std::vector<StrandPoint> segments_of(const HairMoment& moment) {
  std::vector<StrandPoint> points;
  for (uint32_t vertex = first_measured_vertex(moment.vertex_count) + 1; vertex < moment.vertex_count;
       ++vertex)
    for (uint32_t strand = 0; strand < moment.strand_count; ++strand) {
      const size_t at = size_t{vertex} * moment.strand_count + strand;
      const glm::dvec3& from = moment.position_m[at - moment.strand_count];
      const glm::dvec3 way = moment.position_m[at] - from;
      const double length_m = glm::length(way);
      if (length_m > 0.0 && std::isfinite(length_m))
        points.push_back({0.5 * (from + moment.position_m[at]), way / length_m, strand});
    }
  return points;
}

/// Sum of the squared distances from the mean; 0 where that is rounding.
double spread_of(const std::vector<glm::dvec3>& values) {
  glm::dvec3 mean(0.0);
  for (const glm::dvec3& value : values) mean += value;
  mean /= std::max(static_cast<double>(values.size()), 1.0);
  double apart = 0.0, whole = 0.0;
  for (const glm::dvec3& value : values) {
    apart += glm::dot(value - mean, value - mean);
    whole += glm::dot(value, value);
  }
  return apart > kRounding * whole ? apart : 0.0;
}

}  // namespace

uint32_t first_measured_vertex(uint32_t vertex_count) {
  return std::min(kMostSkippedVertices, vertex_count / kVerticesPerSkipped);
}

double Coherence::incoherent_share() const {
  return whole_m2ps2 > 0.0 ? apart_m2ps2 / whole_m2ps2 : 0.0;
}

double Coherence::motion_mps() const {
  const uint64_t among = vertex_count - lone_count;
  return among > 0 ? std::sqrt(whole_m2ps2 / static_cast<double>(among)) : 0.0;
}

double Coherence::lone_share() const {
  return vertex_count > 0 ? static_cast<double>(lone_count) / static_cast<double>(vertex_count) : 0.0;
}

double Coherence::order() const {
  return segment_count > 0 ? aligned / static_cast<double>(segment_count) : 0.0;
}

Coherence& Coherence::operator+=(const Coherence& other) {
  apart_m2ps2 += other.apart_m2ps2;
  whole_m2ps2 += other.whole_m2ps2;
  aligned += other.aligned;
  vertex_count += other.vertex_count;
  lone_count += other.lone_count;
  segment_count += other.segment_count;
  return *this;
}

Coherence measure_coherence(const HairMoment& moment) {
  const size_t size = size_t{moment.vertex_count} * moment.strand_count;
  CHECK(moment.position_m.size() == size && moment.velocity_mps.size() == size);
  Coherence found;
  const uint32_t measured = moment.vertex_count - first_measured_vertex(moment.vertex_count);
  found.vertex_count = uint64_t{measured} * moment.strand_count;
  found.lone_count = found.vertex_count;
  std::vector<glm::dvec3> among_mps;
  NeighbourGrid(vertices_of(moment)).for_each([&](const StrandPoint& vertex, const Surroundings& around) {
    if (around.is_alone()) return;
    --found.lone_count;
    const glm::dvec3 apart = vertex.value - around.mean;
    found.apart_m2ps2 += glm::dot(apart, apart);
    among_mps.push_back(vertex.value);
  });
  found.whole_m2ps2 = spread_of(among_mps);
  NeighbourGrid(segments_of(moment)).for_each([&](const StrandPoint&, const Surroundings& around) {
    if (around.is_alone()) return;
    ++found.segment_count;
    found.aligned += glm::length(around.mean);
  });
  return found;
}

}  // namespace strandcast
