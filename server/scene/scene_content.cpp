#include "server/scene/scene_content.h"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

#include "common/groom/bust_skin.h"
#include "common/groom/head_fit.h"
#include "common/groom/head_measure.h"
#include "common/groom/head_shape.h"
#include "common/groom/head_spheres.h"
#include "common/groom/mesh_fit.h"
#include "common/groom/procedural.h"
#include "common/groom/restyled.h"
#include "common/scene/file_groom.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"

namespace strandcast {
namespace {

/// Cranium when neither the scene nor a groom gives one: an adult head.
constexpr float kDefaultHeadRadiusM = 0.095f;
constexpr uint32_t kScalpVertices = 2'000;
/// Least share of the box of a target's hair that lies in the box of the scene's hair.
constexpr double kLeastTargetShare = 0.1;
glm::vec3 head_center(const HeadDesc& head) {
  return head.has_center ? head.center_m : glm::vec3(0.0f);
}

/// Hair that grows has the length and the curls that are asked for; those of a file are changed.
Result<Groom> grow_hair_of(const SceneDesc& scene, const ProceduralGroomDesc& procedural,
                           const HairControls& hair) {
  const auto length = static_cast<float>(hair.length), curl = static_cast<float>(hair.curl);
  const float radius_m = scene.head.radius_m > 0.0f ? scene.head.radius_m : kDefaultHeadRadiusM;
  ProceduralGroomOptions options;
  options.strand_count = procedural.strand_count;
  options.vertex_count = procedural.vertex_count;
  options.length_m = std::min(length * procedural.length_m, kMaxGrownLengthM);
  options.length_variation = procedural.length_variation;
  options.curl_radius_m = std::min(curl * procedural.curl_radius_m, kMaxCurlRadiusM);
  options.curl_turns = std::min(length * procedural.curl_turns, kMaxCurlTurns);
  options.seed = procedural.seed;
  // Where no head is seen or felt hair just hangs.
  options.has_bust = scene.head.is_visible || (scene.colliders.empty() && scene.has_auto_collider);
  // Grown strands come in prefix order already.
  return grow_groom(make_scalp_cap(head_center(scene.head), radius_m, kScalpVertices), options);
}

/// Corners of the box around a groom.
std::pair<glm::dvec3, glm::dvec3> box_of(const Groom& groom) {
  std::pair<glm::dvec3, glm::dvec3> box(groom.rest_position_m.front(), groom.rest_position_m.front());
  for (const glm::vec3& point : groom.rest_position_m)
    box = {glm::min(box.first, glm::dvec3(point)), glm::max(box.second, glm::dvec3(point))};
  return box;
}

/// Other hair on the same head, to whose volume the scene's is driven.
Result<Groom> load_target_of(const SceneDesc& scene, const Groom& groom) {
  const GroomDesc& desc = *scene.target_groom;
  Groom target;
  if (const auto* file = std::get_if<FileGroomDesc>(&desc)) {
    ASSIGN_OR_RETURN(const FileGroom hair, load_file_groom(*file));
    target = hair.simulated();
  } else {
    ASSIGN_OR_RETURN(target, grow_hair_of(scene, std::get<ProceduralGroomDesc>(desc), {}));
  }
  const auto own = box_of(groom), other = box_of(target);
  const glm::dvec3 shared =
      glm::max(glm::min(own.second, other.second) - glm::max(own.first, other.first), glm::dvec3(0.0));
  const glm::dvec3 size = other.second - other.first;
  const double share = shared.x * shared.y * shared.z / std::max(size.x * size.y * size.z, 1e-12);
  if (share < kLeastTargetShare)
    return make_error(
        ErrorCode::BadInput,
        "the target's hair lies elsewhere than the scene's: {:.0f} % of its box is shared, at least {:.0f} "
        "% have to be; is it of another head, or in another unit?",
        100.0 * share, 100.0 * kLeastTargetShare);
  return target;
}

/// Meshes of the groom's file: the same unit, axes and origin. Several are joined.
Result<ObjMesh> load_head_meshes(const HeadDesc& head, const GroomPlacement& placement) {
  std::vector<std::filesystem::path> paths = {head.mesh_path};
  paths.insert(paths.end(), head.more_mesh_paths.begin(), head.more_mesh_paths.end());
  // A file in centimetres has its head at 160: limits are of metres.
  GroomPlacement of_metres = placement;
  of_metres.unit_m = 1.0f;
  of_metres.origin *= placement.unit_m;
  ObjMesh whole;
  for (const std::filesystem::path& path : paths) {
    ASSIGN_OR_RETURN(const ObjMesh part, load_obj(path, placement.unit_m));
    for (const std::string& note : part.notes) whole.notes.push_back(path.string() + ": " + note);
    if (whole.triangle.size() + part.triangle.size() > kMaxMeshTriangles)
      return at(path.string(), make_error(ErrorCode::LimitExceeded,
                                          "{} triangles with the meshes before it, at most {} are allowed",
                                          whole.triangle.size() + part.triangle.size(), kMaxMeshTriangles));
    const auto first = static_cast<uint32_t>(whole.position_m.size());
    for (const glm::vec3& position : part.position_m) whole.position_m.push_back(of_metres.place(position));
    for (const glm::vec3& normal : part.normal) whole.normal.push_back(placement.turn(normal));
    for (const glm::uvec3& triangle : part.triangle) whole.triangle.push_back(triangle + first);
  }
  return whole;
}

/// The head under the hair as loaded, drawn or not.
Result<ObjMesh> make_head_under(const SceneDesc& scene, const Groom& groom, const GroomPlacement& placement) {
  const HeadDesc& desc = scene.head;
  if (!desc.mesh_path.empty()) return load_head_meshes(desc, placement);
  if (!std::holds_alternative<FileGroomDesc>(scene.groom)) {
    const FittedSphere skull{head_center(desc), desc.radius_m > 0.0f ? desc.radius_m : kDefaultHeadRadiusM};
    return ObjMesh{HeadShape(groom, skull, HeadFit::BustOnly).mesh(), {}};
  }
  // Under a groom from a file the built-in head is fitted, but for what the scene says of it.
  FittedSphere fitted = fit_head(groom);
  if (desc.has_center) fitted.center_m = desc.center_m;
  const HeadFit fit = desc.radius_m > 0.0f ? HeadFit::BustOnly : HeadFit::Whole;
  if (fit == HeadFit::BustOnly) fitted.radius_m = desc.radius_m;
  return ObjMesh{HeadShape(groom, fitted, fit).mesh(), {}};
}

/// A mesh beyond what a head's may reach is of another unit: `unlikely` may say of which.
Status check_extent(const Mesh& head, const SceneDesc& scene, const std::string& unlikely) {
  float largest = 0.0f;
  for (const glm::vec3& point : head.position_m)
    for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(point[axis]));
  if (largest <= kMaxMeshExtentM) return {};
  return at(scene.head.mesh_path.string(),
            make_error(ErrorCode::BadInput, "a coordinate of {} m, allowed is +-{} m: check the unit{}{}",
                       largest, kMaxMeshExtentM, unlikely.empty() ? "" : "; ", unlikely));
}

}  // namespace

