#include "common/render/shadow/shadow_method.h"

#include <cmath>

#include "common/render/look_lights.h"

namespace strandcast {

std::unique_ptr<RenderPass> make_light_pass(RenderScene& scene);

namespace {

// Followers stray by little more than a hundredth of their length; curves swing out between vertices.
constexpr float kMarginShare = 0.02f;
constexpr float kLeastMarginM = 1e-3f;

using AddShadowPasses = void (*)(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes);

void add_volume(RenderScene& scene, ExpandWalks&, RenderPassList& passes) {
  passes.add(make_light_pass(scene));
}

constexpr AddShadowPasses kShadowMethods[] = {
    add_volume, add_none, add_deep_opacity, add_opacity_maps, add_density_rays, add_deep_shadow, add_hybrid};

/// The light itself, which nothing takes away.
class BareLightPass final : public RenderPass {
 public:
  explicit BareLightPass(RenderScene& scene)
      : Pass({"render/bare_light", {&scene.strands}, {&scene.light}, true, {}}, gl::PassClock::Host),
        scene_(scene) {}

  Status run(RenderTurn& turn) override {
    scene_.light.set_light(scene_.look, turn.view, to_light_in_head(scene_, turn));
    return {};
  }

 private:
  RenderScene& scene_;
};

}  // namespace

void add_none(RenderScene& scene, ExpandWalks&, RenderPassList& passes) {
  passes.add(std::make_unique<BareLightPass>(scene));
}

void add_shadow_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  kShadowMethods[static_cast<size_t>(scene.methods.shadow)](scene, walks, passes);
}

float shadow_margin_m(const RenderScene& scene) {
  return std::isfinite(scene.rest.extent_m) ? kMarginShare * scene.rest.extent_m + kLeastMarginM
                                            : kLeastMarginM;
}

glm::vec3 to_light_in_head(const RenderScene& scene, const RenderTurn& turn) {
  return to_light_in_head(scene.look.light_direction, turn.strands.world_from_head.rotation);
}

}  // namespace strandcast
