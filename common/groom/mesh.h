// Triangle meshes: the scalp that hair grows on and the head that is drawn under it. Plain data.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/strands/head/head_mesh.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

inline constexpr uint64_t kMaxMeshFileBytes = 64ull << 20;

/// A mesh, and a sentence for each kind of what was left out of its file.
struct ObjMesh : Mesh {
  std::vector<std::string> notes;
};

/// Loads a Wavefront OBJ file: v, vn and f (polygons become triangle fans); other statements are skipped.
/// Normals are computed if absent, and averaged if a vertex has several. Coordinates are multiplied by
/// unit_m, and reach up to 1000 kMaxMeshExtentM. Bad lines are left out (common/base/mercy.h). BadInput names
/// file and line.
Result<ObjMesh> load_obj(const std::filesystem::path& path, float unit_m);

/// Parses OBJ text like load_obj(); `place` names it in errors.
Result<ObjMesh> parse_obj(std::string_view text, const std::string& place, float unit_m);

/// Makes a hemispherical scalp of the given radius about `center_m`, open at face and neck. It has about
/// `vertex_target` evenly spread vertices with outward normals.
Mesh make_scalp_cap(const glm::vec3& center_m, float radius_m, uint32_t vertex_target);

struct FittedSphere {
  glm::vec3 center_m{0.0f};
  float radius_m = 0.1f;
};

/// Fits a sphere to points by least squares (algebraic fit); degenerate sets give their bounding sphere.
FittedSphere fit_sphere(const std::vector<glm::vec3>& points_m);

}  // namespace strandcast
