#include "common/strands/head/head_mesh.h"

// By dual vertices: one vertex in every grid cell that the surface crosses, one quad
// round every grid edge that it crosses. The grid is finer where the face has detail.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>

#include "common/strands/head/head_field.h"

namespace strandcast {
namespace {

constexpr float kCoarse = 0.125f;  // cell width in skull radii
constexpr float kFine = 0.032f;
constexpr int kProjections = 4;  // of each vertex onto the surface
constexpr int kBlock = 3;        // grid cells, along each axis, that are looked at together
/// Points of a block that leave it by no more than this are still near it.
constexpr float kLeastReach = 0.004f;
/// Where a block is further from the surface than this share of its size all of it is on one side.
constexpr float kFarReaches = 3.0f;
constexpr uint32_t kNoTriangle = std::numeric_limits<uint32_t>::max();

struct Range {
  float low, high;
};
/// Where lines are fine: face and ears, of both sides.
constexpr std::array<Range, 2> kDetailX = {Range{-0.01f, 0.55f}, Range{0.84f, 1.07f}};
constexpr std::array<Range, 1> kDetailY = {Range{-1.12f, 0.06f}};
constexpr std::array<Range, 2> kDetailZ = {Range{-0.20f, 0.20f}, Range{0.62f, 1.25f}};
constexpr std::array<std::span<const Range>, 3> kDetail = {kDetailX, kDetailY, kDetailZ};

/// Grid coordinates of one axis: fine inside of its detail ranges, coarse outside.
std::vector<float> grid_line(int axis) {
  const bool is_mirrored = axis == 0;
  std::vector<float> line{is_mirrored ? 0.0f : kHeadLow[axis]};
  const auto is_fine = [&](float at) {
    return std::any_of(kDetail[axis].begin(), kDetail[axis].end(),
                       [&](const Range& range) { return at >= range.low - kFine && at < range.high; });
  };
  while (line.back() < kHeadHigh[axis]) {
    // A coarse step ends where lines become fine.
    float step = is_fine(line.back()) ? kFine : kCoarse;
    for (const Range& range : kDetail[axis])
      if (line.back() < range.low - kFine) step = std::min(step, range.low - line.back());
    line.push_back(line.back() + step);
  }
  if (!is_mirrored) return line;
  std::vector<float> whole;
  for (size_t i = line.size() - 1; i > 0; --i) whole.push_back(-line[i]);
  whole.insert(whole.end(), line.begin(), line.end());
  return whole;
}

class HeadMesher {
 public:
  HeadMesher() {
    for (int axis = 0; axis < 3; ++axis) line_[axis] = grid_line(axis);
    size_ = glm::ivec3(line_[0].size(), line_[1].size(), line_[2].size());
    distance_.resize(static_cast<size_t>(size_.x) * size_.y * size_.z);
    vertex_.assign(distance_.size(), kNoTriangle);
    measure_corners();
  }

  /// Builds the mesh, in skull radii.
  Mesh build() {
    for_each(size_ - 1, [&](const glm::ivec3& cell) { add_vertex(cell); });
    project();
    for (const glm::ivec3& at : cell_of_vertex_)
      for (int axis = 0; axis < 3; ++axis) add_quad(at, axis);
    return std::move(mesh_);
  }

 private:
  template <class Visit>
  static void for_each(const glm::ivec3& size, const Visit& visit) {
    for (int z = 0; z < size.z; ++z) {
      for (int y = 0; y < size.y; ++y) {
        for (int x = 0; x < size.x; ++x) visit(glm::ivec3(x, y, z));
      }
    }
  }

  size_t index_of(const glm::ivec3& at) const {
    return (static_cast<size_t>(at.z) * size_.y + at.y) * size_.x + at.x;
  }
  glm::vec3 corner(const glm::ivec3& at) const { return {line_[0][at.x], line_[1][at.y], line_[2][at.z]}; }
  bool is_inside(const glm::ivec3& at) const { return distance_[index_of(at)] < 0.0f; }
  static glm::ivec3 step(int axis) { return {axis == 0, axis == 1, axis == 2}; }

