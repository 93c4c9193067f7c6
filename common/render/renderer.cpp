#include "common/render/renderer.h"

#include <utility>

#include "common/gl/timer.h"
#include "common/render/render_scene.h"
#include "common/render/view.h"

namespace strandcast {
namespace {

/// All passes of a path, and which of them run to make a picture.
Status add_planned(const RenderPath& path, RenderScene& scene, RenderPassList& passes) {
  const RenderMethodsDesc& wanted = scene.look.methods;
  if (const char* const conflict = method_conflict(wanted); *conflict != '\0')
    return make_error(ErrorCode::BadInput, "look.methods: {}", conflict);
  ASSIGN_OR_RETURN(scene.methods, find_render_methods(wanted));
  if (path.methods) scene.methods = *path.methods;
  RETURN_IF_ERROR(check_render_methods(scene.methods));
  path.add_passes(scene, passes);
  return passes.plan({&scene.strands}, {&scene.picture});
}

/// Whether the passes that were made for one look draw the other: what they are made for is how much there is
/// to draw. The rest they read anew for each picture, and what is not named here makes new passes.
bool have_same_passes(const LookDesc& a, const LookDesc& b) {
  LookDesc alike = b;
  alike.hair_color = a.hair_color;
  alike.root_color = a.root_color;
  alike.tip_color = a.tip_color;
  alike.eumelanin = a.eumelanin;
  alike.pheomelanin = a.pheomelanin;
  alike.tip_scale = a.tip_scale;
  alike.style = a.style;
  alike.shading = a.shading;
  alike.light_direction = a.light_direction;
  alike.light_color = a.light_color;
  alike.rim_direction = a.rim_direction;
  alike.rim_color = a.rim_color;
  alike.ambient = a.ambient;
  alike.exposure = a.exposure;
  alike.background = a.background;
  alike.skin_color = a.skin_color;
  return alike == a;
}

/// What one look is drawn with.
struct LookPasses {
  LookPasses(const SceneAsset& asset, const LookDesc& look, bool is_software)
      : scene(asset, look, is_software) {}

  RenderScene scene;  // before the passes that refer to it
  RenderPassList list;
};

class PathRenderer final : public Renderer {
 public:
  PathRenderer(const gl::ShaderLibrary& shaders, const gl::DeviceInfo& device, const SceneAsset& asset,
               const RenderPath& path)
      : shaders_(shaders),
        is_software_(device.is_software),
        asset_(asset),
        path_(path),
        timer_(device),
        position_count_(asset.rest_position_m.size()) {}

  /// With passes of its own.
  Status prepare(const LookDesc& look) {
    auto passes = std::make_unique<LookPasses>(asset_, look, is_software_);
    RETURN_IF_ERROR(add_planned(path_, passes->scene, passes->list));
    RETURN_IF_ERROR(passes->list.prepare({shaders_, asset_}));
    passes_ = std::move(passes);
    look_ = look;
    return {};
  }

  Status set_look(const LookDesc& look) override {
    if (look == look_) return {};
    if (!have_same_passes(look_, look)) return prepare(look);
    LookDesc& drawn = passes_->scene.look;
    const LookDesc limited = std::exchange(drawn, look);
    drawn.followers = limited.followers;
    drawn.segments = limited.segments;
    look_ = look;
    return {};
  }

  Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
              const DrawTerms& terms) override;
  Image read_image() override { return passes_->scene.picture.read_image(); }
  const RenderProfile& profile() const override { return profile_; }
  const gl::PassListBase& passes() const override { return passes_->list; }

 private:
  const gl::ShaderLibrary shaders_;
  const bool is_software_;
  const SceneAsset& asset_;
  const RenderPath path_;
  gl::GpuTimer timer_;
  LookDesc look_;  // as it was wanted
  std::unique_ptr<LookPasses> passes_;
  size_t position_count_ = 0;
  RenderProfile profile_;
};

Status PathRenderer::draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
                          const DrawTerms& terms) {
  RETURN_IF_ERROR(check_draw(strands, position_count_, size, terms));
  const glm::uvec2 pixels(size.width, size.height);
  ASSIGN_OR_RETURN(const View view,
                   make_view(camera, strands.world_from_head.rotation, pixels * path_.view_samples));
  RenderTurn turn(strands, view, pixels, terms);
  RETURN_IF_ERROR(passes_->list.run(turn, &timer_));
  profile_ = {passes_->list.last_total_ms(), turn.drawn_strands, turn.drawn_segments, turn.is_whole};
  profile_.left_out_fragments = turn.left_out_fragments;
  profile_.left_out_strands = turn.left_out_strands;
  profile_.unusable_segments = turn.unusable_segments;
  return {};
}

}  // namespace

std::string left_out_text(const RenderProfile& profile) {
  std::string text;
  const auto add = [&](uint64_t count, const char* what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(profile.left_out_strands, "strands for lack of memory");
  add(profile.left_out_fragments, "pieces of strands for lack of the method's memory");
  add(profile.unusable_segments, "segments without usable positions");
  return text;
}

Status check_draw(const PosedStrands& strands, size_t position_count, RenderSize size,
                  const DrawTerms& terms) {
  if (strands.position_m.size() != position_count)
    return make_error(ErrorCode::BadInput, "the strands have {} vertices but the scene has {}",
                      strands.position_m.size(), position_count);
  if (size.width > kMaxImageSide || size.height > kMaxImageSide)
    return make_error(ErrorCode::LimitExceeded, "a picture of {} x {} pixels exceeds {} per side", size.width,
                      size.height, kMaxImageSide);
  if (terms.backdrop != nullptr &&
      (terms.backdrop->width != size.width || terms.backdrop->height != size.height))
    return make_error(ErrorCode::BadInput, "a backdrop of {} x {} pixels is not as large as the picture",
                      terms.backdrop->width, terms.backdrop->height);
  if (!(terms.strand_share > 0.0f && terms.strand_share <= 1.0f))
    return make_error(ErrorCode::BadInput, "the share of strands to draw is {} but must lie in (0, 1]",
                      terms.strand_share);
  return {};
}

Result<std::unique_ptr<Renderer>> Renderer::make(const gl::ShaderLibrary& shaders,
                                                 const gl::DeviceInfo& device, const SceneAsset& asset,
                                                 const LookDesc& look, const RenderPath& path) {
  RETURN_IF_ERROR(check_asset(asset));
  auto renderer = std::make_unique<PathRenderer>(shaders, device, asset, path);
  RETURN_IF_ERROR(renderer->prepare(look));
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
