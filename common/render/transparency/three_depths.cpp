// The short-cut of TressFX 4.1: the three nearest strands of each pixel are told by their depths, and only
// they are put in order; two walks over the strands. Its defects are mended: the three are weighted by what
// lies in front of each, opacity counts once, and what is farther has the colour of what is there.

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>

#include "common/gl/device_limits.h"
#include "common/render/transparency/pixel_target.h"
#include "common/render/transparency/transparency.h"
#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

constexpr size_t kNear = 0;
constexpr size_t kFarLayer = 1;

/// (height x width) three keys and the opacity of all, as shaders/render/three_depths.glsl has them.
class DepthKeys final : public gl::Resource {
 public:
  DepthKeys() : Resource("depth keys") {}

  Status resize(glm::uvec2 size_px) {
    if (size_px == size_px_) return {};
    size_px_ = glm::uvec2(0);
    key_ = {};
    const uint64_t bytes = sizeof(glm::uvec4) * uint64_t{size_px.x} * size_px.y;
    RETURN_IF_ERROR(gl::check_device_limit(gl::read_device_limits(), gl::DeviceLimit::StorageBlockBytes,
                                           bytes,
                                           fmt::format("keys for {} x {} pixels", size_px.x, size_px.y)));
    key_ = gl::Buffer("depth keys", bytes);
    framebuffer_ = gl::Framebuffer::without_attachments("depth keys", size_px.x, size_px.y);
    size_px_ = size_px;
    return {};
  }
  void clear() const {
    const glm::uvec4 none(0xffffffffu, 0xffffffffu, 0xffffffffu, 0u);
    glClearNamedBufferData(key_.name(), GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT, &none);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  }
  void begin() const {
    set_plain_state(size_px_);
    framebuffer_.bind();
    glDisable(GL_DEPTH_TEST);
  }
  void bind(const gl::Program& program) const {
    key_.bind_storage(shader::kBindingDepthKeys);
    program.set("u_width", static_cast<int>(size_px_.x));
  }
  uint64_t size_bytes() const override { return key_.size_bytes(); }

 private:
  gl::Buffer key_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

class KeysPass final : public StrandDrawPass {
 public:
  KeysPass(RenderScene& scene, ExpandedStrands& expanded, DepthKeys& keys)
      : StrandDrawPass(
            scene, expanded,
            strand_pass(scene, "render/three_depths", {&expanded, &scene.light, &scene.scene}, {&keys}),
            "render/three_depths_keys.frag"),
        keys_(keys) {}

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(keys_.resize(turn.size_px));
      keys_.clear();
    }
    keys_.begin();
    begin_blended(strands_, scene_, expanded_, turn);
    keys_.bind(strands_.program());
    strands_.draw(scene_, expanded_);
    return {};
  }

 private:
  DepthKeys& keys_;
};

/// Between the two walks.
class KeysReadyPass final : public RenderPass {
 public:
  KeysReadyPass(RenderScene& scene, DepthKeys& keys, PixelTarget& colors)
      : Pass(strand_pass(scene, "render/three_depths_ready", {&keys}, {&colors})), colors_(colors) {}
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(colors_.resize(turn.size_px));
    colors_.clear(kNear, 0.0f);
    colors_.clear(kFarLayer, 0.0f);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return {};
  }

 private:
  PixelTarget& colors_;
};

class KeyColorsPass final : public StrandDrawPass {
 public:
  KeyColorsPass(RenderScene& scene, ExpandedStrands& expanded, DepthKeys& keys, PixelTarget& colors)
      : StrandDrawPass(scene, expanded,
                       strand_pass(scene, "render/three_depths_color",
                                   {&expanded, &scene.light, &scene.scene, &keys}, {&colors}),
                       "render/three_depths_color.frag"),
        keys_(keys),
        colors_(colors) {}

  Status run(RenderTurn& turn) override {
    colors_.begin();
    begin_adding();
    begin_blended(strands_, scene_, expanded_, turn);
    keys_.bind(strands_.program());
    strands_.draw(scene_, expanded_);
    glDisable(GL_BLEND);
    return {};
  }

 private:
  DepthKeys& keys_;
  PixelTarget& colors_;
};

class KeysBlendPass final : public LayerBlendPass {
 public:
  KeysBlendPass(RenderScene& scene, DepthKeys& keys, PixelTarget& colors)
      : LayerBlendPass(scene, "render/three_depths_blend", {&keys, &colors},
                       "render/three_depths_blend.frag"),
        keys_(keys),
        colors_(colors) {}

 private:
  void bind(const gl::Program& program) const override {
    keys_.bind(program);
    colors_.texture(kNear).bind(kNear);
    colors_.texture(kFarLayer).bind(kFarLayer);
    program.set("u_near", static_cast<int>(kNear));
    program.set("u_far", static_cast<int>(kFarLayer));
  }
  DepthKeys& keys_;
  PixelTarget& colors_;
};

}  // namespace

void add_three_depths(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& keys = passes.keep(std::make_unique<DepthKeys>());
  auto& colors = passes.keep(
      std::make_unique<PixelTarget>("three-depth colours", std::vector<uint32_t>{GL_RGBA16F, GL_RGBA16F}));
  add_camera_walk(scene, walks, passes, "for_depths");
  passes.add(std::make_unique<KeysPass>(scene, walks.expanded(), keys));
  passes.add(std::make_unique<KeysReadyPass>(scene, keys, colors));
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<KeyColorsPass>(scene, walks.expanded(), keys, colors));
  passes.add(std::make_unique<KeysBlendPass>(scene, keys, colors));
}

}  // namespace strandcast