  bool is_crossed(const glm::ivec3& cell) const {
    const float* const corner = &distance_[index_of(cell)];
    const auto row = static_cast<size_t>(size_.x), layer = row * static_cast<size_t>(size_.y);
    const bool is_first_inside = corner[0] < 0.0f;
    for (const size_t beside : {size_t{1}, row, row + 1, layer, layer + 1, layer + row, layer + row + 1})
      if ((corner[beside] < 0.0f) != is_first_inside) return true;
    return false;
  }

  /// Visits a half of the grid in blocks of up to kBlock corners along each axis: first, past the last.
  template <class Visit>
  void for_each_block(const Visit& visit) const {
    const glm::ivec3 first(size_.x / 2, 0, 0);
    for_each((size_ - first + kBlock - 1) / kBlock, [&](const glm::ivec3& block) {
      const glm::ivec3 begin = first + block * kBlock;
      visit(begin, glm::min(begin + kBlock, size_));
    });
  }

  /// Of one half, and its mirror image. Only signs matter far from the surface.
  void measure_corners() {
    const int middle = size_.x / 2;
    for_each_block([&](const glm::ivec3& begin, const glm::ivec3& end) {
      const glm::vec3 low = corner(begin), high = corner(end - 1), about = 0.5f * (low + high);
      const float reach = 0.5f * glm::distance(low, high) + kLeastReach, there = head_distance(about);
      std::vector<glm::vec3> corners;
      for_each(end - begin, [&](const glm::ivec3& at) { corners.push_back(corner(begin + at)); });
      const std::vector<float> distances = std::abs(there) > kFarReaches * reach
                                               ? std::vector<float>(corners.size(), there)
                                               : NearHead(about, reach).distances(corners);
      auto distance = distances.begin();
      for_each(end - begin, [&](const glm::ivec3& at) {
        const glm::ivec3 place = begin + at;
        distance_[index_of({2 * middle - place.x, place.y, place.z})] = *distance;
        distance_[index_of(place)] = *distance++;
      });
    });
  }

  /// A vertex at the mean of the crossings on the cell's edges.
  void add_vertex(const glm::ivec3& cell) {
    if (!is_crossed(cell)) return;
    glm::vec3 sum(0.0f);
    int crossings = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const glm::ivec3 along = step(axis), side = step((axis + 1) % 3), up = step((axis + 2) % 3);
      for (int edge = 0; edge < 4; ++edge) {
        const glm::ivec3 from = cell + (edge & 1) * side + (edge >> 1) * up, to = from + along;
        if (is_inside(from) == is_inside(to)) continue;
        const float a = distance_[index_of(from)], b = distance_[index_of(to)];
        sum += glm::mix(corner(from), corner(to), a / (a - b));
        ++crossings;
      }
    }
    vertex_[index_of(cell)] = static_cast<uint32_t>(mesh_.position_m.size());
    mesh_.position_m.push_back(sum / static_cast<float>(crossings));
    cell_of_vertex_.push_back(cell);
  }

