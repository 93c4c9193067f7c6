#include "common/render/passes/strand_pass.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <utility>

#include "common/scene/hair_color.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/methods.h"

namespace strandcast {
namespace {

constexpr uint32_t kCornersPerSegment = 4;
constexpr uint32_t kIndicesPerSegment = 6;
// Segments per draw such that 16-bit indices reach all corners.
constexpr uint32_t kSegmentsPerDraw = 65'536 / kCornersPerSegment;
constexpr uint32_t kLightUnit = 0;
constexpr uint32_t kLongitudinalUnit = 1;
constexpr uint32_t kAzimuthalUnit = 2;
constexpr uint32_t kAverageUnit = 3;
constexpr uint32_t kDensityUnit = 4;
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

/// What is read to shade by the methods of the scene.
gl::Resources resources_of(const RenderScene& scene, const ExpandedStrands& expanded) {
  gl::Resources reads{&expanded, &scene.light};
  if (scene.features.has_lobe_tables.value) reads.push_back(&scene.lobe_tables);
  if (scene.features.has_scatter_tables.value) reads.push_back(&scene.scatter_tables);
  if (scene.features.has_density_normals.value) reads.push_back(&scene.density);
  return reads;
}

std::vector<uint16_t> make_quad_indices() {
  std::vector<uint16_t> index;
  index.reserve(kSegmentsPerDraw * kIndicesPerSegment);
  for (uint32_t segment = 0; segment < kSegmentsPerDraw; ++segment)
    for (const uint32_t corner : {0u, 1u, 2u, 2u, 1u, 3u})
      index.push_back(static_cast<uint16_t>(kCornersPerSegment * segment + corner));
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

class StrandPass final : public RenderPass {
 public:
  StrandPass(RenderScene& scene, ExpandedStrands& expanded)
      : Pass({"render/strands",
              resources_of(scene, expanded),
              {&scene.scene},
              scene.features.has_strands.value,
              scene.features.has_strands.reason}),
        scene_(scene),
        expanded_(expanded) {}

  bool is_batched() const override { return true; }
  uint64_t size_bytes() const override {
    return uint64_t{kSegmentsPerDraw} * kIndicesPerSegment * sizeof(uint16_t);
  }

  Status prepare(const RenderSetup& setup) override {
    const PictureFeatures& features = scene_.features;
    const gl::Variant variant{{"SHADING", static_cast<int>(features.shading)},
                              {"SCATTERING", static_cast<int>(features.scattering)},
                              {"IS_PER_FRAGMENT", features.is_shaded_per_fragment.value ? 1 : 0}};
    ASSIGN_OR_RETURN(program_,
                     gl::Program::make(setup.shaders, {"render/strand.vert", "render/strand.frag"}, variant));
    vertex_array_ = gl::VertexArray("strand");
    quad_index_ = gl::Buffer::of("quad index", make_quad_indices());
    glVertexArrayElementBuffer(vertex_array_.name(), quad_index_.name());
    return {};
  }

  Status run(RenderTurn& turn) override {
    const LookDesc& look = scene_.look;
    scene_.scene.begin();
    program_.use();
    vertex_array_.bind();
    expanded_.vertex().bind_storage(shader::kBindingExpanded);
    scene_.light.set_uniforms(program_, kLightUnit);
    program_.set("u_clip_from_head", turn.view.clip_from_head);
    program_.set("u_eye_m", turn.view.eye_m);
    program_.set("u_target_px", turn.view.target_px);
    program_.set("u_focal_px", turn.view.focal_px);
    program_.set("u_near_m", turn.view.near_m);
    program_.set("u_strand_width_m", expanded_.width_m);
    program_.set("u_tip_scale", look.tip_scale);
    set_shading(look);
    const uint32_t segments = expanded_.segment_count;
    DrawQueue queue(scene_.is_software);
    for (uint32_t first = 0; first < segments; first += kSegmentsPerDraw) {
      const uint32_t count = std::min(kSegmentsPerDraw, segments - first);
      glDrawElementsBaseVertex(GL_TRIANGLES, static_cast<GLsizei>(count * kIndicesPerSegment),
                               GL_UNSIGNED_SHORT, nullptr, static_cast<GLint>(first * kCornersPerSegment));
      queue.wait_for_the_one_before();
    }
    return {};
  }

 private:
  /// What shaders/render/strand_light.glsl reads beside the light.
  void set_shading(const LookDesc& look) const {
    const HairColors colors = colors_of(look);
    const auto shapes = lobe_shapes_of(look);
    program_.set("u_root_color", colors.root);
    program_.set("u_tip_color", colors.tip);
    program_.set("u_lobe_weights",
                 glm::vec3(look.shading.highlight, look.shading.transmission, look.shading.second_highlight));
    program_.set("u_highlight_width", static_cast<float>(shapes[0].width));
    program_.set("u_highlight_shift", static_cast<float>(shapes[0].shift));
    program_.set("u_tilt_spread", glm::radians(look.shading.cuticle_spread_deg));
    if (scene_.features.has_lobe_tables.value) {
      scene_.lobe_tables.longitudinal().bind(kLongitudinalUnit);
      scene_.lobe_tables.azimuthal().bind(kAzimuthalUnit);
      program_.set("u_longitudinal_table", static_cast<int>(kLongitudinalUnit));
      program_.set("u_azimuthal_table", static_cast<int>(kAzimuthalUnit));
    }
    if (scene_.features.has_scatter_tables.value) {
      scene_.scatter_tables.averages().bind(kAverageUnit);
      program_.set("u_average_table", static_cast<int>(kAverageUnit));
    }
    if (scene_.features.has_density_normals.value) {
      scene_.density.density().bind(kDensityUnit);
      program_.set("u_density", static_cast<int>(kDensityUnit));
      program_.set("u_min_slope", kMinSlopePerM);
    }
  }

  RenderScene& scene_;
  ExpandedStrands& expanded_;
  gl::Program program_;
  gl::VertexArray vertex_array_;
  gl::Buffer quad_index_;
};

}  // namespace

std::unique_ptr<RenderPass> make_strand_pass(RenderScene& scene, ExpandedStrands& expanded) {
  return std::make_unique<StrandPass>(scene, expanded);
}

}  // namespace strandcast
