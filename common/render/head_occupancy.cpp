#include "common/render/head_occupancy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <unordered_set>

#include "common/base/hash.h"

namespace strandcast {
namespace {

// Pairs of a triangle and a line or a cell that are looked at; a mesh that takes more is as good as none.
constexpr uint64_t kMaxVisits = uint64_t{1} << 27;
// Around triangles distances are exact in so many cells, further out they add up from cell to cell.
constexpr float kBandCells = 1.5f;
constexpr float kFarCells = 1e6f;
constexpr float kMostSteps = 127.0f;
// Coordinates of a head's mesh that count.
constexpr float kFarHeadM = 1e4f;
// Round the hair lies what it throws shadows on, and what throws them on it: this share of its extent further
// out.
constexpr float kRoomShare = 0.35f;
// Cells along the hair's extent, or along the skull's diameter where that is larger.
constexpr float kCellsAlong = 80.0f;
constexpr int kMinCells = 2;

using Corners = std::array<glm::dvec3, 3>;

glm::ivec3 cells_of(const glm::vec3& size_m, float cell_m) {
  return glm::max(glm::ivec3(glm::ceil(size_m / cell_m)) + 1, glm::ivec3(kMinCells));
}

/// Triangles in cells from the first cell's middle: finite ones, each once, whichever way round it comes a
/// second time.
std::vector<Corners> usable_triangles(const Mesh& mesh, const HeadOccupancy& grid) {
  std::vector<Corners> triangles;
  triangles.reserve(mesh.triangle.size());
  std::unordered_set<uint64_t> seen;
  for (const glm::uvec3& corner : mesh.triangle) {
    Corners at;
    uint64_t key = 0;
    bool is_usable = true;
    for (int k = 0; k < 3; ++k) {
      const glm::vec3& p = mesh.position_m[corner[k]];
      is_usable =
          is_usable && std::abs(p.x) < kFarHeadM && std::abs(p.y) < kFarHeadM && std::abs(p.z) < kFarHeadM;
      key += hash_bytes(std::as_bytes(std::span(&p, 1)));
      at[k] = glm::dvec3(p - grid.origin_m) / static_cast<double>(grid.cell_m);
    }
    if (is_usable && seen.insert(key).second) triangles.push_back(at);
  }
  return triangles;
}

/// Twice the area of the triangle a, b, p, with a sign that turns exactly when a and b are exchanged and is
/// never 0.
double side_of(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& p) {
  const bool is_turned = b.x < a.x || (b.x == a.x && b.y < a.y);
  const glm::dvec2& from = is_turned ? b : a;
  const glm::dvec2& to = is_turned ? a : b;
  const double area = (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x);
  const double signed_area = area == 0.0 ? 1e-300 : area;
  return is_turned ? -signed_area : signed_area;
}

/// What the lines along one axis say: each goes through the middles of a row of cells.
class LineVotes {
 public:
  LineVotes(const glm::ivec3& size, int axis)
      : size_(size),
        axis_(axis),
        u_((axis + 1) % 3),
        v_((axis + 2) % 3),
        length_(static_cast<size_t>(size[axis]) + 1),
        turns_(length_ * static_cast<size_t>(size[u_]) * static_cast<size_t>(size[v_])),
        crossings_(turns_.size()) {}

  /// Lines that were looked at.
  uint64_t add(const Corners& t) {
    const auto flat = [&](const glm::dvec3& p) { return glm::dvec2(p[u_], p[v_]); };
    const glm::dvec2 a = flat(t[0]), b = flat(t[1]), c = flat(t[2]);
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0.0) return 0;
    const glm::ivec2 from = first_line(glm::min(a, glm::min(b, c)));
    const glm::ivec2 to = glm::min(first_line(glm::max(a, glm::max(b, c)) + 1.0), lines());
    for (int v = from.y; v < to.y; ++v)
      for (int u = from.x; u < to.x; ++u) {
        const glm::dvec2 p(u, v);
        const double wa = side_of(b, c, p), wb = side_of(c, a, p), wc = side_of(a, b, p);
        if ((wa > 0.0) != (wb > 0.0) || (wb > 0.0) != (wc > 0.0)) continue;
        const double at = (wa * t[0][axis_] + wb * t[1][axis_] + wc * t[2][axis_]) / (wa + wb + wc);
        // The first cell behind it; one more stands for all that lie further on.
        const auto cell = static_cast<size_t>(std::clamp(std::floor(at) + 1.0, 0.0, double(size_[axis_])));
        turns_[line(u, v) + cell] += wa > 0.0 ? 1 : -1;
        ++crossings_[line(u, v) + cell];
      }
    return to.x > from.x && to.y > from.y ? uint64_t(to.x - from.x) * uint64_t(to.y - from.y) : 0;
  }

