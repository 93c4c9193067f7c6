// Closed meshes whose distance is known.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "common/groom/mesh.h"

namespace strandcast {

/// About the origin: 20 * 4^depth triangles, facing outwards.
inline Mesh make_icosphere(float radius_m, uint32_t depth) {
  const float g = 0.5f * (1.0f + std::sqrt(5.0f));
  Mesh mesh;
  mesh.position_m = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                     {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangle = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                   {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                   {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (uint32_t round = 0; round < depth; ++round) {
    std::map<std::pair<uint32_t, uint32_t>, uint32_t> middle;
    const auto between = [&](uint32_t a, uint32_t b) {
      const auto [found, is_new] = middle.try_emplace(std::minmax(a, b), mesh.position_m.size());
      if (is_new) mesh.position_m.push_back(mesh.position_m[a] + mesh.position_m[b]);
      return found->second;
    };
    for (glm::vec3& point : mesh.position_m) point = glm::normalize(point);
    std::vector<glm::uvec3> finer;
    for (const glm::uvec3& t : mesh.triangle) {
      const uint32_t a = between(t.x, t.y), b = between(t.y, t.z), c = between(t.z, t.x);
      for (const glm::uvec3& part : {glm::uvec3{t.x, a, c}, {t.y, b, a}, {t.z, c, b}, {a, b, c}})
        finer.push_back(part);
    }
    mesh.triangle = std::move(finer);
  }
  for (glm::vec3& point : mesh.position_m) point = radius_m * glm::normalize(point);
  mesh.normal = compute_normals(mesh.position_m, mesh.triangle);
  return mesh;
}

/// About the origin, facing outwards.
inline Mesh make_box(const glm::vec3& half_m) {
  Mesh mesh;
  for (uint32_t i = 0; i < 8; ++i)
    mesh.position_m.push_back(half_m * glm::vec3(i & 1u ? 1 : -1, i & 2u ? 1 : -1, i & 4u ? 1 : -1));
  mesh.triangle = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  mesh.normal = compute_normals(mesh.position_m, mesh.triangle);
  return mesh;
}

}  // namespace strandcast
