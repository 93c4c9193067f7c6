#include "common/scene/scene_desc.h"

namespace strandcast {

LookDesc::LookDesc() = default;
LookDesc::LookDesc(const LookDesc&) = default;
LookDesc::LookDesc(LookDesc&&) noexcept = default;
LookDesc& LookDesc::operator=(const LookDesc&) = default;
LookDesc& LookDesc::operator=(LookDesc&&) noexcept = default;
LookDesc::~LookDesc() = default;
bool LookDesc::operator==(const LookDesc&) const = default;

SceneDesc::SceneDesc() = default;
SceneDesc::SceneDesc(const SceneDesc&) = default;
SceneDesc::SceneDesc(SceneDesc&&) noexcept = default;
SceneDesc& SceneDesc::operator=(const SceneDesc&) = default;
SceneDesc& SceneDesc::operator=(SceneDesc&&) noexcept = default;
SceneDesc::~SceneDesc() = default;
bool SceneDesc::operator==(const SceneDesc&) const = default;

SceneDesc built_in_scene() {
  SceneDesc scene;
  // A light breeze from the front left: strong enough to see, too weak to lift the hair off the head.
  scene.wind.mean_mps = {0.9f, 0.0f, -1.2f};
  scene.wind.gust_intensity = 0.5f;
  scene.solver.parameters["sag_free"] = 1.0;
  return scene;
}

}  // namespace strandcast