  /// +1 for each cell inside, -1 for each outside, of lines that leave the head as often as they enter it.
  void count(std::vector<int8_t>& votes) const {
    const std::array<size_t, 3> stride = {1, size_t(size_.x), size_t(size_.x) * size_t(size_.y)};
    for (int v = 0; v < size_[v_]; ++v)
      for (int u = 0; u < size_[u_]; ++u) {
        const size_t begin = line(u, v);
        int64_t turns = 0, crossings = 0;
        for (size_t i = 0; i < length_; ++i) {
          turns += turns_[begin + i];
          crossings += crossings_[begin + i];
        }
        // Triangles that are not all the same way round still count.
        const bool is_wound = turns == 0;
        if (!is_wound && crossings % 2 != 0) continue;
        turns = crossings = 0;
        int8_t* vote =
            votes.data() + static_cast<size_t>(u) * stride[u_] + static_cast<size_t>(v) * stride[v_];
        for (size_t i = 0; i + 1 < length_; ++i, vote += stride[axis_]) {
          turns += turns_[begin + i];
          crossings += crossings_[begin + i];
          const bool is_inside = is_wound ? turns != 0 : crossings % 2 != 0;
          *vote = static_cast<int8_t>(*vote + (is_inside ? 1 : -1));
        }
      }
  }

 private:
  glm::ivec2 lines() const { return {size_[u_], size_[v_]}; }
  glm::ivec2 first_line(const glm::dvec2& p) const {
    return glm::ivec2(glm::clamp(glm::ceil(p), glm::dvec2(0.0), glm::dvec2(lines())));
  }
  size_t line(int u, int v) const {
    return (static_cast<size_t>(v) * static_cast<size_t>(size_[u_]) + static_cast<size_t>(u)) * length_;
  }

