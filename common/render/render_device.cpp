#include "common/render/render_device.h"

#include <utility>

#include "common/render/tiles/tile_renderer.h"

namespace strandcast {

const char* to_string(RendererKind kind) {
  return kind == RendererKind::Gl ? "gl" : "tiles";
}

bool is_renderer_name(const std::string& name) {
  return name == "auto" || name == "tiles" || name == "gl";
}

RenderDevice::RenderDevice(const RenderDeviceConfig& config)
    : shaders_(config.shader_folder ? gl::ShaderLibrary(*config.shader_folder) : gl::ShaderLibrary()) {}

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
      fmt::format("the processor ({} threads, {})", options.threads, simd::to_string(options.set)), true};
  return device;
}

Status RenderDevice::make_current() {
  return context_ ? context_->make_current() : Status();
}

Result<std::unique_ptr<Renderer>> RenderDevice::make_renderer(const SceneAsset& asset,
                                                              const LookDesc& look) const {
  if (context_) return Renderer::make(shaders_, context_->info(), asset, look);
  return make_tile_renderer(asset, look);
}

Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, RendererKind kind) {
  if (kind == RendererKind::Gl) return plan_renderer(asset, look, true);
  ASSIGN_OR_RETURN(const auto renderer, make_tile_renderer(asset, look, {1, simd::InstructionSet::Plain}));
  return renderer->passes().report();
}

}  // namespace strandcast
