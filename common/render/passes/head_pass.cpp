// Head pass: the mesh under the hair, with skin that is lit and shadowed by the light volume.

#include "common/render/passes/head_mesh.h"
#include "common/render/render_path.h"
#include "common/render/shadow/shadow_method.h"
#include "common/scene/hair_color.h"

namespace strandcast {
namespace {

constexpr uint32_t kHeadLightUnit = 0;
// How far above the skin the hair's shadow is looked up.
constexpr float kShadowLiftCells = 1.0f;

class HeadPass final : public RenderPass {
 public:
  explicit HeadPass(RenderScene& scene)
      : Pass({"render/head",
              {&scene.light},
              {&scene.scene},
              scene.features.has_head_mesh.value,
              scene.features.has_head_mesh.reason}),
        scene_(scene),
        size_bytes_(HeadMesh::size_bytes(scene)) {}

  uint64_t size_bytes() const override { return size_bytes_; }

  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/head.vert", "render/head.frag"},
                                                 {{"SHADOW", static_cast<int>(scene_.methods.shadow)}}));
    mesh_ = HeadMesh(setup.asset, scene_);
    return {};
  }

  Status run(RenderTurn& turn) override {
    scene_.scene.begin();
    program_.use();
    scene_.light.set_uniforms(program_, kHeadLightUnit);
    if (scene_.shadow != nullptr) scene_.shadow->set_uniforms(program_, kFirstShadowUnit);
    program_.set("u_clip_from_head", turn.view.clip_from_head);
    program_.set("u_eye_m", turn.view.eye_m);
    program_.set("u_skin_color", scene_.look.skin_color);
    program_.set("u_root_color", colors_of(scene_.look).root);
    program_.set("u_shadow_lift_m", kShadowLiftCells * scene_.light_volume.cell_m);
    mesh_.pose(turn.strands.bust);
    mesh_.draw();
    return {};
  }

 private:
  RenderScene& scene_;
  uint64_t size_bytes_;
  gl::Program program_;
  HeadMesh mesh_;
};

}  // namespace

std::unique_ptr<RenderPass> make_head_pass(RenderScene& scene) {
  return std::make_unique<HeadPass>(scene);
}

}  // namespace strandcast
