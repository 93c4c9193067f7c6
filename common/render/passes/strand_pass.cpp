#include "common/render/passes/strand_pass.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <utility>

#include "common/render/detail/culling.h"
#include "common/render/shadow/shadow_method.h"
#include "common/scene/hair_color.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/methods.h"

namespace strandcast {
namespace {

constexpr uint32_t kSegmentsPerDraw = StrandDraw::kSegmentsPerDraw;
constexpr uint32_t kStrandLightUnit = 0;
// Behind those of the light's map and of what is blended.
constexpr uint32_t kLongitudinalUnit = 11;
constexpr uint32_t kAzimuthalUnit = 12;
constexpr uint32_t kAverageUnit = 13;
constexpr uint32_t kDensityUnit = 14;
// Weights of the terms of a look with the usual ones, chosen by eye on the built-in scene.
constexpr float kDiffuse = 0.70f;
constexpr float kScatter = 0.30f;
// What water takes of the colour, and of the width of highlights and the diffuse light.
constexpr float kWetDark = 0.45f;
constexpr float kWetSharp = 0.5f;
// Change of the density from cell to cell that makes a surface, strands crossed per metre.
constexpr float kMinSlopePerM = 2.0f;

static_assert(static_cast<int>(ShadingModel::Sadeghi) == SHADING_SADEGHI &&
              static_cast<int>(ShadingModel::KajiyaKay) == SHADING_KAJIYA_KAY &&
              static_cast<int>(ShadingModel::Karis) == SHADING_KARIS &&
              static_cast<int>(ShadingModel::Chiang) == SHADING_CHIANG &&
              static_cast<int>(ShadingModel::Marschner) == SHADING_MARSCHNER);
static_assert(static_cast<int>(ScatteringModel::Volume) == SCATTERING_VOLUME &&
              static_cast<int>(ScatteringModel::None) == SCATTERING_NONE &&
              static_cast<int>(ScatteringModel::Isosurface) == SCATTERING_ISOSURFACE &&
              static_cast<int>(ScatteringModel::Dual) == SCATTERING_DUAL);

/// And what is read to shade by the methods of the scene.
gl::Resources with_tables(const RenderScene& scene, gl::Resources reads) {
  if (scene.features.has_lobe_tables.value) reads.push_back(&scene.lobe_tables);
  if (scene.features.has_scatter_tables.value) reads.push_back(&scene.scatter_tables);
  if (scene.features.has_density_normals.value) reads.push_back(&scene.density);
  return reads;
}

std::vector<uint16_t> make_quad_indices() {
  std::vector<uint16_t> index;
  index.reserve(kSegmentsPerDraw * StrandDraw::kIndicesPerSegment);
  for (uint32_t segment = 0; segment < kSegmentsPerDraw; ++segment)
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u})
      index.push_back(static_cast<uint16_t>(StrandDraw::kCornersPerSegment * segment + corner));
  return index;
}