std::vector<SphereCollider> colliders_of(const SceneDesc& scene,
                                         const std::vector<SphereCollider>& head_colliders) {
  if (!scene.colliders.empty()) return scene.colliders;
  return scene.has_auto_collider ? head_colliders : std::vector<SphereCollider>{};
}

SceneDesc with_material(SceneDesc scene, const HairMaterial& material) {
  if (scene.solver.name != "direct_rod") return scene;
  for (const auto& [parameter, value, factor] : {std::tuple("radius_m", material.diameter, 0.5),
                                                 {"young_modulus_pa", material.young_modulus, 1.0},
                                                 {"density_kgpm3", material.density, 1.0},
                                                 {"poisson_ratio", material.poisson_ratio, 1.0}})
    if (value) scene.solver.parameters.emplace(parameter, factor * *value);
  return scene;
}

Result<SceneContent> load_scene_content(const SceneDesc& scene) {
  SceneContent content;
  GroomPlacement placement;
  bool has_head = true;
  if (const auto* file = std::get_if<FileGroomDesc>(&scene.groom)) {
    ASSIGN_OR_RETURN(FileGroom hair, load_file_groom(*file));
    content.groom = hair.simulated();
    content.notes = std::move(hair.placed.notes);
    content.unlikely = std::move(hair.placed.unlikely);
    content.material = hair.placed.material;
    placement = hair.placed.placement;
    // Fur gets none, unless somebody says where it is.
    has_head = hair.placed.is_of_head || !scene.head.mesh_path.empty() || scene.head.has_center;
    if (!has_head)
      content.notes.emplace_back(
          "these roots are no head of hair: no head is put under it (head.center_m states where one is)");
  } else {
    ASSIGN_OR_RETURN(content.groom,
                     grow_hair_of(scene, std::get<ProceduralGroomDesc>(scene.groom), scene.hair));
  }
  if (scene.target_groom) {
    auto target = load_target_of(scene, content.groom);
    if (!target) return at("target_groom", target.error());
    content.volume_target = std::make_shared<const Groom>(std::move(target).value());
  }
  Mesh head;
  if (has_head) {
    ASSIGN_OR_RETURN(ObjMesh under, make_head_under(scene, content.groom, placement));
    content.notes.insert(content.notes.end(), under.notes.begin(), under.notes.end());
    head = std::move(under);
    const bool is_of_file = !scene.head.mesh_path.empty();
    const std::string unlikely =
        is_of_file ? unfit_mesh(head, content.groom, placement.place(glm::vec3(0.0f))) : std::string();
    RETURN_IF_ERROR(check_extent(head, scene, unlikely));
    add_sentence(content.unlikely, unlikely);
  }
  if (std::holds_alternative<FileGroomDesc>(scene.groom))
    content.groom = restyled(std::move(content.groom), scene.hair.length, scene.hair.curl);
  // From here on everybody has what viewers get (common/strands/asset/lattice.h).
  round_to_lattice(content.groom.rest_position_m, kRestStepBits);
  head = as_sent(head);
  std::vector<FittedSphere> spheres;
  if (scene.head.collider == kSphereCollider)
    spheres = shrink_under(fit_spheres(head, kHeadSpheres, content.groom), content.groom);
  for (const FittedSphere& sphere : spheres)
    content.head_colliders.push_back({sphere.center_m, sphere.radius_m});
  if (std::holds_alternative<FileGroomDesc>(scene.groom) && !spheres.empty())
    content.notes.push_back(to_sentence(measure_head(head, spheres, content.groom), spheres.size()));
  if (scene.head.collider == kFieldCollider && !head.triangle.empty()) {
    auto field = make_distance_field(head, scene.head.field_resolution);
    if (!field) return at(scene.head.mesh_path.empty() ? "head.collider" : "head.mesh_path", field.error());
    content.notes.push_back(to_sentence(measure_inside(*field, content.groom), *field));
    content.head_field = std::make_shared<const DistanceField>(std::move(field).value());
  }
  content.bust = find_bust(head);
  content.colliders = colliders_of(scene, content.head_colliders);
  if (scene.head.is_visible) content.head = std::move(head);
  return content;
}

}  // namespace strandcast
