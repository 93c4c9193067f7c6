// Triangle meshes: the scalp that hair grows on and the head that is drawn under it. Plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

inline constexpr uint64_t kMaxMeshFileBytes = 64ull << 20;

/// Wavefront OBJ: v, vn and f (polygons are fanned); normals are computed when absent, averaged when a vertex
/// has several. Coordinates are multiplied by unit_m. Other statements are skipped. BadInput names file and
/// line.
Result<Mesh> load_obj(const std::filesystem::path& path, float unit_m);

/// As load_obj, from text; `place` names it in errors.
Result<Mesh> parse_obj(std::string_view text, const std::string& place, float unit_m);

/// Unit normals from the triangles around each vertex, weighted by their area; +Y for a vertex without any.
std::vector<glm::vec3> compute_normals(const std::vector<glm::vec3>& position_m,
                                       const std::vector<glm::uvec3>& triangle);

/// Hemispherical scalp cap of the given radius about `center_m`, open at the face and neck; about
/// `vertex_target` evenly spread vertices with outward normals.
Mesh make_scalp_cap(const glm::vec3& center_m, float radius_m, uint32_t vertex_target);

/// The built-in head: cranium, face, ears and neck in the given size (cranium radius); origin as in head
/// space.
Mesh make_head(float radius_m);

struct FittedSphere {
  glm::vec3 center_m{0.0f};
  float radius_m = 0.1f;
};

/// Least-squares sphere through points (algebraic fit); falls back to the bounding sphere for degenerate
/// sets.
FittedSphere fit_sphere(const std::vector<glm::vec3>& points_m);

}  // namespace strandcast
