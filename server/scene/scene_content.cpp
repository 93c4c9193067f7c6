#include "server/scene/scene_content.h"

#include <algorithm>
#include <utility>

#include "common/groom/groom_file.h"
#include "common/groom/head_fit.h"
#include "common/groom/procedural.h"

namespace strandcast {
namespace {

/// Cranium when neither the scene nor a groom gives one: an adult head.
constexpr float kDefaultHeadRadiusM = 0.095f;
constexpr uint32_t kScalpVertices = 2'000;
/// This part of the roots may lie inside the fitted collider (ears, neck, stray roots).
constexpr double kInsideQuantile = 0.05;
/// Collider radius over the radius at that quantile.
constexpr float kColliderScale = 0.98f;

glm::vec3 head_center(const HeadDesc& head) {
  return head.has_center ? head.center_m : glm::vec3(0.0f);
}

Result<Groom> make_groom(const SceneDesc& scene) {
  if (const auto* file = std::get_if<FileGroomDesc>(&scene.groom)) {
    GroomFileOptions options;
    options.path = file->path;
    options.unit_m = file->unit_m;
    options.is_z_up = file->up_axis == UpAxis::Z;
    if (file->has_origin) options.origin = file->origin;
    options.vertex_count = file->vertex_count;
    if (file->has_pinning) options.pinning = file->pinning;
    ASSIGN_OR_RETURN(Groom groom, load_groom(options));
    return reorder(groom, make_prefix_order(groom));
  }
  const auto& procedural = std::get<ProceduralGroomDesc>(scene.groom);
  const float radius_m = scene.head.radius_m > 0.0f ? scene.head.radius_m : kDefaultHeadRadiusM;
  ProceduralGroomOptions options;
  options.strand_count = procedural.strand_count;
  options.vertex_count = procedural.vertex_count;
  options.length_m = procedural.length_m;
  options.length_variation = procedural.length_variation;
  options.curl_radius_m = procedural.curl_radius_m;
  options.curl_turns = procedural.curl_turns;
  options.seed = procedural.seed;
  // Grown strands come in prefix order already.
  return grow_groom(make_scalp_cap(head_center(scene.head), radius_m, kScalpVertices), options);
}

/// A mesh of the groom's file: the same unit, axes and origin. `shift_m` is what the groom was moved by.
Result<Mesh> load_head_mesh(const SceneDesc& scene, float unit_m, const glm::vec3& shift_m) {
  const auto* file = std::get_if<FileGroomDesc>(&scene.groom);
  ASSIGN_OR_RETURN(Mesh mesh, load_obj(scene.head.mesh_path, 1.0f));
  if (file == nullptr) return mesh;
  const bool is_z_up = file->up_axis == UpAxis::Z;
  const auto turn = [&](const glm::vec3& v) { return is_z_up ? glm::vec3(v.x, v.z, -v.y) : v; };
  const glm::vec3 origin = file->has_origin ? file->origin : glm::vec3(0.0f);
  for (glm::vec3& position : mesh.position_m) position = (turn(position) - origin) * unit_m + shift_m;
  for (glm::vec3& normal : mesh.normal) normal = turn(normal);
  return mesh;
}

/// Moves a groom whose file and scene do not say where the head joint is: the middle of the head, which a
/// head turns about much more nearly than about a file's origin between the feet. Returns the shift, m.
glm::vec3 centre_on_roots(Groom& groom) {
  const glm::vec3 shift_m = -fit_head_sphere(groom).center_m;
  for (glm::vec3& position : groom.rest_position_m) position += shift_m;
  return shift_m;
}

Result<Mesh> make_head_mesh(const SceneDesc& scene, const Groom& groom, const glm::vec3& shift_m) {
  if (!scene.head.is_visible) return Mesh{};
  if (!scene.head.mesh_path.empty()) return load_head_mesh(scene, groom.file_unit_m, shift_m);
  // Under a groom from a file the built-in head is put where its roots are, unless the scene says where.
  const bool is_fitted = std::holds_alternative<FileGroomDesc>(scene.groom);
  const FittedSphere fitted = is_fitted ? fit_head_sphere(groom) : FittedSphere{{}, kDefaultHeadRadiusM};
  const glm::vec3 center_m = scene.head.has_center ? scene.head.center_m : fitted.center_m;
  Mesh mesh = make_head(scene.head.radius_m > 0.0f ? scene.head.radius_m : fitted.radius_m);
  for (glm::vec3& position : mesh.position_m) position += center_m;
  return mesh;
}

}  // namespace

SphereCollider fit_head_collider(const Groom& groom) {
  const std::vector<glm::vec3> roots = roots_of(groom);
  const FittedSphere fitted = fit_head_sphere(groom);
  std::vector<float> distance_m(roots.size());
  std::transform(roots.begin(), roots.end(), distance_m.begin(),
                 [&](const glm::vec3& root) { return glm::length(root - fitted.center_m); });
  std::sort(distance_m.begin(), distance_m.end());
  const auto index = static_cast<size_t>(kInsideQuantile * static_cast<double>(distance_m.size() - 1));
  return {fitted.center_m, std::min(distance_m[index], fitted.radius_m) * kColliderScale};
}

std::vector<SphereCollider> colliders_of(const SceneDesc& scene, const Groom& groom) {
  if (!scene.colliders.empty()) return scene.colliders;
  if (!scene.has_auto_collider) return {};
  return {fit_head_collider(groom)};
}

Result<SceneContent> load_scene_content(const SceneDesc& scene) {
  SceneContent content;
  ASSIGN_OR_RETURN(content.groom, make_groom(scene));
  const auto* file = std::get_if<FileGroomDesc>(&scene.groom);
  const bool is_centred = file != nullptr && !file->has_origin;
  const glm::vec3 shift_m = is_centred ? centre_on_roots(content.groom) : glm::vec3(0.0f);
  ASSIGN_OR_RETURN(content.head, make_head_mesh(scene, content.groom, shift_m));
  content.colliders = colliders_of(scene, content.groom);
  return content;
}

}  // namespace strandcast
