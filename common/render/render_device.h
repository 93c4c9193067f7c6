// RenderDevice: what draws pictures, chosen in one place: a hardware GPU through OpenGL where there is one,
// else the processors in tiles. Opened, used and closed on one thread; renderers that it made go first.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "common/gl/egl_context.h"
#include "common/render/renderer.h"

namespace strandcast {

enum class RendererKind { Tiles, Gl };
const char* to_string(RendererKind kind);
/// Names that RenderDeviceConfig::renderer takes: "auto", "tiles", "gl".
bool is_renderer_name(const std::string& name);

struct RenderDeviceConfig {
  std::string renderer = "auto";                       // tiles unless the OpenGL device is hardware
  std::string gl_device = "auto";                      // as EglContext::make
  std::optional<std::filesystem::path> shader_folder;  // none: the shaders in the binary
  gl::DriverThreads driver_threads = gl::DriverThreads::Shared;
};

struct RenderDeviceInfo {
  RendererKind kind = RendererKind::Tiles;
  std::string name;         // for people
  bool is_software = true;  // it draws on processor cores
};

class RenderDevice {
 public:
  /// Makes its context current. "gl", and an OpenGL device that is named, fail where it is not there:
  /// Unavailable, or BadInput for an unknown name.
  static Result<std::unique_ptr<RenderDevice>> open(const RenderDeviceConfig& config);
  /// Binds its context, if it has one, to the calling thread.
  Status make_current();
  const RenderDeviceInfo& info() const { return info_; }
  /// `asset` outlives the renderer. Where tiles draw, a look that names other methods than the main ones is
  /// drawn by OpenGL, opened when the first such look comes; BadInput where "tiles" was asked for.
  Result<std::unique_ptr<Renderer>> make_renderer(const SceneAsset& asset, const LookDesc& look);
  /// One of this kind, whatever the look names.
  Result<std::unique_ptr<Renderer>> make_renderer(RendererKind kind, const SceneAsset& asset,
                                                  const LookDesc& look);
  /// What draws a look here. Where a look needs OpenGL and there is none, tiles draw their own methods, and
  /// the log says so.
  RendererKind kind_for(const LookDesc& look);

 private:
  explicit RenderDevice(const RenderDeviceConfig& config);
  const RenderDeviceConfig config_;
  RenderDeviceInfo info_;
  gl::ShaderLibrary shaders_;
  std::unique_ptr<gl::EglContext> context_;  // of Gl, or for methods that tiles have not
  bool has_no_gl_ = false;                   // was looked for, for such methods
};

/// Whether pictures drawn with this configuration take processor cores: looks for what would draw, and lets
/// go of it. True as well where nothing can draw.
bool is_drawn_by_processors(const RenderDeviceConfig& config);

/// What will draw a look where the renderer was asked for by this name and there is no hardware GPU.
RendererKind likely_renderer(const std::string& renderer, const LookDesc& look);

/// The passes that a renderer of this kind would run, without drawing.
Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, RendererKind kind);

}  // namespace strandcast
