// SceneContent: the loaded contents of a SceneDesc: groom, head mesh and colliders. Any thread, no GL.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/distance_field.h"
#include "common/groom/groom.h"
#include "common/groom/mesh.h"
#include "common/groom/stated_groom.h"
#include "common/math/bust.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct SceneContent {
  Groom groom;  // uniform, every prefix covers the head evenly
  Mesh head;    // empty when not visible
  // Head space: the head as spheres, visible or not; empty where it collides as a field.
  std::vector<SphereCollider> head_colliders;
  std::vector<SphereCollider> colliders;            // head space: the scene's own, or those of the head
  BustRig bust;                                     // of the head; none without shoulders
  std::vector<std::string> notes;                   // a sentence for each thing that was guessed or fitted
  std::string unlikely;                             // as PlacedGroom
  HairMaterial material;                            // likewise
  std::shared_ptr<const Groom> volume_target;       // head space; where the scene names one
  std::shared_ptr<const DistanceField> head_field;  // head space; where the scene asks for one
};

/// Loads or grows the groom and the head. Errors name the file or option.
Result<SceneContent> load_scene_content(const SceneDesc& scene);

/// Returns the scene with the solver's parameters as the hair's material says. Parameters that the scene sets
/// stay.
SceneDesc with_material(SceneDesc scene, const HairMaterial& material);

/// Returns the scene's colliders, or the head's if the scene lists none and does not disable them. Head
/// space.
std::vector<SphereCollider> colliders_of(const SceneDesc& scene,
                                         const std::vector<SphereCollider>& head_colliders);

}  // namespace strandcast
