// RenderDevice: chooses what draws pictures: a hardware GPU through OpenGL if there is one, else the
// processors in tiles. Opened, used and closed on one thread; its renderers must be destroyed first.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
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

struct PlacedHead {
  Renderer* renderer = nullptr;
  const PosedStrands* strands = nullptr;
};

/// Returns the point that a picture's camera follows: the middle of the heads (at least one), world, m.
glm::dvec3 middle_of(std::span<const PlacedHead> heads);

/// Converts a camera that follows `middle_m` into one that follows `head_m` and shows the same view.
CameraDesc camera_from_head(const CameraDesc& camera, const glm::dvec3& middle_m, const glm::dvec3& head_m);

/// Camera of a picture of heads; it follows their middle.
struct HeadsCamera {
  CameraDesc own;
  CameraDesc of_scene;  // from which all heads are to be seen
};
/// Returns the factor on the scene camera's distance at which all heads are in the picture; 1 if they already
/// are. The viewer's own camera is moved by it too, so that no head is out of view.
double room_factor(std::span<const PlacedHead> heads, const CameraDesc& of_scene, RenderSize size);

struct HeadsPicture {
  Image image;
  RenderProfile profile;  // of all
};

/// Draws the heads. With one head the result equals that renderer's draw() and read_image(). A picture that
/// was abandoned has no pixels. Errors as Renderer::draw().
Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const HeadsCamera& camera, RenderSize size,
                                const DrawTerms& terms = {});

}  // namespace strandcast
