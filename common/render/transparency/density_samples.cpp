// Samples by density: what Woodhouse (2017) proposes in 5.2 and leaves to others. Strands in front of much
// hair hide their edges among others like them, so one sample per pixel is enough for them; those with little
// behind them, at the edge of the hair, have four. How much hair is behind a segment is what the density
// volume says along the ray that goes on from the eye.

#include <epoxy/gl.h>

#include "common/render/shadow/density_volume.h"
#include "common/render/transparency/transparency.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

// Behind this depth a twentieth of what lies there is seen.
constexpr float kDeepDepth = 3.0f;
constexpr uint32_t kSampleDensityUnit = 0;
constexpr uint32_t kColorUnit = 0;
constexpr uint32_t kSampleDepthUnit = 1;

/// Strands with one sample per pixel, and their depth.
class OneSampleTarget final : public gl::Resource {
 public:
  OneSampleTarget() : Resource("one-sample strands") {}
  Status resize(glm::uvec2 size_px) {
    if (size_px == size_px_) return {};
    size_px_ = glm::uvec2(0);
    framebuffer_ = {};
    color_ = {};
    depth_ = {};
    color_ = gl::Texture("one-sample color", GL_RGBA16F, size_px.x, size_px.y, 1);
    depth_ = gl::Texture("one-sample depth", GL_DEPTH_COMPONENT32F, size_px.x, size_px.y, 1);
    const std::array<const gl::Texture*, 1> colors{&color_};
    ASSIGN_OR_RETURN(framebuffer_, gl::Framebuffer::make("one-sample strands", colors, &depth_));
    size_px_ = size_px;
    return {};
  }
  void clear() const {
    const float nothing[4] = {};
    const float far = 1.0f;
    glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, 0, nothing);
    glClearNamedFramebufferfv(framebuffer_.name(), GL_DEPTH, 0, &far);
  }
  void begin() const {
    set_plain_state(size_px_);
    framebuffer_.bind();
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glDepthMask(GL_TRUE);
  }
  const gl::Texture& color() const { return color_; }
  const gl::Texture& depth() const { return depth_; }
  uint64_t size_bytes() const override { return color_.size_bytes() + depth_.size_bytes(); }

 private:
  gl::Texture color_;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  glm::uvec2 size_px_{0};
};

/// Marks the deep ones among the segments that are expanded now.
class SampleChoicePass final : public RenderPass {
 public:
  SampleChoicePass(RenderScene& scene, ExpandedStrands& expanded, const DensityVolume& volume)
      : Pass(strand_pass(scene, "render/sample_choice", {&expanded, &volume}, {&expanded})),
        expanded_(expanded),
        volume_(volume) {}

  bool is_batched() const override { return true; }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/sample_choice.comp"}, {}));
    return {};
  }
  Status run(RenderTurn& turn) override {
    if (expanded_.segment_count == 0) return {};
    program_.use();
    expanded_.vertex().bind_storage(shader::kBindingExpanded);
    volume_.set_density_uniforms(program_, kSampleDensityUnit);
    program_.set("u_segments", expanded_.segment_count);
    program_.set("u_eye_m", turn.view.eye_m);
    program_.set("u_deep_depth", kDeepDepth);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    glDispatchCompute((expanded_.segment_count + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1,
                      1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
    return {};
  }

 private:
  ExpandedStrands& expanded_;
  const DensityVolume& volume_;
  gl::Program program_;
};

class DensitySamplesPass final : public StrandDrawPass {
 public:
  DensitySamplesPass(RenderScene& scene, ExpandedStrands& expanded, OneSampleTarget& deep)
      : StrandDrawPass(scene, expanded,
                       strand_pass(scene, "render/strands", {&expanded, &scene.light}, {&scene.scene, &deep}),
                       "render/strand.frag"),
        deep_(deep) {}

  Status run(RenderTurn& turn) override {
    if (turn.batch_index == 0) {
      RETURN_IF_ERROR(deep_.resize(turn.size_px));
      deep_.clear();
    }
    deep_.begin();
    strands_.begin(scene_, expanded_, turn, turn.size_px);
    strands_.program().set("u_which", static_cast<int>(StrandDepth::Deep));
    strands_.draw(scene_, expanded_);
    scene_.scene.begin();
    strands_.begin(scene_, expanded_, turn, scene_.scene.size_px());
    strands_.program().set("u_which", static_cast<int>(StrandDepth::Shallow));
    strands_.draw(scene_, expanded_);
    return {};
  }

 private:
  OneSampleTarget& deep_;
};

class StrandsMergePass final : public RenderPass {
 public:
  StrandsMergePass(RenderScene& scene, OneSampleTarget& deep)
      : Pass(strand_pass(scene, "render/strands_merge", {&deep}, {&scene.scene})),
        scene_(scene),
        deep_(deep) {}

  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(screen_, FullScreen::make(setup, "render/strands_merge.frag"));
    return {};
  }
  Status run(RenderTurn&) override {
    scene_.scene.begin();
    deep_.color().bind(kColorUnit);
    deep_.depth().bind(kSampleDepthUnit);
    screen_.program().set("u_color", static_cast<int>(kColorUnit));
    screen_.program().set("u_depth", static_cast<int>(kSampleDepthUnit));
    screen_.program().set("u_samples", static_cast<int>(scene_.scene.layout().per_side));
    screen_.draw();
    return {};
  }

 private:
  RenderScene& scene_;
  OneSampleTarget& deep_;
  FullScreen screen_;
};

}  // namespace

void add_density_samples(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  // The shadow's volume, where there is one.
  const auto* volume = dynamic_cast<const DensityVolume*>(scene.shadow);
  if (volume == nullptr) {
    auto& own = passes.keep(std::make_unique<DensityVolume>());
    add_density_passes(scene, walks, passes, own);
    volume = &own;
  }
  auto& deep = passes.keep(std::make_unique<OneSampleTarget>());
  add_camera_walk(scene, walks, passes);
  passes.add(std::make_unique<SampleChoicePass>(scene, walks.expanded(), *volume));
  passes.add(std::make_unique<DensitySamplesPass>(scene, walks.expanded(), deep));
  passes.add(std::make_unique<StrandsMergePass>(scene, deep));
}

}  // namespace strandcast
