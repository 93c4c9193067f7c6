// Resolve pass: the samples of the scene over the background into an sRGB picture.

#include <epoxy/gl.h>

#include "common/render/passes/backdrop.h"
#include "common/render/render_path.h"

namespace strandcast {
namespace {

constexpr uint32_t kSceneUnit = 0;
constexpr uint32_t kLayerUnit = 1;

gl::Resources resolved(const RenderScene& scene) {
  if (scene.has_strand_layer()) return {&scene.scene, &scene.strand_layer};
  return {&scene.scene};
}

class ResolvePass final : public RenderPass {
 public:
  explicit ResolvePass(RenderScene& scene)
      : Pass({"render/resolve", resolved(scene), {&scene.picture}, true, {}}), scene_(scene) {}

  Status prepare(const RenderSetup& setup) override {
    RETURN_IF_ERROR(backdrop_.prepare(setup.shaders, {"render/resolve.vert", "render/resolve.frag"},
                                      {{"HAS_LAYER", scene_.has_strand_layer() ? 1 : 0},
                                       {"IS_MULTISAMPLED", scene_.scene.layout().multisamples > 1 ? 1 : 0}}));
    no_attributes_ = gl::VertexArray("resolve");
    return {};
  }

  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(scene_.picture.resize(turn.size_px));
    scene_.picture.begin();
    ASSIGN_OR_RETURN(const gl::Program* const used, backdrop_.use(turn.terms.backdrop));
    const gl::Program& program = *used;
    no_attributes_.bind();
    scene_.scene.color().bind(kSceneUnit);
    if (scene_.has_strand_layer()) scene_.strand_layer.color().bind(kLayerUnit);
    program.set("u_layer", static_cast<int>(kLayerUnit));
    program.set("u_scene", static_cast<int>(kSceneUnit));
    program.set("u_samples", static_cast<int>(scene_.scene.layout().per_side));
    program.set("u_target_height", static_cast<int>(turn.size_px.y));
    program.set("u_background", scene_.look.background);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return {};
  }

 private:
  RenderScene& scene_;
  Backdrop backdrop_;
  gl::VertexArray no_attributes_;
};

}  // namespace

std::unique_ptr<RenderPass> make_resolve_pass(RenderScene& scene) {
  return std::make_unique<ResolvePass>(scene);
}

}  // namespace strandcast
