// RenderDevice: chooses what draws pictures: a hardware GPU through OpenGL if there is one, else the
// processors in tiles. Opened, used and closed on one thread; its renderers must be destroyed first.
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
/// Returns whether RenderDeviceConfig::renderer accepts this name: "auto", "tiles" or "gl".
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
  /// Opens a device and makes its context current. If "gl" or a named OpenGL device is missing, returns
  /// Unavailable; BadInput for an unknown name.
  static Result<std::unique_ptr<RenderDevice>> open(const RenderDeviceConfig& config);
  /// Binds its context, if any, to the calling thread.
  Status make_current();
  const RenderDeviceInfo& info() const { return info_; }
  /// Makes a renderer for a look; `asset` must outlive it. On the tile renderer, a look with other than the
  /// main methods is drawn by OpenGL, which is opened for the first such look. BadInput if "tiles" was
  /// requested explicitly.
  Result<std::unique_ptr<Renderer>> make_renderer(const SceneAsset& asset, const LookDesc& look);
  /// Makes a renderer of this kind, whatever methods the look names.
  Result<std::unique_ptr<Renderer>> make_renderer(RendererKind kind, const SceneAsset& asset,
                                                  const LookDesc& look);
  /// Returns the kind of renderer for a look. If a look needs OpenGL and there is none, tiles draw with their
  /// own methods and a warning is logged.
  RendererKind kind_for(const LookDesc& look);

 private:
  explicit RenderDevice(const RenderDeviceConfig& config);
  const RenderDeviceConfig config_;
  RenderDeviceInfo info_;
  gl::ShaderLibrary shaders_;
  std::unique_ptr<gl::EglContext> context_;  // of Gl, or for methods that tiles have not
  bool has_no_gl_ = false;                   // was looked for, for such methods
};

/// Returns whether pictures with this configuration use processor cores. Opens the device to find out and
/// closes it again. Also true if nothing can draw.
bool is_drawn_by_processors(const RenderDeviceConfig& config);

/// Returns the kind of renderer for a look and this renderer name if there is no hardware GPU.
RendererKind likely_renderer(const std::string& renderer, const LookDesc& look);

/// Returns the passes that a renderer of this kind would run, without drawing.
Result<gl::PassReports> plan_renderer(const SceneAsset& asset, const LookDesc& look, RendererKind kind);

}  // namespace strandcast