  /// Moves the vertices onto the surface, those of a block of cells together.
  void project() {
    mesh_.normal.resize(mesh_.position_m.size());
    std::map<std::array<int, 3>, std::vector<uint32_t>> blocks;
    for (uint32_t i = 0; i < cell_of_vertex_.size(); ++i) {
      const glm::ivec3 block = cell_of_vertex_[i] / kBlock;
      blocks[{block.x, block.y, block.z}].push_back(i);
    }
    for (const auto& [block, vertices] : blocks) {
      const glm::ivec3 first = kBlock * glm::ivec3(block[0], block[1], block[2]);
      project({first, glm::min(first + kBlock, size_ - 1)}, vertices);
    }
  }
  void project(const std::pair<glm::ivec3, glm::ivec3>& cells, const std::vector<uint32_t>& vertices) {
    const glm::vec3 low = corner(cells.first), high = corner(cells.second);
    const NearHead head(0.5f * (low + high), 0.5f * glm::distance(low, high) + kLeastReach);
    std::vector<glm::vec3> points;
    for (const uint32_t vertex : vertices) points.push_back(mesh_.position_m[vertex]);
    for (int round = 0; round < kProjections; ++round) {
      const std::vector<float> distance = head.distances(points);
      const std::vector<glm::vec3> normal = head.normals(points);
      for (size_t i = 0; i < points.size(); ++i) {
        // Kept inside of its cell, so that neighbouring quads never fold over each other.
        const glm::ivec3& cell = cell_of_vertex_[vertices[i]];
        points[i] = glm::clamp(points[i] - distance[i] * normal[i], corner(cell), corner(cell + 1));
      }
    }
    const std::vector<glm::vec3> normal = head.normals(points);
    for (size_t i = 0; i < points.size(); ++i) {
      mesh_.position_m[vertices[i]] = points[i];
      mesh_.normal[vertices[i]] = normal[i];
    }
  }

  /// The quad of the four cells round a grid edge that crosses the surface.
  void add_quad(const glm::ivec3& at, int axis) {
    const glm::ivec3 side = step((axis + 1) % 3), up = step((axis + 2) % 3);
    if (at[(axis + 1) % 3] == 0 || at[(axis + 2) % 3] == 0) return;
    const bool is_from_inside = is_inside(at);
    if (is_from_inside == is_inside(at + step(axis))) return;
    std::array<uint32_t, 4> quad = {vertex_[index_of(at - side - up)], vertex_[index_of(at - up)],
                                    vertex_[index_of(at)], vertex_[index_of(at - side)]};
    if (!is_from_inside) std::swap(quad[1], quad[3]);
    const auto span = [&](int a, int b) {
      return glm::distance(mesh_.position_m[quad[a]], mesh_.position_m[quad[b]]);
    };
    const int turn = span(0, 2) <= span(1, 3) ? 0 : 1;
    const auto corner_at = [&](int i) { return quad[(i + turn) % 4]; };
    mesh_.triangle.emplace_back(corner_at(0), corner_at(1), corner_at(2));
    mesh_.triangle.emplace_back(corner_at(0), corner_at(2), corner_at(3));
  }

  std::array<std::vector<float>, 3> line_;
  glm::ivec3 size_{0};
  std::vector<float> distance_;   // by grid corner
  std::vector<uint32_t> vertex_;  // by cell
  std::vector<glm::ivec3> cell_of_vertex_;
  Mesh mesh_;
};

}  // namespace

Mesh make_head(float radius_m) {
  static const Mesh kUnitHead = HeadMesher().build();
  Mesh mesh = kUnitHead;
  for (glm::vec3& point : mesh.position_m) point *= radius_m;
  return mesh;
}

std::vector<glm::vec3> compute_normals(const std::vector<glm::vec3>& position_m,
                                       const std::vector<glm::uvec3>& triangle) {
  std::vector<glm::dvec3> sum(position_m.size(), glm::dvec3(0.0));
  for (const glm::uvec3& corner : triangle) {
    const glm::dvec3 a = position_m[corner.x], b = position_m[corner.y], c = position_m[corner.z];
    const glm::dvec3 area = glm::cross(b - a, c - a);
    for (int i = 0; i < 3; ++i) sum[corner[i]] += area;
  }
  std::vector<glm::vec3> normal(position_m.size(), glm::vec3(0.0f, 1.0f, 0.0f));
  for (size_t i = 0; i < normal.size(); ++i) {
    if (glm::dot(sum[i], sum[i]) > 0.0) normal[i] = glm::vec3(glm::normalize(sum[i]));
  }
  return normal;
}

}  // namespace strandcast
