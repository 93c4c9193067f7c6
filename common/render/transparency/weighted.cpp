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

class WeightedPass final : public RenderPass {
 public:
  WeightedPass(RenderScene& scene, ExpandedStrands& expanded, PixelTarget& target)
      : Pass(strand_pass(scene, "render/weighted", {&expanded, &scene.light, &scene.scene}, {&target})),
        scene_(scene),
        expanded_(expanded),
        target_(target) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override { return StrandDraw::size_bytes(); }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(strands_, StrandDraw::make(setup, scene_, "render/weighted.frag"));
    return {};
  }
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
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  PixelTarget& target_;
  StrandDraw strands_;
};

class WeightedBlendPass final : public RenderPass {
 public:
  WeightedBlendPass(RenderScene& scene, PixelTarget& target)
      : Pass(strand_pass(scene, "render/weighted_blend", {&target}, {&scene.strand_layer})),
        layer_(scene.strand_layer),
        target_(target) {}

  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(screen_, FullScreen::make(setup, "render/weighted_blend.frag"));
    return {};
  }
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(layer_.resize(turn.size_px));
    layer_.begin();
    target_.texture(kSum).bind(kSum);
    target_.texture(kPassing).bind(kPassing);
    screen_.program().set("u_sum", static_cast<int>(kSum));
    screen_.program().set("u_passing", static_cast<int>(kPassing));
    screen_.draw();
    return {};
  }

 private:
  StrandLayer& layer_;
  PixelTarget& target_;
  FullScreen screen_;
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
