// Opacity shadow maps (Kim and Neumann 2001; Woodhouse 2017, 2.2.5; in one draw as in Nalu, GPU Gems 2,
// chapter 23): 16 slices at fixed depths through the hair. Hair that begins within a slice is lit as if it
// were thin from the slice's begin on.
//
// Hybrid: what Woodhouse proposes in 5.2 and did not build: a density volume that lies along the light, fine
// across it and coarse along it, with the first depth of deep opacity maps, all in one draw. The volume's
// slices hold densities (4.3.4), summed at look-up; the first depth is the least of a fifth target. So the
// first slice begins where the hair does.

#include <epoxy/gl.h>

#include <limits>

#include "common/render/shadow/light_map.h"

namespace strandcast {
namespace {

constexpr size_t kSlices = 16;
constexpr size_t kSliceTargets = kSlices / 4;
constexpr const char* kSliceUniforms[kSliceTargets] = {"u_slices_0", "u_slices_1", "u_slices_2",
                                                       "u_slices_3"};
constexpr float kNoDepthM = 1e9f;

class SliceMap : public LightMap {
 public:
  SliceMap(const std::string& name, uint32_t texels, bool has_first_depth)
      : LightMap(name, texels), has_first_depth_(has_first_depth) {}

  void begin() override {
    if (slices_.empty()) allocate();
    const float none[4] = {};
    for (size_t i = 0; i < kSliceTargets; ++i)
      glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, static_cast<GLint>(i), none);
    const float no_depth_m[4] = {kNoDepthM};
    if (has_first_depth_)
      glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, static_cast<GLint>(kSliceTargets), no_depth_m);
  }
  void begin_drawing(const gl::Program& program) const {
    set_plain_state(glm::uvec2(texels()));
    framebuffer_.bind();
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFunc(GL_ONE, GL_ONE);
    if (has_first_depth_) glBlendEquationi(kSliceTargets, GL_MIN);
    program.set("u_slice_m", slice_m());
  }
  bool has_first_depth() const { return has_first_depth_; }
  uint64_t size_bytes() const override {
    uint64_t sum = first_depth_.size_bytes();
    for (const gl::Texture& slices : slices_) sum += slices.size_bytes();
    return sum;
  }

 private:
  void allocate() {
    std::vector<const gl::Texture*> colors;
    for (size_t i = 0; i < kSliceTargets; ++i)
      slices_.emplace_back("opacity slices", GL_RGBA16F, texels(), texels(), 1);
    for (const gl::Texture& slices : slices_) colors.push_back(&slices);
    if (has_first_depth_) {
      first_depth_ = gl::Texture("first depth", GL_R32F, texels(), texels(), 1);
      colors.push_back(&first_depth_);
    }
    framebuffer_ = gl::Framebuffer("opacity slices", colors, nullptr);
  }
  float slice_m() const { return frame().depth_m / static_cast<float>(kSlices); }
  void set_method_uniforms(const gl::Program& program, uint32_t first_unit) const override {
    for (uint32_t i = 0; i < kSliceTargets; ++i) {
      slices_[i].bind(first_unit + i);
      program.set(kSliceUniforms[i], static_cast<int>(first_unit + i));
    }
    program.set("u_slice_m", slice_m());
    if (!has_first_depth_) return;
    first_depth_.bind(first_unit + kSliceTargets);
    program.set("u_first_depth", static_cast<int>(first_unit + kSliceTargets));
  }

  bool has_first_depth_;
  std::vector<gl::Texture> slices_;
  gl::Texture first_depth_;
  gl::Framebuffer framebuffer_;
};
static_assert(kSliceTargets + 1 <= kShadowUnits);

class SlicesPass final : public LightDrawPass {
 public:
  SlicesPass(RenderScene& scene, ExpandedStrands& expanded, SliceMap& map)
      : LightDrawPass(scene, expanded,
                      strand_pass(scene, "render/opacity_slices", {&expanded}, {&map, &scene.light}),
                      "render/opacity_slices.frag", {{"IS_HYBRID", map.has_first_depth() ? 1 : 0}}),
        map_(map) {}

  Status run(RenderTurn&) override {
    map_.begin_drawing(draw_.program());
    draw_.draw(scene_, map_, expanded_);
    glDisable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    return {};
  }

 private:
  SliceMap& map_;
};

void add_slices(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                std::unique_ptr<SliceMap> made) {
  auto& map = passes.keep(std::move(made));
  scene.shadow = &map;
  passes.add(make_light_frame_pass(scene, map));
  passes.add(walks.add("for_opacity"));
  passes.add(std::make_unique<SlicesPass>(scene, walks.expanded(), map));
}

}  // namespace

void add_opacity_maps(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  add_slices(scene, walks, passes,
             std::make_unique<SliceMap>("opacity maps", scene.method_settings.shadow_texels, false));
}

void add_hybrid(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  add_slices(scene, walks, passes,
             std::make_unique<SliceMap>("hybrid map", scene.method_settings.shadow_texels, true));
}

}  // namespace strandcast
