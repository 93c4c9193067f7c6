// Light pass: sums the key strands into the light volume and hands it to the GPU.

#include "common/render/light_volume.h"
#include "common/render/look_lights.h"
#include "common/render/render_path.h"

namespace strandcast {
namespace {

class LightPass final : public RenderPass {
 public:
  explicit LightPass(RenderScene& scene)
      : Pass({"render/light", {&scene.strands}, {&scene.light, &scene.density}, true, {}},
             gl::PassClock::Host),
        scene_(scene),
        volume_(scene.light_volume) {}

  Status run(RenderTurn& turn) override {
    const LookDesc& look = scene_.look;
    const glm::vec3 to_light = to_light_in_head(look.light_direction, turn.strands.world_from_head.rotation);
    volume_.build(turn.strands.position_m, to_light);
    scene_.light.upload(volume_);
    scene_.light.set_light(look, turn.view, to_light);
    if (scene_.features.has_density_normals.value) scene_.density.upload(volume_);
    return {};
  }

 private:
  RenderScene& scene_;
  LightVolume volume_;
};

}  // namespace

std::unique_ptr<RenderPass> make_light_pass(RenderScene& scene) {
  return std::make_unique<LightPass>(scene);
}

}  // namespace strandcast
