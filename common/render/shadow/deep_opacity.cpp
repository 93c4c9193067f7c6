// Deep opacity maps (Yuksel and Keyser 2008; Woodhouse 2017, 2.2.6 and 4.3.4): two draws from the light. The
// first tells where hair begins in each texel, the second sums opacity in three layers that begin there, so
// that they follow the shape of the hair. Three layers and the first depth are the four channels of one
// texture.

#include <epoxy/gl.h>

#include "common/render/shadow/light_map.h"

namespace strandcast {
namespace {

// Ends of the layers, of the hair's depth along the light. Most of what is seen happens in the first: with
// 0.12 and 0.4 the picture of the built-in scene is twice as far from the truth.
const glm::vec3 kLayerEnds(0.03f, 0.12f, 1.0f);
constexpr uint32_t kFirstDepthUnit = 0;

class DeepOpacityMap final : public LightMap {
 public:
  explicit DeepOpacityMap(uint32_t texels) : LightMap("deep opacity map", texels) {}

  void begin() override {
    if (layers_.name() == 0) {
      first_depth_ = gl::Texture("first depth", GL_DEPTH_COMPONENT32F, texels(), texels(), 1);
      layers_ = gl::Texture("opacity layers", GL_RGBA16F, texels(), texels(), 1);
      const std::array<const gl::Texture*, 1> colors{&layers_};
      to_first_depth_ = gl::Framebuffer("first depth", {}, &first_depth_);
      to_layers_ = gl::Framebuffer("opacity layers", colors, nullptr);
    }
    const float far = 1.0f;
    const float none[4] = {};
    glClearNamedFramebufferfv(to_first_depth_.name(), GL_DEPTH, 0, &far);
    glClearNamedFramebufferfv(to_layers_.name(), GL_COLOR, 0, none);
  }
  void begin_first_depth() const {
    set_plain_state(glm::uvec2(texels()));
    to_first_depth_.bind();
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
  }
  void begin_layers(const gl::Program& program) const {
    set_plain_state(glm::uvec2(texels()));
    to_layers_.bind();
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendEquationSeparate(GL_FUNC_ADD, GL_MAX);
    glBlendFunc(GL_ONE, GL_ONE);
    first_depth_.bind(kFirstDepthUnit);
    program.set("u_first_depth", static_cast<int>(kFirstDepthUnit));
    program.set("u_layer_ends_m", layer_ends_m());
  }
  uint64_t size_bytes() const override { return first_depth_.size_bytes() + layers_.size_bytes(); }

 private:
  glm::vec3 layer_ends_m() const { return kLayerEnds * frame().depth_m; }
  void set_method_uniforms(const gl::Program& program, uint32_t first_unit) const override {
    layers_.bind(first_unit);
    program.set("u_opacity_layers", static_cast<int>(first_unit));
    program.set("u_layer_ends_m", layer_ends_m());
  }
  gl::Texture first_depth_;
  gl::Texture layers_;
  gl::Framebuffer to_first_depth_;
  gl::Framebuffer to_layers_;
};

class FirstDepthPass final : public LightDrawPass {
 public:
  FirstDepthPass(RenderScene& scene, ExpandedStrands& expanded, DeepOpacityMap& map)
      : LightDrawPass(scene, expanded, strand_pass(scene, "render/first_depth", {&expanded}, {&map}),
                      "render/first_depth.frag"),
        map_(map) {}

  Status run(RenderTurn&) override {
    map_.begin_first_depth();
    draw_.draw(scene_, map_, expanded_);
    return {};
  }

 private:
  DeepOpacityMap& map_;
};

class OpacityLayersPass final : public LightDrawPass {
 public:
  OpacityLayersPass(RenderScene& scene, ExpandedStrands& expanded, DeepOpacityMap& map)
      : LightDrawPass(scene, expanded,
                      strand_pass(scene, "render/opacity_layers", {&expanded, &map}, {&map, &scene.light}),
                      "render/opacity_layers.frag"),
        map_(map) {}

  Status run(RenderTurn&) override {
    map_.begin_layers(draw_.program());
    draw_.draw(scene_, map_, expanded_);
    glDisable(GL_BLEND);
    return {};
  }

 private:
  DeepOpacityMap& map_;
};

}  // namespace

void add_deep_opacity(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& map = passes.keep(std::make_unique<DeepOpacityMap>(scene.method_settings.shadow_texels));
  scene.shadow = &map;
  passes.add(make_light_frame_pass(scene, map));
  passes.add(walks.add("for_first_depth"));
  passes.add(std::make_unique<FirstDepthPass>(scene, walks.expanded(), map));
  passes.add(make_ready_pass(scene, "render/first_depth_ready", {&map}, {&map}));
  passes.add(walks.add("for_opacity"));
  passes.add(std::make_unique<OpacityLayersPass>(scene, walks.expanded(), map));
}

}  // namespace strandcast
