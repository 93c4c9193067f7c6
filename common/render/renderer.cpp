#include "common/render/renderer.h"

#include <utility>

#include "common/gl/timer.h"
#include "common/render/render_scene.h"
#include "common/render/view.h"

namespace strandcast {
namespace {

/// All passes of a path, and which of them run to make a picture.
Status add_planned(const RenderPath& path, RenderScene& scene, RenderPassList& passes) {
  RETURN_IF_ERROR(check_render_methods(path.methods));
  scene.methods = path.methods;
  path.add_passes(scene, passes);
  return passes.plan({&scene.strands}, {&scene.picture});
}

class PathRenderer final : public Renderer {
 public:
  PathRenderer(const gl::DeviceInfo& device, const SceneAsset& asset, const LookDesc& look)
      : timer_(device),
        scene_(asset, look, device.is_software),
        position_count_(asset.rest_position_m.size()) {}

  Status prepare(const RenderPath& path, const RenderSetup& setup) {
    RETURN_IF_ERROR(add_planned(path, scene_, passes_));
    return passes_.prepare(setup);
  }

  Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
              const DrawTerms& terms) override;
  Image read_image() override { return scene_.picture.read_image(); }
  const RenderProfile& profile() const override { return profile_; }
  const gl::PassListBase& passes() const override { return passes_; }

 private:
  gl::GpuTimer timer_;
  RenderScene scene_;  // before the passes that refer to it
  RenderPassList passes_;
  size_t position_count_ = 0;
  RenderProfile profile_;
};

Status PathRenderer::draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
                          const DrawTerms& terms) {
  if (strands.position_m.size() != position_count_)
    return make_error(ErrorCode::BadInput, "the strands have {} vertices but the scene has {}",
                      strands.position_m.size(), position_count_);
  if (size.width > kMaxImageSide || size.height > kMaxImageSide)
    return make_error(ErrorCode::LimitExceeded, "a picture of {} x {} pixels exceeds {} per side", size.width,
                      size.height, kMaxImageSide);
  const glm::uvec2 pixels(size.width, size.height);
  ASSIGN_OR_RETURN(const View view,
                   make_view(camera, strands.world_from_head.rotation, pixels * kSamplesPerSide));
  if (!(terms.strand_share > 0.0f && terms.strand_share <= 1.0f))
    return make_error(ErrorCode::BadInput, "the share of strands to draw is {} but must lie in (0, 1]",
                      terms.strand_share);
  RenderTurn turn(strands, view, pixels, terms);
  RETURN_IF_ERROR(passes_.run(turn, &timer_));
  profile_ = {passes_.last_total_ms(), turn.drawn_strands, turn.drawn_segments, turn.is_whole};
  profile_.left_out_fragments = turn.left_out_fragments;
  return {};
}

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::make(const gl::ShaderLibrary& shaders,
                                                 const gl::DeviceInfo& device, const SceneAsset& asset,
                                                 const LookDesc& look, const RenderPath& path) {
  RETURN_IF_ERROR(check_asset(asset));
  auto renderer = std::make_unique<PathRenderer>(device, asset, look);
  RETURN_IF_ERROR(renderer->prepare(path, {shaders, asset}));
  return std::unique_ptr<Renderer>(std::move(renderer));
}

Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, bool is_software,
                                      const RenderPath& path) {
  RETURN_IF_ERROR(check_asset(asset));
  RenderScene scene(asset, look, is_software);
  RenderPassList passes;
  RETURN_IF_ERROR(add_planned(path, scene, passes));
  return passes.report();
}

}  // namespace strandcast
