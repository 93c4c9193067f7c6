#include "common/render/render_device.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

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

namespace {

/// What is to be seen around the joint of a head.
constexpr double kHeadRoomM = 0.2;
/// A camera that looks so nearly straight up or down has no upwards in its picture.
constexpr double kLevelShare = 0.05;
/// Heads that are farther apart than so are not all shown.
constexpr double kMostRoom = 100.0;

void add(RenderProfile& sum, const RenderProfile& one) {
  sum.total_ms += one.total_ms;
  sum.drawn_strands += one.drawn_strands;
  sum.drawn_segments += one.drawn_segments;
  sum.is_whole = sum.is_whole && one.is_whole;
  sum.left_out_fragments += one.left_out_fragments;
  sum.left_out_strands += one.left_out_strands;
  sum.unusable_segments += one.unusable_segments;
}

}  // namespace

glm::dvec3 middle_of(std::span<const PlacedHead> heads) {
  glm::dvec3 sum_m(0.0);
  for (const PlacedHead& head : heads) sum_m += head.strands->world_from_head.position_m;
  return sum_m / static_cast<double>(heads.size());
}

CameraDesc camera_from_head(const CameraDesc& camera, const glm::dvec3& middle_m, const glm::dvec3& head_m) {
  CameraDesc seen = camera;
  seen.target_m = glm::vec3(glm::dvec3(camera.target_m) + (middle_m - head_m));
  return seen;
}

double room_factor(std::span<const PlacedHead> heads, const CameraDesc& of_scene, RenderSize size) {
  const glm::dvec3 offset_m(of_scene.offset_m);
  const double distance_m = glm::length(offset_m);
  if (heads.size() < 2 || !(distance_m > 0.0) || size.height == 0) return 1.0;
  const glm::dvec3 forward = -offset_m / distance_m;
  // Straight from above or below, what is beside the target may be anywhere in the picture.
  const glm::dvec3 upward = glm::dvec3(0.0, 1.0, 0.0) - forward * forward.y;
  const bool has_up = glm::length(upward) > kLevelShare;
  const double slope_y = std::tan(0.5 * of_scene.fov_y_rad);
  const double slope_x = slope_y * size.width / size.height;
  const glm::dvec3 target_m = middle_of(heads) + glm::dvec3(of_scene.target_m);
  double needed_m = distance_m;
  for (const PlacedHead& head : heads) {
    const glm::dvec3 from_target_m = head.strands->world_from_head.position_m - target_m;
    const double depth_m = glm::dot(from_target_m, forward);
    const double beside_m = glm::length(from_target_m - forward * depth_m);
    const double y_m = has_up ? std::abs(glm::dot(from_target_m, glm::normalize(upward))) : beside_m;
    const double x_m = has_up ? std::sqrt(std::max(beside_m * beside_m - y_m * y_m, 0.0)) : beside_m;
    const double least_m = std::max((x_m + kHeadRoomM) / slope_x, (y_m + kHeadRoomM) / slope_y);
    needed_m = std::max(needed_m, least_m - depth_m);
  }
  return std::min(needed_m / distance_m, kMostRoom);
}

Result<HeadsPicture> draw_heads(std::span<const PlacedHead> heads, const HeadsCamera& from, RenderSize size,
                                const DrawTerms& terms) {
  const glm::dvec3 middle_m = middle_of(heads);
  CameraDesc camera = from.own;
  if (heads.size() > 1) camera.offset_m *= static_cast<float>(room_factor(heads, from.of_scene, size));
  const glm::dvec3 eye_m = middle_m + glm::dvec3(camera.target_m) + glm::dvec3(camera.offset_m);
  const auto distance_m = [&](const PlacedHead& head) {
    return glm::distance(eye_m, head.strands->world_from_head.position_m);
  };
  std::vector<PlacedHead> farthest_first(heads.begin(), heads.end());
  std::stable_sort(farthest_first.begin(), farthest_first.end(),
                   [&](const PlacedHead& a, const PlacedHead& b) { return distance_m(a) > distance_m(b); });
  HeadsPicture picture;
  DrawTerms over = terms;
  for (const PlacedHead& head : farthest_first) {
    const glm::dvec3& head_m = head.strands->world_from_head.position_m;
    RETURN_IF_ERROR(
        head.renderer->draw(*head.strands, camera_from_head(camera, middle_m, head_m), size, over));
    add(picture.profile, head.renderer->profile());
    if (!picture.profile.is_whole) return HeadsPicture{{}, picture.profile};
    picture.image = head.renderer->read_image();
    over.backdrop = &picture.image;
  }
  return picture;
}

}  // namespace strandcast
