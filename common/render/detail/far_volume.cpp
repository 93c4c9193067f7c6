#include "common/render/detail/far_volume.h"

#include <epoxy/gl.h>

#include <algorithm>

#include "common/render/shadow/shadow_method.h"
#include "common/render/transparency/transparency.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr uint32_t kFarVolumeCells = 64;  // along each side
constexpr uint64_t kCellCount = uint64_t{kFarVolumeCells} * kFarVolumeCells * kFarVolumeCells;
constexpr uint32_t kSumsPerCell = 5;
// Steps in which sums are counted: up to 2,048 of optical depth per cell.
constexpr float kSumSteps = 1048576.0f;
// OpenGL gives a signed 32-bit integer to a texture of floats as its share of the greatest.
constexpr double kGreatestInteger = 2147483647.0;
// Widths of a strand on the screen between which strands give way to the volume.
constexpr float kVolumeAlonePx = 0.12f;
constexpr float kStrandsAlonePx = 0.25f;
// Behind the units of the light and of what shades.
constexpr uint32_t kWayUnit = 8;
constexpr uint32_t kAlongUnit = 9;
constexpr uint32_t kFarDepthUnit = 10;

class FarBeginPass final : public RenderPass {
 public:
  FarBeginPass(RenderScene& scene, FarVolume& volume)
      : Pass({"render/far_begin",
              {&scene.strands},
              {&volume},
              scene.features.has_strands.value,
              scene.features.has_strands.reason}),
        scene_(scene),
        volume_(volume) {}
  Status run(RenderTurn& turn) override {
    volume_.begin(scene_, turn);
    return {};
  }

 private:
  RenderScene& scene_;
  FarVolume& volume_;
};

class FarSumPass final : public RenderPass {
 public:
  FarSumPass(RenderScene& scene, ExpandedStrands& expanded, FarVolume& volume)
      : Pass(strand_pass(scene, "render/far_sum", {&expanded}, {&volume})),
        scene_(scene),
        expanded_(expanded),
        volume_(volume) {}
  bool is_batched() const override { return true; }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/far_volume_sum.comp"}, {}));
    return {};
  }
  Status run(RenderTurn& turn) override {
    if (volume_.is_seen()) volume_.add(program_, scene_, expanded_, turn);
    return {};
  }

 private:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  FarVolume& volume_;
  gl::Program program_;
};

class FarReadyPass final : public RenderPass {
 public:
  FarReadyPass(RenderScene& scene, FarVolume& volume)
      : Pass(strand_pass(scene, "render/far_ready", {&volume}, {&volume})), volume_(volume) {}
  Status run(RenderTurn&) override {
    if (volume_.is_seen()) volume_.finish();
    return {};
  }

 private:
  FarVolume& volume_;
};

class FarDrawPass final : public RenderPass {
 public:
  FarDrawPass(RenderScene& scene, FarVolume& volume)
      : Pass(strand_pass(scene, "render/far_volume", {&volume, &scene.scene, &scene.light},
                         {&scene.strand_layer})),
        scene_(scene),
        volume_(volume) {}
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(screen_,
                     FullScreen::make(setup, "render/far_volume.frag", strand_light_variant(scene_)));
    return {};
  }
  Status run(RenderTurn& turn) override {
    RETURN_IF_ERROR(scene_.strand_layer.resize(turn.size_px));
    scene_.strand_layer.begin();
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    glClear(GL_COLOR_BUFFER_BIT);
    if (!volume_.is_seen()) return {};
    const gl::Program& program = screen_.program();
    set_strand_light(scene_, program, turn);
    volume_.set_uniforms(program, turn);
    scene_.scene.depth().bind(kFarDepthUnit);
    program.set("u_scene_depth", static_cast<int>(kFarDepthUnit));
    screen_.draw();
    return {};
  }

 private:
  RenderScene& scene_;
  FarVolume& volume_;
  FullScreen screen_;
};

}  // namespace

