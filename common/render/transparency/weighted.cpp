// Weighted blended transparency (McGuire and Bavoil 2013): one draw, two targets, no order. Its weights know
// the depth of the window only, so that layers of hair, which are close together, are mixed nearly evenly: of
// twenty layers the front five get a quarter of the picture instead of 83 %. The cheapest of the blended
// methods.

#include <epoxy/gl.h>

#include "common/render/transparency/pixel_target.h"
#include "common/render/transparency/transparency.h"

namespace strandcast {
namespace {

constexpr size_t kSum = 0;
constexpr size_t kPassing = 1;

class WeightedPass final : public StrandDrawPass {
 public:
  WeightedPass(RenderScene& scene, ExpandedStrands& expanded, PixelTarget& target)
      : StrandDrawPass(
            scene, expanded,
            strand_pass(scene, "render/weighted", {&expanded, &scene.light, &scene.scene}, {&target}),
            "render/weighted.frag"),
        target_(target) {}

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(target_.resize(turn.size_px));
      target_.clear(kSum, 0.0f);
      target_.clear(kPassing, 1.0f);
    }
    target_.begin();
    begin_adding();
    glBlendFunci(kPassing, GL_ZERO, GL_SRC_COLOR);
    begin_blended(strands_, scene_, expanded_, turn);
    strands_.draw(scene_, expanded_);
    glDisable(GL_BLEND);
    return {};
  }

 private:
  PixelTarget& target_;
};

class WeightedBlendPass final : public LayerBlendPass {
 public:
  WeightedBlendPass(RenderScene& scene, PixelTarget& target)
      : LayerBlendPass(scene, "render/weighted_blend", {&target}, "render/weighted_blend.frag"),
        target_(target) {}

 private:
  void bind(const gl::Program& program) const override {
    target_.texture(kSum).bind(kSum);
    target_.texture(kPassing).bind(kPassing);
    program.set("u_sum", static_cast<int>(kSum));
    program.set("u_passing", static_cast<int>(kPassing));
  }
  PixelTarget& target_;
};

}  // namespace

void add_weighted(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& target = passes.keep(
      std::make_unique<PixelTarget>("weighted colours", std::vector<uint32_t>{GL_RGBA16F, GL_R32F}));
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<WeightedPass>(scene, walks.expanded(), target));
  passes.add(std::make_unique<WeightedBlendPass>(scene, target));
}

}  // namespace strandcast
