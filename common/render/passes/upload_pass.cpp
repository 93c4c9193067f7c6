// Upload pass: the key strands of the picture to the GPU.

#include "common/render/render_path.h"

namespace strandcast {
namespace {

class UploadPass final : public RenderPass {
 public:
  explicit UploadPass(RenderScene& scene)
      : Pass({"render/upload",
              {&scene.strands},
              {&scene.key_strands},
              scene.features.has_strands.value,
              scene.features.has_strands.reason}),
        keys_(scene.key_strands) {}

  Status prepare(const RenderSetup&) override {
    keys_.allocate();
    return {};
  }
  Status run(RenderTurn& turn) override {
    keys_.position().write(turn.strands.position_m);
    return {};
  }

 private:
  KeyStrands& keys_;
};

}  // namespace

std::unique_ptr<RenderPass> make_upload_pass(RenderScene& scene) {
  return std::make_unique<UploadPass>(scene);
}

}  // namespace strandcast
