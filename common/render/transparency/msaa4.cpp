// Four samples per pixel by the rasteriser (003, 5.1: what its programs are measured with). A strand thinner
// than a pixel has no share of a sample: it is drawn a pixel wide in that share of the pixels.

#include "common/render/transparency/transparency.h"

namespace strandcast {
namespace {

class Msaa4Pass final : public RenderPass {
 public:
  Msaa4Pass(RenderScene& scene, ExpandedStrands& expanded)
      : Pass(strand_pass(scene, "render/strands", {&expanded, &scene.light}, {&scene.scene})),
        scene_(scene),
        expanded_(expanded) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override { return StrandDraw::size_bytes(); }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(strands_, StrandDraw::make(setup, scene_, "render/strand_msaa.frag"));
    return {};
  }
  Status run(RenderTurn& turn) override {
    scene_.scene.begin();
    strands_.begin(scene_, expanded_, turn, scene_.scene.size_px());
    strands_.program().set("u_widened_px", 0.0f);
    strands_.draw(scene_, expanded_);
    return {};
  }

 private:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  StrandDraw strands_;
};

}  // namespace

void add_msaa4(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<Msaa4Pass>(scene, walks.expanded()));
}

}  // namespace strandcast