/// A software renderer keeps the triangles of all draws until it gets to them, hundreds of megabytes for a
/// picture full of hair. It gets one draw while it works at the one before.
class DrawQueue {
 public:
  explicit DrawQueue(bool is_software) : is_software_(is_software) {}
  ~DrawQueue() { glDeleteSync(before_); }
  DrawQueue(const DrawQueue&) = delete;
  DrawQueue& operator=(const DrawQueue&) = delete;
  /// Call behind every draw.
  void wait_for_the_one_before() {
    if (!is_software_) return;
    const GLsync now = glFenceSync(GL_SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (before_ != nullptr) glClientWaitSync(before_, GL_SYNC_FLUSH_COMMANDS_BIT, kLongestWaitNs);
    glDeleteSync(std::exchange(before_, now));
  }

 private:
  static constexpr GLuint64 kLongestWaitNs = 10'000'000'000;
  const bool is_software_;
  GLsync before_ = nullptr;
};

/// What shaders/render/strand_light.glsl reads beside the light.
void set_shading(const RenderScene& scene, const gl::Program& program) {
  const LookDesc& look = scene.look;
  const HairShadingDesc& shading = look.shading;
  const HairShadingDesc usual;
  const HairColors colors = colors_of(look);
  const auto shapes = lobe_shapes_of(look);
  // Wet hair as lib/hair_light.glsl has it: darker, with sharp highlights.
  const float dark = 1.0f - kWetDark * shading.wetness;
  const float dry = 1.0f - kWetSharp * shading.wetness;
  program.set("u_root_color", colors.root * dark);
  program.set("u_tip_color", colors.tip * dark);
  program.set("u_lobe_weights", glm::vec3(shading.highlight * (1.0f + shading.wetness), shading.transmission,
                                          shading.second_highlight));
  program.set("u_diffuse", kDiffuse * dry * shading.diffuse / usual.diffuse);
  program.set("u_scatter", kScatter * shading.scatter / usual.scatter);
  program.set("u_root_darkening", shading.root_darkening);
  program.set("u_strand_variation", shading.strand_variation);
  program.set("u_warmth_variation", shading.warmth_variation);
  program.set("u_highlight_width", static_cast<float>(shapes[0].width));
  program.set("u_highlight_shift", static_cast<float>(shapes[0].shift));
  program.set("u_tilt_spread", glm::radians(look.shading.cuticle_spread_deg));
  if (scene.features.has_lobe_tables.value) {
    scene.lobe_tables.longitudinal().bind(kLongitudinalUnit);
    scene.lobe_tables.azimuthal().bind(kAzimuthalUnit);
    program.set("u_longitudinal_table", static_cast<int>(kLongitudinalUnit));
    program.set("u_azimuthal_table", static_cast<int>(kAzimuthalUnit));
  }
  if (scene.features.has_scatter_tables.value) {
    scene.scatter_tables.averages().bind(kAverageUnit);
    program.set("u_average_table", static_cast<int>(kAverageUnit));
  }
  if (scene.features.has_density_normals.value) {
    scene.density.density().bind(kDensityUnit);
    program.set("u_surface_density", static_cast<int>(kDensityUnit));
    program.set("u_min_slope", kMinSlopePerM);
  }
}

class StrandPass final : public StrandDrawPass {
 public:
  StrandPass(RenderScene& scene, ExpandedStrands& expanded)
      : StrandDrawPass(scene, expanded,
                       strand_pass(scene, "render/strands", {&expanded, &scene.light}, {&scene.scene}),
                       StrandDraw::kShadedFragment) {}

  Status run(RenderTurn& turn) override {
    scene_.scene.begin();
    if (turn.strands_shown <= 0.0f) return {};
    strands_.begin(scene_, expanded_, turn, scene_.scene.size_px());
    strands_.draw(scene_, expanded_);
    return {};
  }
};

class ReadyPass final : public RenderPass {
 public:
  explicit ReadyPass(gl::PassDeclaration declaration) : Pass(std::move(declaration)) {}
  Status run(RenderTurn&) override {
    glTextureBarrier();
    return {};
  }
};

}  // namespace

uint64_t StrandDraw::size_bytes() {
  return uint64_t{kSegmentsPerDraw} * StrandDraw::kIndicesPerSegment * sizeof(uint16_t);
}

Result<StrandDraw> StrandDraw::make(const RenderSetup& setup, const RenderScene& scene,
                                    const std::string& fragment_stage, gl::Variant variant,
                                    const std::string& vertex_stage) {
  StrandDraw strands;
  strands.is_shaded_ = fragment_stage == kShadedFragment;
  if (vertex_stage == kShadedStage) {
    variant.merge(strand_light_variant(scene));
    // Others take the colour of the vertex stage.
    const bool is_per_fragment =
        scene.features.is_shaded_per_fragment.value && fragment_stage == kShadedFragment;
    variant["IS_PER_FRAGMENT"] = is_per_fragment ? 1 : 0;
    variant["JOINTS"] = static_cast<int>(scene.methods.joints);
    strands.is_chosen_ = scene.culling != nullptr;
    variant["IS_CHOSEN"] = strands.is_chosen_ ? 1 : 0;
  }
  ASSIGN_OR_RETURN(strands.program_,
                   gl::Program::make(setup.shaders, {vertex_stage, fragment_stage}, variant));
  strands.vertex_array_ = gl::VertexArray("strand");
  strands.quad_index_ = gl::Buffer::of("quad index", make_quad_indices());
  glVertexArrayElementBuffer(strands.vertex_array_.name(), strands.quad_index_.name());
  return strands;
}

