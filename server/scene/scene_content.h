// SceneContent: what a SceneDesc refers to, loaded: groom, head mesh and colliders. Any thread, no GL.
#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/groom/mesh.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct SceneContent {
  Groom groom;                            // uniform, every prefix covers the head evenly
  Mesh head;                              // empty when not visible
  std::vector<SphereCollider> colliders;  // head space: the scene's own, or the one fitted to the roots
};

/// Loads or grows the groom and the head. Errors name the file or the option.
Result<SceneContent> load_scene_content(const SceneDesc& scene);

/// One sphere just inside the roots, so that hair rests on it without being pushed off its own root.
SphereCollider fit_head_collider(const Groom& groom);

/// Those of the scene; without any the fitted head, unless the scene wants none. Head space.
std::vector<SphereCollider> colliders_of(const SceneDesc& scene, const Groom& groom);

}  // namespace strandcast