float far_share(const RenderScene& scene, const View& view) {
  const float px_per_m = view.focal_px / static_cast<float>(kSamplesPerSide) / view.target_distance_m;
  const float width_px = 2.0f * scene.look.strand_radius_m * px_per_m;
  const float near = std::clamp((width_px - kVolumeAlonePx) / (kStrandsAlonePx - kVolumeAlonePx), 0.0f, 1.0f);
  return 1.0f - near * near * (3.0f - 2.0f * near);
}

void FarVolume::begin(const RenderScene& scene, RenderTurn& turn) {
  share_ = far_share(scene, turn.view);
  turn.strands_shown = 1.0f - share_;
  if (!is_seen()) return;
  if (cell_.size_bytes() == 0) {
    cell_ = gl::Buffer("far sums", kCellCount * kSumsPerCell * sizeof(int32_t));
    way_ = gl::Texture::volume("far way", GL_RGBA32F, kFarVolumeCells, kFarVolumeCells, kFarVolumeCells);
    along_ = gl::Texture::volume("far along", GL_R32F, kFarVolumeCells, kFarVolumeCells, kFarVolumeCells);
  }
  cube_ = fit_hair_cube(turn.strands.position_m, shadow_margin_m(scene));
  glClearNamedBufferData(cell_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
}

void FarVolume::add(const gl::Program& program, const RenderScene& scene, const ExpandedStrands& expanded,
                    const RenderTurn& turn) const {
  if (expanded.segment_count == 0) return;
  program.use();
  expanded.vertex().bind_storage(shader::kBindingExpanded);
  cell_.bind_storage(shader::kBindingFarSum);
  program.set("u_segments", expanded.segment_count);
  program.set("u_cells", static_cast<int>(kFarVolumeCells));
  program.set("u_cube_origin_m", cube_.origin_m);
  program.set("u_cell_m", cube_.side_m / static_cast<float>(kFarVolumeCells));
  program.set("u_eye_m", turn.view.eye_m);
  program.set("u_strand_width_m", expanded.width_m);
  program.set("u_tip_scale", scene.look.tip_scale);
  program.set("u_sum_steps", kSumSteps);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  glDispatchCompute((expanded.segment_count + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1, 1);
}

void FarVolume::finish() const {
  glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, cell_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage3D(way_.name(), 0, 0, 0, 0, kFarVolumeCells, kFarVolumeCells, kFarVolumeCells, GL_RGBA,
                      GL_INT, nullptr);
  // Behind the four sums of all cells.
  const auto* const offset = reinterpret_cast<const void*>(uintptr_t{kCellCount * 4 * sizeof(int32_t)});
  glTextureSubImage3D(along_.name(), 0, 0, 0, 0, kFarVolumeCells, kFarVolumeCells, kFarVolumeCells, GL_RED,
                      GL_INT, offset);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

void FarVolume::set_uniforms(const gl::Program& program, const RenderTurn& turn) const {
  way_.bind(kWayUnit);
  along_.bind(kAlongUnit);
  program.set("u_way", static_cast<int>(kWayUnit));
  program.set("u_along", static_cast<int>(kAlongUnit));
  program.set("u_far_origin_m", cube_.origin_m);
  program.set("u_far_side_m", cube_.side_m);
  program.set("u_depth_per_m",
              static_cast<float>(kGreatestInteger / kSumSteps / (cube_.side_m / kFarVolumeCells)));
  program.set("u_share", share_);
  program.set("u_head_from_clip", glm::inverse(turn.view.clip_from_head));
  program.set("u_pixel_step", 1.0f / glm::vec2(turn.size_px));
}

FarVolume& add_far_volume(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& volume = passes.keep(std::make_unique<FarVolume>());
  passes.add(std::make_unique<FarBeginPass>(scene, volume));
  passes.add(walks.add("for_far_volume"));
  passes.add(std::make_unique<FarSumPass>(scene, walks.expanded(), volume));
  passes.add(std::make_unique<FarReadyPass>(scene, volume));
  return volume;
}

void add_far_volume_draw(RenderScene& scene, RenderPassList& passes, FarVolume& volume) {
  passes.add(std::make_unique<FarDrawPass>(scene, volume));
}

}  // namespace strandcast
