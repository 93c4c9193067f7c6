#include "server/sim/executor/gl_scatter_study.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "shaders/shared/limits.h"
#include "shaders/shared/scatter_study.h"

namespace strandcast {
namespace {

/// Twenty planes cut a space into 1,351 parts at most: as many bins have samples, if their hashes are as
/// different.
constexpr uint32_t kPlanes = 20;
constexpr uint32_t kHashBins = 4096;  // a power of two
constexpr uint32_t kBinSize = 2048;
constexpr uint32_t kPlaneSeed = 13;

uint32_t study_groups_of(size_t invocations) {
  return static_cast<uint32_t>((invocations + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize);
}

void let_see() {
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_TEXTURE_FETCH_BARRIER_BIT |
                  GL_BUFFER_UPDATE_BARRIER_BIT);
}
void run_program(const gl::Program& program, uint32_t groups) {
  program.use();
  glDispatchCompute(groups, 1, 1);
  let_see();
}
void clear(const gl::Buffer& buffer) {
  const uint32_t zero = 0;
  glClearNamedBufferData(buffer.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, &zero);
}

/// On the device, as study/samples.glsl reads them.
struct Samples {
  gl::Buffer buffer;
  gl::Texture view;
  uint32_t count = 0;

  explicit Samples(std::span<const VolumeRecord> records)
      : buffer("study samples", std::as_bytes(records)),
        view(gl::Texture::view_of("study samples", GL_RGBA32F, buffer)),
        count(static_cast<uint32_t>(records.size())) {}
};

float per_cell_m3(const VolumeGrid& grid) {
  return 1.0f / (grid.cell_m * grid.cell_m * grid.cell_m);
}

class RasterStudy final : public GlScatterStudy {
 public:
  RasterStudy(const VolumeGrid& grid, std::span<const VolumeRecord> samples)
      : GlScatterStudy(grid), samples_(samples) {}

  Status prepare(const gl::ShaderLibrary& shaders) {
    ASSIGN_OR_RETURN(
        points_,
        gl::Program::make(shaders, {"study/raster.vert", "study/raster.geom", "study/raster.frag"}, {}));
    ASSIGN_OR_RETURN(divide_, gl::Program::make(shaders, {"study/divide.comp"}, {}));
    const glm::vec3 count(grid_.nodes);
    points_.set("u_node_count", count);
    divide_.set("u_node_count", count);
    divide_.set("u_per_cell_m3", per_cell_m3(grid_));
    sums_ = gl::Texture::volume("study sums", GL_RGBA32F, grid_.nodes.x, grid_.nodes.y, grid_.nodes.z);
    const std::array<const gl::Texture*, 1> colors = {&sums_};
    ASSIGN_OR_RETURN(layers_, gl::Framebuffer::make("study layers", colors, nullptr));
    return {};
  }

  void run() override {
    layers_.bind();
    glViewport(0, 0, static_cast<GLsizei>(grid_.nodes.x), static_cast<GLsizei>(grid_.nodes.y));
    const std::array<float, 4> nothing{};
    glClearNamedFramebufferfv(layers_.name(), GL_COLOR, 0, nothing.data());
    glEnable(GL_BLEND);
    glEnable(GL_PROGRAM_POINT_SIZE);
    glBlendFunc(GL_ONE, GL_ONE);
    samples_.view.bind(shader::kUnitStudySample);
    vertices_.bind();
    points_.use();
    glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(samples_.count));
    glDisable(GL_PROGRAM_POINT_SIZE);
    glDisable(GL_BLEND);
    sums_.bind(shader::kUnitStudySum);
    nodes_.bind_storage(shader::kBindingStudyNodes);
    run_program(divide_, study_groups_of(grid_.size()));
  }

 private:
  Samples samples_;
  gl::Texture sums_;
  gl::Framebuffer layers_;
  gl::VertexArray vertices_{"study"};
  gl::Program points_, divide_;
};

class BinStudy final : public GlScatterStudy {
 public:
  BinStudy(const VolumeGrid& grid, std::span<const VolumeRecord> samples, bool by_planes)
      : GlScatterStudy(grid), samples_(samples), by_planes_(by_planes) {
    if (by_planes_) place_planes(samples);
    bin_count_ = by_planes_ ? kHashBins : static_cast<uint32_t>(grid_.size());
    bins_ = gl::Buffer("study bins", (size_t{bin_count_} + 1) * sizeof(uint32_t));
    members_ = gl::Buffer("study members",
                          (by_planes_ ? size_t{bin_count_} * kBinSize : samples.size()) * sizeof(uint32_t));
    if (!by_planes_) sorted_ = gl::Buffer("study sorted", samples.size_bytes());
  }