  glm::ivec3 size_;
  int axis_, u_, v_;
  size_t length_;
  std::vector<int16_t>
      turns_;  // what is crossed in front of each cell, by the side it shows; at most a mesh wraps it
  std::vector<uint16_t> crossings_;
};

/// Squared, to the nearest of a triangle's points: of its face where it lies above that, else of an edge.
float distance_squared(const std::array<glm::vec3, 3>& t, const glm::vec3& normal, const glm::vec3& p) {
  bool is_above = true;
  float nearest = kFarCells;
  for (int k = 0; k < 3; ++k) {
    const glm::vec3 edge = t[(k + 1) % 3] - t[k];
    const glm::vec3 way = p - t[k];
    is_above = is_above && glm::dot(glm::cross(normal, edge), way) >= 0.0f;
    const float along = glm::clamp(glm::dot(way, edge) / std::max(glm::dot(edge, edge), 1e-20f), 0.0f, 1.0f);
    const glm::vec3 off = way - along * edge;
    nearest = std::min(nearest, glm::dot(off, off));
  }
  if (!is_above) return nearest;
  const float height = glm::dot(normal, p - t[0]);
  return height * height;
}

/// Cells that were looked at.
uint64_t add_distances(const Corners& triangle, const glm::ivec3& size, std::vector<float>& squared) {
  const std::array<glm::vec3, 3> t = {glm::vec3(triangle[0]), glm::vec3(triangle[1]), glm::vec3(triangle[2])};
  glm::vec3 normal = glm::cross(t[1] - t[0], t[2] - t[0]);
  const float twice_area = glm::length(normal);
  if (!(twice_area > 0.0f)) return 0;
  normal /= twice_area;
  const glm::vec3 bounds(size);
  const auto lowest = glm::min(t[0], glm::min(t[1], t[2])) - kBandCells;
  const auto highest = glm::max(t[0], glm::max(t[1], t[2])) + kBandCells;
  const glm::ivec3 from(glm::clamp(glm::ceil(lowest), glm::vec3(0.0f), bounds));
  const glm::ivec3 to(glm::clamp(glm::floor(highest) + 1.0f, glm::vec3(0.0f), bounds));
  for (int z = from.z; z < to.z; ++z)
    for (int y = from.y; y < to.y; ++y)
      for (int x = from.x; x < to.x; ++x) {
        const glm::vec3 p(x, y, z);
        if (std::abs(glm::dot(normal, p - t[0])) > kBandCells) continue;
        float& held =
            squared[(static_cast<size_t>(z) * static_cast<size_t>(size.y) + static_cast<size_t>(y)) *
                        static_cast<size_t>(size.x) +
                    static_cast<size_t>(x)];
        held = std::min(held, distance_squared(t, normal, p));
      }
  const glm::ivec3 looked_at = glm::max(to - from, glm::ivec3(0));
  return uint64_t(looked_at.x) * uint64_t(looked_at.y) * uint64_t(looked_at.z);
}

/// Forgets distances to what lies within the head or stands alone outside of it: eyes, teeth, lashes.
void forget_within(const glm::ivec3& size, const std::vector<int8_t>& votes, std::vector<float>& distance) {
  size_t i = 0;
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      for (int x = 0; x < size.x; ++x, ++i) {
        if (distance[i] >= kFarCells) continue;
        const glm::ivec3 from = glm::max(glm::ivec3(x, y, z) - 1, glm::ivec3(0));
        const glm::ivec3 to = glm::min(glm::ivec3(x, y, z) + 1, size - 1);
        bool is_skin = false;
        for (int w = from.z; w <= to.z && !is_skin; ++w)
          for (int v = from.y; v <= to.y && !is_skin; ++v)
            for (int u = from.x; u <= to.x && !is_skin; ++u)
              is_skin = (votes[(static_cast<size_t>(w) * size.y + v) * static_cast<size_t>(size.x) + u] >
                         0) != (votes[i] > 0);
        if (!is_skin) distance[i] = kFarCells;
      }
}

/// Distances where none are known yet, from cell to cell, there and back.
void spread_distances(const glm::ivec3& size, std::vector<float>& distance) {
  struct Neighbour {
    glm::ivec3 at;
    ptrdiff_t offset;
    float cells;
  };
  std::vector<Neighbour> behind;  // those that come first in memory
  for (int i = 0; i < 13; ++i) {
    const glm::ivec3 at(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    behind.push_back({at, (ptrdiff_t{at.z} * size.y + at.y) * size.x + at.x, glm::length(glm::vec3(at))});
  }
  for (const int way : {1, -1}) {
    const glm::ivec3 first = way > 0 ? glm::ivec3(0) : size - 1;
    const auto is_inside = [](int at, int limit) { return at >= 0 && at < limit; };
    for (int z = first.z; is_inside(z, size.z); z += way)
      for (int y = first.y; is_inside(y, size.y); y += way)
        for (int x = first.x; is_inside(x, size.x); x += way) {
          const ptrdiff_t here = (ptrdiff_t{z} * size.y + y) * size.x + x;
          float& nearest = distance[static_cast<size_t>(here)];
          for (const Neighbour& other : behind)
            if (is_inside(x + way * other.at.x, size.x) && is_inside(y + way * other.at.y, size.y) &&
                is_inside(z + way * other.at.z, size.z))
              nearest =
                  std::min(nearest, distance[static_cast<size_t>(here + way * other.offset)] + other.cells);
        }
  }
}

/// Distances to the mesh in cells, negative inside; empty where the mesh is of no use.
std::vector<float> mesh_distances(const Mesh& mesh, const HeadOccupancy& grid) {
  const std::vector<Corners> triangles = usable_triangles(mesh, grid);
  const size_t cells = static_cast<size_t>(grid.size.x) * grid.size.y * grid.size.z;
  uint64_t visits = 0;
  std::vector<int8_t> votes(cells);
  for (int axis = 0; axis < 3; ++axis) {
    LineVotes lines(grid.size, axis);
    for (const Corners& triangle : triangles) {
      visits += lines.add(triangle);
      if (visits > kMaxVisits) return {};
    }
    lines.count(votes);
  }
  std::vector<float> distance(cells, kFarCells * kFarCells);
  for (const Corners& triangle : triangles) {
    visits += add_distances(triangle, grid.size, distance);
    if (visits > kMaxVisits) return {};
  }
  for (float& squared : distance) squared = std::sqrt(squared);
  forget_within(grid.size, votes, distance);
  spread_distances(grid.size, distance);
  for (size_t i = 0; i < cells; ++i)
    if (votes[i] > 0) distance[i] = -distance[i];
  return distance;
}

}  // namespace

HeadOccupancy make_head_occupancy(const Mesh& mesh, const OccupancyRequest& request) {
  // No more than what there is.
  glm::vec3 low(kFarHeadM), high(-kFarHeadM);
  for (const glm::uvec3& corner : mesh.triangle)
    for (int k = 0; k < 3; ++k) {
      const glm::vec3& p = mesh.position_m[corner[k]];
      if (!(std::abs(p.x) < kFarHeadM && std::abs(p.y) < kFarHeadM && std::abs(p.z) < kFarHeadM)) continue;
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  if (request.ball) {
    low = glm::min(low, request.ball->center_m - request.ball->radius_m);
    high = glm::max(high, request.ball->center_m + request.ball->radius_m);
  }
  low = glm::max(low, request.low_m);
  high = glm::min(high, request.high_m);
  HeadOccupancy head;
  if (!(low.x < high.x && low.y < high.y && low.z < high.z) || !(request.cell_m > 0.0f)) return head;
  constexpr float kLarger = 1.1f;
  for (head.cell_m = request.cell_m;; head.cell_m *= kLarger) {
    // A layer of cells around it: what is outside is outside in the grid as well.
    const glm::vec3 cells = (high - low) / head.cell_m + 4.0f;
    if (cells.x * cells.y * cells.z <= static_cast<float>(kMaxOccupancyCells)) break;
  }
  head.origin_m = low - head.cell_m;
  head.size = cells_of(high - low + 2.0f * head.cell_m, head.cell_m);

  std::vector<float> distance = mesh_distances(mesh, head);
  const auto ball_distance = [&](int x, int y, int z) {
    const glm::vec3 place = head.origin_m + head.cell_m * glm::vec3(x, y, z) - request.ball->center_m;
    return (glm::length(place) - request.ball->radius_m) / head.cell_m;
  };
  const auto for_cells = [&](const auto& visit) {
    size_t i = 0;
    for (int z = 0; z < head.size.z; ++z)
      for (int y = 0; y < head.size.y; ++y)
        for (int x = 0; x < head.size.x; ++x) visit(i++, x, y, z);
  };
  size_t of_ball = 0, of_both = 0;
  if (request.ball)
    for_cells([&](size_t i, int x, int y, int z) {
      if (ball_distance(x, y, z) >= 0.0f) return;
      ++of_ball;
      if (!distance.empty() && distance[i] < 0.0f) ++of_both;
    });
  if (distance.empty() && of_ball == 0) return {};
  head.distance.resize(static_cast<size_t>(head.size.x) * head.size.y * head.size.z);
  // A mesh that leaves most of the ball empty does not hold together.
  head.has_ball = 2 * of_both < of_ball;
  if (distance.empty()) distance.assign(head.distance.size(), kFarCells);
  bool is_solid = false;
  for_cells([&](size_t i, int x, int y, int z) {
    const float cells = head.has_ball ? std::min(distance[i], ball_distance(x, y, z)) : distance[i];
    head.distance[i] =
        static_cast<int8_t>(std::lround(std::clamp(cells * kDistanceStepsPerCell, -kMostSteps, kMostSteps)));
    is_solid = is_solid || cells < 0.0f;
  });
  return is_solid ? head : HeadOccupancy();
}

HeadOccupancy make_head_occupancy(const SceneAsset& asset, const std::optional<FittedSphere>& skull) {
  if (asset.head.triangle.empty() || asset.rest_position_m.empty()) return {};
  OccupancyRequest request;
  request.ball = skull;
  glm::vec3 low(kFarHeadM), high(-kFarHeadM);
  for (const glm::vec3& p : asset.rest_position_m) {
    if (!(std::abs(p.x) < kFarHeadM && std::abs(p.y) < kFarHeadM && std::abs(p.z) < kFarHeadM)) continue;
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  if (skull) {
    low = glm::min(low, skull->center_m - skull->radius_m);
    high = glm::max(high, skull->center_m + skull->radius_m);
  }
  const float extent_m = std::max({high.x - low.x, high.y - low.y, high.z - low.z});
  if (!(extent_m > 0.0f)) return {};
  request.low_m = low - kRoomShare * extent_m;
  request.high_m = high + kRoomShare * extent_m;
  request.cell_m = extent_m / kCellsAlong;
  return make_head_occupancy(asset.head, request);
}

}  // namespace strandcast
