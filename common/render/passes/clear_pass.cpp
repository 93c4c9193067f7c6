// Clear pass: an empty scene of the size that is drawn.

#include "common/render/render_path.h"

namespace strandcast {
namespace {

class ClearPass final : public RenderPass {
 public:
  explicit ClearPass(RenderScene& scene)
      : Pass({"render/clear", {}, {&scene.scene}, true, {}}), target_(scene.scene) {}

  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(target_.resize(turn.size_px));
    target_.begin();
    target_.clear();
    return {};
  }

 private:
  SceneTarget& target_;
};

}  // namespace

std::unique_ptr<RenderPass> make_clear_pass(RenderScene& scene) {
  return std::make_unique<ClearPass>(scene);
}

}  // namespace strandcast
