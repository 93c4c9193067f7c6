// Light pass: sums the key strands into the light volume and hands it to the GPU.

#include "common/render/light_volume.h"
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
    const glm::mat3 head_from_world(glm::transpose(glm::mat3_cast(turn.strands.world_from_head.rotation)));
    const float length = glm::length(look.light_direction);
    const glm::vec3 to_light_in_world =
        length > 0.0f ? -look.light_direction / length : glm::vec3(0.0f, 1.0f, 0.0f);
    const glm::vec3 to_light = glm::normalize(head_from_world * to_light_in_world);
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
