// Deep shadow maps (Lokovic and Veach 2000; Woodhouse 2017, 2.2.4), made on the CPU of what the GPU expanded:
// the truth for the others, far too slow for pictures in motion.

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <memory>

#include "common/gl/device_limits.h"
#include "common/render/shadow/deep_shadow_map.h"
#include "common/render/shadow/light_map.h"

namespace strandcast {
namespace {

// Of the light, between what the steps on the GPU say and what they are made of.
constexpr double kTolerance = 1.0 / 256.0;

class DeepShadow final : public LightMap {
 public:
  explicit DeepShadow(uint32_t texels) : LightMap("deep shadow map", texels) {}

  void begin() override { map_ = nullptr; }
  void add(const RenderScene& scene, const ExpandedStrands& expanded) {
    if (map_ == nullptr)
      map_ = std::make_unique<DeepShadowMap>(frame(), scene.method_settings.strand_opacity);
    std::vector<ExpandedVertex> vertices(2 * size_t{expanded.segment_count});
    expanded.vertex().read(0, std::as_writable_bytes(std::span(vertices)));
    map_->add(vertices, expanded.width_m, scene.look.tip_scale);
  }
  Status finish();
  uint64_t size_bytes() const override { return texel_.size_bytes() + step_.size_bytes(); }

 private:
  void set_method_uniforms(const gl::Program& program, uint32_t first_unit) const override {
    texel_view_.bind(first_unit);
    step_view_.bind(first_unit + 1);
    program.set("u_deep_texels", static_cast<int>(first_unit));
    program.set("u_deep_steps", static_cast<int>(first_unit + 1));
  }

  std::unique_ptr<DeepShadowMap> map_;
  gl::Buffer texel_;  // (texels x texels) first step, count of steps
  gl::Buffer step_;
  gl::Texture texel_view_;
  gl::Texture step_view_;
};

Status DeepShadow::finish() {
  map_->finish();
  std::vector<glm::vec2> texel;
  std::vector<ShadowStep> all{{}};  // a buffer has to hold something
  for (uint32_t y = 0; y < texels(); ++y)
    for (uint32_t x = 0; x < texels(); ++x) {
      const std::vector<ShadowStep> steps = map_->steps(x, y, kTolerance);
      texel.emplace_back(static_cast<float>(all.size()), static_cast<float>(steps.size()));
      all.insert(all.end(), steps.begin(), steps.end());
    }
  map_ = nullptr;
  // Where steps begin is a float in the texture, exact up to 2^24.
  constexpr size_t kMaxSteps = 1u << 24;
  if (all.size() > kMaxSteps)
    return make_error(ErrorCode::LimitExceeded, "the deep shadow map has {} steps, allowed are {}",
                      all.size(), kMaxSteps);
  RETURN_IF_ERROR(gl::check_device_limit(gl::read_device_limits(), gl::DeviceLimit::BufferTexels,
                                         std::max(all.size(), texel.size()), "the deep shadow map"));
  texel_ = gl::Buffer::of("deep shadow texels", texel);
  step_ = gl::Buffer::of("deep shadow steps", all);
  texel_view_ = gl::Texture::view_of("deep shadow texels", GL_RG32F, texel_);
  step_view_ = gl::Texture::view_of("deep shadow steps", GL_RG32F, step_);
  return {};
}

class DeepShadowPass final : public RenderPass {
 public:
  DeepShadowPass(RenderScene& scene, ExpandedStrands& expanded, DeepShadow& map)
      : Pass(strand_pass(scene, "render/deep_shadow", {&expanded}, {&map})),
        scene_(scene),
        expanded_(expanded),
        map_(map) {}

  bool is_batched() const override { return true; }
  Status run(RenderTurn&) override {
    map_.add(scene_, expanded_);
    return {};
  }

 private:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  DeepShadow& map_;
};

class DeepShadowReadyPass final : public RenderPass {
 public:
  DeepShadowReadyPass(RenderScene& scene, DeepShadow& map)
      : Pass(strand_pass(scene, "render/deep_shadow_ready", {&map}, {&map, &scene.light})), map_(map) {}
  Status run(RenderTurn&) override { return map_.finish(); }

 private:
  DeepShadow& map_;
};

}  // namespace

void add_deep_shadow(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& map = passes.keep(std::make_unique<DeepShadow>(scene.method_settings.shadow_texels));
  scene.shadow = &map;
  passes.add(make_light_frame_pass(scene, map));
  passes.add(walks.add("for_shadow"));
  passes.add(std::make_unique<DeepShadowPass>(scene, walks.expanded(), map));
  passes.add(std::make_unique<DeepShadowReadyPass>(scene, map));
}

}  // namespace strandcast
