#include "common/render/render_device.h"

#include <utility>

#include "common/log/log.h"
#include "common/render/tiles/tile_renderer.h"

namespace strandcast {

const char* to_string(RendererKind kind) {
  return kind == RendererKind::Gl ? "gl" : "tiles";
}

bool is_renderer_name(const std::string& name) {
  return name == "auto" || name == "tiles" || name == "gl";
}

namespace {

struct Choice {
  RendererKind kind;
  bool is_main;
  bool operator==(const Choice&) const = default;
};

class LookRenderer final : public Renderer {
 public:
  LookRenderer(RenderDevice& device, const SceneAsset& asset, const Choice& choice,
               std::unique_ptr<Renderer> renderer)
      : device_(device), asset_(asset), choice_(choice), renderer_(std::move(renderer)) {}

  Status draw(const PosedStrands& strands, const CameraDesc& camera, RenderSize size,
              const DrawTerms& terms) override {
    return renderer_->draw(strands, camera, size, terms);
  }
  Status set_look(const LookDesc& look) override {
    const Choice choice{device_.kind_for(look), has_main_methods(look)};
    if (choice == choice_) return renderer_->set_look(look);
    ASSIGN_OR_RETURN(renderer_, device_.make_renderer(choice.kind, asset_, look));
    choice_ = choice;
    return {};
  }
  Image read_image() override { return renderer_->read_image(); }
  const RenderProfile& profile() const override { return renderer_->profile(); }
  const gl::PassListBase& passes() const override { return renderer_->passes(); }

 private:
  RenderDevice& device_;
  const SceneAsset& asset_;
  Choice choice_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace

RenderDevice::RenderDevice(const RenderDeviceConfig& config)
    : config_(config),
      shaders_(config.shader_folder ? gl::ShaderLibrary(*config.shader_folder) : gl::ShaderLibrary()) {}

Result<std::unique_ptr<RenderDevice>> RenderDevice::open(const RenderDeviceConfig& config) {
  if (!is_renderer_name(config.renderer))
    return make_error(ErrorCode::BadInput, "renderer '{}' is not known (known: auto, tiles, gl)",
                      config.renderer);
  std::unique_ptr<RenderDevice> device(new RenderDevice(config));
  if (config.renderer != "tiles") {
    const bool is_free = config.renderer == "auto" && config.gl_device == "auto";
    auto context = gl::EglContext::make(is_free ? "hardware" : config.gl_device, config.driver_threads);
    if (!context && !is_free) return context.error();
    if (context && (config.renderer == "gl" || !(*context)->info().is_software)) {
      device->context_ = std::move(context).value();
      const gl::DeviceInfo& info = device->context_->info();
      device->info_ = {RendererKind::Gl, info.renderer, info.is_software};
      return device;
    }
  }
  const TileOptions options;
  device->info_ = {
      RendererKind::Tiles,
      fmt::format("the processor ({} threads, {})", options.workers->size(), simd::to_string(options.set)),
      true};
  return device;
}

bool is_drawn_by_processors(const RenderDeviceConfig& config) {
  const auto device = RenderDevice::open(config);
  return !device || (*device)->info().is_software;
}

Status RenderDevice::make_current() {
  return context_ ? context_->make_current() : Status();
}

RendererKind RenderDevice::kind_for(const LookDesc& look) {
  if (info_.kind == RendererKind::Gl) return RendererKind::Gl;
  if (has_main_methods(look) || has_no_gl_) return RendererKind::Tiles;
  if (config_.renderer == "tiles" || context_) return RendererKind::Gl;
  auto context = gl::EglContext::make(config_.gl_device, config_.driver_threads);
  if (context) {
    context_ = std::move(context).value();
    return RendererKind::Gl;
  }
  has_no_gl_ = true;
  log_warn("render", "look.methods names what only OpenGL draws: the main methods are drawn instead ({})",
           context.error().to_string());
  return RendererKind::Tiles;
}

Result<std::unique_ptr<Renderer>> RenderDevice::make_renderer(RendererKind kind, const SceneAsset& asset,
                                                              const LookDesc& look) {
  if (kind == RendererKind::Tiles) return make_tile_renderer(asset, look);
  if (config_.renderer == "tiles")
    return make_error(ErrorCode::BadInput,
                      "look.methods names what only OpenGL draws; --renderer auto or gl allows it");
  if (!context_) {
    ASSIGN_OR_RETURN(context_, gl::EglContext::make(config_.gl_device, config_.driver_threads));
  }
  return Renderer::make(shaders_, context_->info(), asset, look, path_for(look));
}

Result<std::unique_ptr<Renderer>> RenderDevice::make_renderer(const SceneAsset& asset, const LookDesc& look) {
  const RendererKind kind = kind_for(look);
  ASSIGN_OR_RETURN(auto renderer, make_renderer(kind, asset, look));
  return std::unique_ptr<Renderer>(std::make_unique<LookRenderer>(
      *this, asset, Choice{kind, has_main_methods(look)}, std::move(renderer)));
}

RendererKind likely_renderer(const std::string& renderer, const LookDesc& look) {
  return renderer != "gl" && has_main_methods(look) ? RendererKind::Tiles : RendererKind::Gl;
}

Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, RendererKind kind) {
  if (kind == RendererKind::Gl) return plan_renderer(asset, look, true, path_for(look));
  RETURN_IF_ERROR(check_asset(asset));
  // All stages run whatever the scene: nothing of it has to be made ready to say so.
  const SceneAsset nothing;
  WorkerPool alone(1);
  ASSIGN_OR_RETURN(const auto renderer,
                   make_tile_renderer(nothing, look, {&alone, simd::InstructionSet::Plain}));
  return renderer->passes().report();
}

}  // namespace strandcast