  Status prepare(const gl::ShaderLibrary& shaders) {
    const auto make = [&](gl::Program& program, const char* path) -> Status {
      ASSIGN_OR_RETURN(program, gl::Program::make(shaders, {path}, {{"BY_PLANES", by_planes_ ? 1 : 0}}));
      program.set("u_node_count", glm::vec3(grid_.nodes));
      program.set("u_sample_count", samples_.count);
      if (!by_planes_) return {};
      program.set("u_plane_count", kPlanes);
      program.set("u_bin_count", kHashBins);
      program.set("u_bin_size", kBinSize);
      return {};
    };
    RETURN_IF_ERROR(make(count_, "study/bins_count.comp"));
    RETURN_IF_ERROR(make(gather_, "study/bins_gather.comp"));
    gather_.set("u_per_cell_m3", per_cell_m3(grid_));
    if (by_planes_) return {};
    ASSIGN_OR_RETURN(begin_, gl::Program::make(shaders, {"study/bins_begin.comp"}, {}));
    begin_.set("u_bin_count", bin_count_);
    return make(place_, "study/bins_place.comp");
  }

  void run() override {
    clear(bins_);
    samples_.view.bind(shader::kUnitStudySample);
    nodes_.bind_storage(shader::kBindingStudyNodes);
    bins_.bind_storage(shader::kBindingStudyBins);
    members_.bind_storage(shader::kBindingStudyMembers);
    if (by_planes_) planes_.bind_storage(shader::kBindingStudyPlanes);
    run_program(count_, study_groups_of(samples_.count));
    if (!by_planes_) {
      run_program(begin_, 1);
      sorted_.bind_storage(shader::kBindingStudySorted);
      run_program(place_, study_groups_of(samples_.count));
    }
    run_program(gather_, study_groups_of(grid_.size()));
  }

  uint64_t lost_count() const override {
    if (!by_planes_) return 0;
    uint64_t lost = 0;
    for (const uint32_t count : bins_.read_all<uint32_t>()) lost += count > kBinSize ? count - kBinSize : 0;
    return lost;
  }

 private:
  /// Through samples, in every direction alike.
  void place_planes(std::span<const VolumeRecord> samples) {
    std::mt19937 random(kPlaneSeed);
    std::normal_distribution<float> normal;
    std::vector<glm::vec4> planes;
    for (uint32_t i = 0; i < kPlanes; ++i) {
      const glm::vec3 across = glm::normalize(glm::vec3(normal(random), normal(random), normal(random)));
      const VolumeRecord& through = samples[random() % samples.size()];
      planes.emplace_back(across, glm::dot(across, glm::vec3(through.at[0], through.at[1], through.at[2])));
    }
    planes_ = gl::Buffer::of("study planes", planes);
  }

  Samples samples_;
  bool by_planes_;
  uint32_t bin_count_ = 0;
  gl::Buffer planes_, bins_, members_, sorted_;
  gl::Program count_, begin_, place_, gather_;
};

template <class Study>
Result<std::unique_ptr<GlScatterStudy>> prepared(std::unique_ptr<Study> study,
                                                 const gl::ShaderLibrary& shaders) {
  RETURN_IF_ERROR(study->prepare(shaders));
  return std::unique_ptr<GlScatterStudy>(std::move(study));
}

}  // namespace

void GlScatterStudy::wait() {
  glFinish();
}

Result<std::unique_ptr<GlScatterStudy>> make_gl_scatter_study(const gl::ShaderLibrary& shaders,
                                                              const gl::DeviceLimits& limits,
                                                              std::string_view name, const VolumeGrid& grid,
                                                              std::span<const VolumeRecord> samples) {
  if (samples.empty()) return make_error(ErrorCode::BadInput, "no hair is in the grid");
  RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::BufferTexels, 2 * samples.size(),
                                         "samples of a study"));
  RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::GroupCount,
                                         study_groups_of(std::max(samples.size(), grid.size())),
                                         "samples of a study"));
  if (name == "raster") return prepared(std::make_unique<RasterStudy>(grid, samples), shaders);
  if (name == "counting" || name == "hashing")
    return prepared(std::make_unique<BinStudy>(grid, samples, name == "hashing"), shaders);
  return make_error(ErrorCode::BadInput,
                    "no way of scattering is called {} (known: counting, hashing, raster)", name);
}

}  // namespace strandcast