void StrandDraw::begin(const RenderScene& scene, const ExpandedStrands& expanded, const RenderTurn& turn,
                       glm::uvec2 target_px) {
  const LookDesc& look = scene.look;
  bind(expanded);
  set_strand_light(scene, program_, turn);
  program_.set("u_clip_from_head", turn.view.clip_from_head);
  program_.set("u_target_px", glm::vec2(target_px));
  // The view counts the samples of a picture with kSamplesPerSide.
  program_.set("u_focal_px", turn.view.focal_px * (static_cast<float>(target_px.y) / turn.view.target_px.y));
  program_.set("u_near_m", turn.view.near_m);
  program_.set("u_widened_px", 1.0f);
  program_.set("u_which", static_cast<int>(StrandDepth::All));
  if (is_shaded_) program_.set("u_shown", turn.strands_shown);
  program_.set("u_strand_width_m", expanded.width_m);
  program_.set("u_tip_scale", look.tip_scale);
}

void StrandDraw::bind(const ExpandedStrands& expanded) {
  program_.use();
  vertex_array_.bind();
  expanded.vertex().bind_storage(shader::kBindingExpanded);
}

void StrandDraw::draw(const RenderScene& scene, const ExpandedStrands& expanded) const {
  const uint32_t segments = expanded.segment_count;
  DrawQueue queue(scene.is_software);
  if (is_chosen_) {
    const ChosenSegments& chosen = scene.culling->chosen();
    chosen.bind();
    for (uint32_t draw = 0; draw < chosen.draw_count(segments); ++draw) {
      chosen.draw(draw);
      queue.wait_for_the_one_before();
    }
    return;
  }
  for (uint32_t first = 0; first < segments; first += kSegmentsPerDraw) {
    const uint32_t count = std::min(kSegmentsPerDraw, segments - first);
    glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(count * StrandDraw::kIndicesPerSegment),
                             GL_UNSIGNED_SHORT, nullptr,
                             static_cast<GLint>(first * StrandDraw::kCornersPerSegment));
    queue.wait_for_the_one_before();
  }
}

gl::Variant strand_light_variant(const RenderScene& scene) {
  return {{"SHADOW", static_cast<int>(scene.methods.shadow)},
          {"SHADING", static_cast<int>(scene.features.shading)},
          {"SCATTERING", static_cast<int>(scene.features.scattering)}};
}

void set_strand_light(const RenderScene& scene, const gl::Program& program, const RenderTurn& turn) {
  scene.light.set_uniforms(program, kStrandLightUnit);
  if (scene.shadow != nullptr) scene.shadow->set_uniforms(program, kFirstShadowUnit);
  program.set("u_eye_m", turn.view.eye_m);
  set_shading(scene, program);
}

gl::PassDeclaration strand_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                gl::Resources writes) {
  return {std::move(name), with_tables(scene, std::move(reads)), std::move(writes),
          scene.features.has_strands.value, scene.features.has_strands.reason};
}

Status StrandDrawPass::prepare(const RenderSetup& setup) {
  ASSIGN_OR_RETURN(strands_, StrandDraw::make(setup, scene_, fragment_stage_));
  return {};
}

std::unique_ptr<RenderPass> make_ready_pass(const RenderScene& scene, std::string name, gl::Resources reads,
                                            gl::Resources writes) {
  return std::make_unique<ReadyPass>(
      strand_pass(scene, std::move(name), std::move(reads), std::move(writes)));
}

std::unique_ptr<RenderPass> make_strand_pass(RenderScene& scene, ExpandedStrands& expanded) {
  return std::make_unique<StrandPass>(scene, expanded);
}

}  // namespace strandcast
