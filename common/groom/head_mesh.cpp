// Meshes the built-in head by dual vertices: one vertex in every grid cell that the surface crosses, one quad
// round every grid edge that it crosses. The grid is finer where the face has detail.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

#include "common/groom/head_field.h"
#include "common/groom/mesh.h"

namespace strandcast {
namespace {

constexpr float kCoarse = 0.125f;  // cell width in skull radii
constexpr float kFine = 0.032f;
constexpr int kProjections = 4;  // of each vertex onto the surface
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
    for_each(size_ - 1, [&](const glm::ivec3& at) {
      for (int axis = 0; axis < 3; ++axis) add_quad(at, axis);
    });
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

  /// Layer by layer; of each one half, and its mirror image.
  void measure_corners() {
    const int middle = size_.x / 2;
    std::vector<glm::vec3> corners;
    for (int z = 0; z < size_.z; ++z) {
      corners.clear();
      for (int y = 0; y < size_.y; ++y)
        for (int x = middle; x < size_.x; ++x) corners.push_back(corner({x, y, z}));
      const std::vector<float> distances = head_distances(corners);
      auto distance = distances.begin();
      for (int y = 0; y < size_.y; ++y)
        for (int x = middle; x < size_.x; ++x) {
          distance_[index_of({2 * middle - x, y, z})] = *distance;
          distance_[index_of({x, y, z})] = *distance++;
        }
    }
  }

  /// A vertex at the mean of the crossings on the cell's edges.
  void add_vertex(const glm::ivec3& cell) {
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
    if (crossings == 0) return;
    vertex_[index_of(cell)] = static_cast<uint32_t>(mesh_.position_m.size());
    mesh_.position_m.push_back(sum / static_cast<float>(crossings));
    cell_of_vertex_.push_back(cell);
  }

  /// Moves the vertices onto the surface.
  void project() {
    for (int round = 0; round < kProjections; ++round) {
      const std::vector<float> distance = head_distances(mesh_.position_m);
      const std::vector<glm::vec3> normal = head_normals(mesh_.position_m);
      for (size_t i = 0; i < distance.size(); ++i) {
        // Kept inside of its cell, so that neighbouring quads never fold over each other.
        glm::vec3& point = mesh_.position_m[i];
        const glm::ivec3& cell = cell_of_vertex_[i];
        point = glm::clamp(point - distance[i] * normal[i], corner(cell), corner(cell + 1));
      }
    }
    mesh_.normal = head_normals(mesh_.position_m);
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

}  // namespace strandcast
