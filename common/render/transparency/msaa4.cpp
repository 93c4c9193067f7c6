// Four samples per pixel by the rasteriser (Woodhouse 2017, 5.1: what its programs are measured with). A
// strand thinner than a pixel has no share of a sample: it is drawn a pixel wide in that share of the pixels.

#include "common/render/transparency/transparency.h"

namespace strandcast {
namespace {

class Msaa4Pass final : public StrandDrawPass {
 public:
  Msaa4Pass(RenderScene& scene, ExpandedStrands& expanded)
      : StrandDrawPass(scene, expanded,
                       strand_pass(scene, "render/strands", {&expanded, &scene.light}, {&scene.scene}),
                       "render/strand_msaa.frag") {}

  Status run(RenderTurn& turn) override {
    scene_.scene.begin();
    strands_.begin(scene_, expanded_, turn, scene_.scene.size_px());
    strands_.program().set("u_widened_px", 0.0f);
    strands_.draw(scene_, expanded_);
    return {};
  }
};

}  // namespace

void add_msaa4(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<Msaa4Pass>(scene, walks.expanded()));
}

}  // namespace strandcast
