#include "common/render/transparency/transparency.h"

#include <epoxy/gl.h>

#include <utility>

#include "common/render/detail/far_volume.h"

namespace strandcast {
namespace {

// Beside the textures that the light takes in the vertex stage.
constexpr uint32_t kSceneDepthUnit = 8;

constexpr AddStrandPasses kTransparencyMethods[] = {add_hashed, add_lists, add_three_depths, add_weighted,
                                                    add_moments};

static_assert(kSamplesPerSide == 2, "blended.glsl gathers four samples of the scene");

}  // namespace

SampleLayout sample_layout(AntialiasingMethod method) {
  if (method == AntialiasingMethod::Msaa4) return {1, 4};
  return {};
}

void add_hashed(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  if (scene.methods.antialiasing == AntialiasingMethod::Msaa4) return add_msaa4(scene, walks, passes);
  if (scene.methods.antialiasing == AntialiasingMethod::DensitySamples)
    return add_density_samples(scene, walks, passes);
  FarVolume* const volume =
      scene.methods.detail == DetailMethod::Volume ? &add_far_volume(scene, walks, passes) : nullptr;
  add_camera_walk(scene, walks, passes);
  passes.add(make_strand_pass(scene, walks.expanded()));
  if (volume != nullptr) add_far_volume_draw(scene, passes, *volume);
}

void add_transparency_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  kTransparencyMethods[static_cast<size_t>(scene.methods.transparency)](scene, walks, passes);
}

void begin_blended(StrandDraw& strands, const RenderScene& scene, const ExpandedStrands& expanded,
                   const RenderTurn& turn) {
  strands.begin(scene, expanded, turn, turn.size_px);
  scene.scene.depth().bind(kSceneDepthUnit);
  strands.program().set("u_scene_depth", static_cast<int>(kSceneDepthUnit));
  strands.program().set("u_pixel_step", 1.0f / glm::vec2(turn.size_px));
}

Result<FullScreen> FullScreen::make(const RenderSetup& setup, const std::string& fragment_stage,
                                    const gl::Variant& variant) {
  FullScreen screen;
  ASSIGN_OR_RETURN(screen.program_,
                   gl::Program::make(setup.shaders, {"render/resolve.vert", fragment_stage}, variant));
  screen.no_attributes_ = gl::VertexArray("full screen");
  return screen;
}

void FullScreen::draw() const {
  program_.use();
  no_attributes_.bind();
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

Status LayerBlendPass::prepare(const RenderSetup& setup) {
  ASSIGN_OR_RETURN(screen_, FullScreen::make(setup, fragment_stage_));
  return {};
}

Status LayerBlendPass::run(RenderTurn& turn) {
  RETURN_IF_ERROR(layer_.resize(turn.size_px));
  layer_.begin();
  bind(screen_.program());
  screen_.draw();
  return {};
}

}  // namespace strandcast
