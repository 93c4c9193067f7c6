// Rays through a volume of density (Woodhouse 2017, 4.3.4: what its faster program does): no map of the
// light, and nothing drawn from it. The sources differ in what a step takes off the light: it multiplies by
// absorption / (1 + density) in each of a fixed number of steps, which depends on their number; here optical
// depth is summed along the ray, exp(-depth) passes (3.8 c of the reference sheet). The volume is of the
// drawn strands, summed in integers, and knows the true angle between each strand and the light.

#include <epoxy/gl.h>

#include "common/render/shadow/density_volume.h"
#include "common/render/shadow/light_map.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr uint32_t kRayCells = 64;  // along each side
constexpr uint64_t kCellCount = uint64_t{kRayCells} * kRayCells * kRayCells;
// Steps in which optical depth is counted: up to 4,096 per cell.
constexpr float kDensitySteps = 1048576.0f;
// OpenGL gives a 32-bit integer to a texture of floats as its share of the greatest.
constexpr double kGreatestDensity = 4294967295.0;

class DensityBeginPass final : public RenderPass {
 public:
  DensityBeginPass(RenderScene& scene, DensityVolume& volume)
      : Pass({"render/density_begin", {&scene.strands}, {&scene.light, &volume}, true, {}}),
        scene_(scene),
        volume_(volume) {}
  Status run(RenderTurn& turn) override {
    scene_.light.set_light(scene_.look, turn.view, to_light_in_head(scene_, turn));
    volume_.begin(scene_, turn);
    return {};
  }

 private:
  RenderScene& scene_;
  DensityVolume& volume_;
};

class DensityPass final : public RenderPass {
 public:
  DensityPass(RenderScene& scene, ExpandedStrands& expanded, DensityVolume& volume)
      : Pass(strand_pass(scene, "render/density", {&expanded}, {&volume})),
        scene_(scene),
        expanded_(expanded),
        volume_(volume) {}

  bool is_batched() const override { return true; }
  Status prepare(const RenderSetup& setup) override {
    ASSIGN_OR_RETURN(program_, gl::Program::make(setup.shaders, {"render/density.comp"}, {}));
    return {};
  }
  Status run(RenderTurn&) override {
    volume_.add(program_, scene_, expanded_);
    return {};
  }

 private:
  RenderScene& scene_;
  ExpandedStrands& expanded_;
  DensityVolume& volume_;
  gl::Program program_;
};

class DensityReadyPass final : public RenderPass {
 public:
  DensityReadyPass(RenderScene& scene, DensityVolume& volume)
      : Pass(strand_pass(scene, "render/density_ready", {&volume}, {&volume, &scene.light})),
        volume_(volume) {}
  Status run(RenderTurn&) override {
    volume_.finish();
    return {};
  }

 private:
  DensityVolume& volume_;
};

}  // namespace

void DensityVolume::begin(const RenderScene& scene, const RenderTurn& turn) {
  if (cell_.size_bytes() == 0) {
    cell_ = gl::Buffer("density", kCellCount * sizeof(uint32_t));
    texture_ = gl::Texture::volume("density", GL_R32F, kRayCells, kRayCells, kRayCells);
  }
  cube_ = fit_hair_cube(turn.strands.position_m, shadow_margin_m(scene));
  to_light_ = to_light_in_head(scene, turn);
  skull_ = shadowing_skull(scene);
  glClearNamedBufferData(cell_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
}

void DensityVolume::add(const gl::Program& program, const RenderScene& scene,
                        const ExpandedStrands& expanded) const {
  if (expanded.segment_count == 0) return;
  program.use();
  expanded.vertex().bind_storage(shader::kBindingExpanded);
  cell_.bind_storage(shader::kBindingDensity);
  program.set("u_segments", expanded.segment_count);
  program.set("u_cells", static_cast<int>(kRayCells));
  program.set("u_cube_origin_m", cube_.origin_m);
  program.set("u_cell_m", cube_.side_m / static_cast<float>(kRayCells));
  program.set("u_to_light", to_light_);
  program.set("u_strand_width_m", expanded.width_m);
  program.set("u_tip_scale", scene.look.tip_scale);
  program.set("u_strand_opacity", scene.method_settings.strand_opacity);
  program.set("u_density_steps", kDensitySteps);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  glDispatchCompute((expanded.segment_count + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1, 1);
}

void DensityVolume::finish() const {
  glMemoryBarrier(GL_PIXEL_BUFFER_BARRIER_BIT);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, cell_.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTextureSubImage3D(texture_.name(), 0, 0, 0, 0, kRayCells, kRayCells, kRayCells, GL_RED, GL_UNSIGNED_INT,
                      nullptr);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
}

void DensityVolume::set_uniforms(const gl::Program& program, uint32_t first_unit) const {
  set_density_uniforms(program, first_unit);
  set_skull_uniforms(program, skull_);
}

void DensityVolume::set_density_uniforms(const gl::Program& program, uint32_t unit) const {
  const double cell_m = cube_.side_m / kRayCells;
  texture_.bind(unit);
  program.set("u_density", static_cast<int>(unit));
  program.set("u_cube_origin_m", cube_.origin_m);
  program.set("u_cube_from_m", 1.0f / cube_.side_m);
  program.set("u_density_per_m", static_cast<float>(kGreatestDensity / kDensitySteps / cell_m));
}

void add_density_passes(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes,
                        DensityVolume& volume) {
  passes.add(std::make_unique<DensityBeginPass>(scene, volume));
  passes.add(walks.add("for_density"));
  passes.add(std::make_unique<DensityPass>(scene, walks.expanded(), volume));
  passes.add(std::make_unique<DensityReadyPass>(scene, volume));
}

void add_density_rays(RenderScene& scene, ExpandWalks& walks, RenderPassList& passes) {
  auto& volume = passes.keep(std::make_unique<DensityVolume>());
  scene.shadow = &volume;
  add_density_passes(scene, walks, passes, volume);
}

}  // namespace strandcast
