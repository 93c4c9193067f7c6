#include "tests/bench/peers/voxel_stages.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>

#include "common/base/profile.h"

namespace strandcast {
namespace {

constexpr float kFriction = 0.1f;
constexpr float kTurnRadPerS = 3.0f;
constexpr uint32_t kFrictionLocalSize = 64;
constexpr GLbitfield kAllBarriers = GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT;

template <class Work>
double timed_ms(Work&& work) {
  glFinish();
  const int64_t begin_ns = now_ns();
  work();
  glFinish();
  return static_cast<double>(now_ns() - begin_ns) * 1e-6;
}

}  // namespace

Result<VoxelStages> VoxelStages::make(const std::vector<glm::vec3>& position_m,
                                      const gl::ShaderLibrary& shaders) {
  VoxelStages stages;
  stages.particle_count_ = static_cast<uint32_t>(position_m.size());
  glm::vec3 low = position_m.front(), high = position_m.front();
  for (const glm::vec3& point : position_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  // Two voxels around all, so that no neighbour is missing.
  const glm::vec3 extent = high - low;
  stages.voxel_m_ = std::max({extent.x, extent.y, extent.z}) / static_cast<float>(kVoxels - 4);
  stages.origin_m_ = low - 2.0f * stages.voxel_m_;
  stages.state_.resize(6 * position_m.size());
  for (size_t i = 0; i < position_m.size(); ++i) {
    const glm::vec3 velocity = glm::cross(glm::vec3(0.0f, kTurnRadPerS, 0.0f), position_m[i]);
    stages.particle_.push_back({glm::vec4(position_m[i], 0.0f), glm::vec4(velocity, 0.0f)});
    for (int component = 0; component < 3; ++component) {
      const size_t at = static_cast<size_t>(component) * position_m.size() + i;
      stages.state_[at] = position_m[i][component];
      stages.state_[3 * position_m.size() + at] = velocity[component];
    }
  }
  stages.particles_ = gl::Buffer::of("voxel particles", stages.particle_);
  stages.states_ = gl::Buffer::of("voxel state", stages.state_);
  stages.sums_ = gl::Buffer("voxel sums", kBytes);
  stages.texture_ = gl::Texture::volume("voxels", GL_RGBA32F, kVoxels, kVoxels, kVoxels);
  const std::array<const gl::Texture*, 1> layers{&stages.texture_};
  ASSIGN_OR_RETURN(stages.framebuffer_, gl::Framebuffer::make("voxels", layers, nullptr));
  stages.no_attributes_ = gl::VertexArray("voxels");
  ASSIGN_OR_RETURN(stages.naive_densities_, gl::Program::make(shaders, {"naive_densities.comp"}, {}));
  ASSIGN_OR_RETURN(stages.naive_friction_, gl::Program::make(shaders, {"naive_friction.comp"}, {}));
  ASSIGN_OR_RETURN(
      stages.points_,
      gl::Program::make(shaders, {"voxel_points.vert", "voxel_points.geom", "voxel_points.frag"}, {}));
  ASSIGN_OR_RETURN(stages.friction_, gl::Program::make(shaders, {"voxel_friction.comp"}, {}));
  return stages;
}

void VoxelStages::set_grid(const gl::Program& program) const {
  program.set("u_voxels", static_cast<int>(kVoxels));
  program.set("u_origin", origin_m_);
  program.set("u_voxel", voxel_m_);
}

VoxelTimes VoxelStages::run_naive() {
  particles_.write(particle_);
  particles_.bind_storage(0);
  sums_.bind_storage(1);
  set_grid(naive_densities_);
  set_grid(naive_friction_);
  naive_friction_.set("u_friction", kFriction);
  VoxelTimes times;
  times.clear_ms = timed_ms([&] {
    glClearNamedBufferData(sums_.name(), GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, nullptr);
    glMemoryBarrier(kAllBarriers);
  });
  times.calculation_ms = timed_ms([&] {
    naive_densities_.use();
    glDispatchCompute(particle_count_, 1, 1);
    glMemoryBarrier(kAllBarriers);
    naive_friction_.use();
    glDispatchCompute(particle_count_, 1, 1);
    glMemoryBarrier(kAllBarriers);
  });
  return times;
}

void VoxelStages::draw_points() const {
  framebuffer_.bind();
  glViewport(0, 0, kVoxels, kVoxels);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_PROGRAM_POINT_SIZE);
  glEnable(GL_BLEND);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_ONE, GL_ONE);
  points_.use();
  no_attributes_.bind();
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(particle_count_));
  glDisable(GL_BLEND);
  glDisable(GL_PROGRAM_POINT_SIZE);
}

VoxelTimes VoxelStages::run_optimised() {
  states_.write(state_);
  states_.bind_storage(0);
  points_.set("u_particles", particle_count_);
  set_grid(points_);
  set_grid(friction_);
  friction_.set("u_particles", particle_count_);
  friction_.set("u_friction", kFriction);
  friction_.set("u_sums", 0);
  VoxelTimes times;
  times.clear_ms = timed_ms([&] {
    const float nothing[4] = {};
    glClearNamedFramebufferfv(framebuffer_.name(), GL_COLOR, 0, nothing);
  });
  times.calculation_ms = timed_ms([&] {
    draw_points();
    texture_.bind(0);
    friction_.use();
    glDispatchCompute((particle_count_ + kFrictionLocalSize - 1) / kFrictionLocalSize, 1, 1);
    glMemoryBarrier(kAllBarriers);
  });
  return times;
}

double VoxelStages::largest_difference_mps() const {
  const auto naive = particles_.read_all<Particle>();
  const auto optimised = states_.read_all<float>();
  double largest = 0.0;
  for (size_t i = 0; i < naive.size(); ++i)
    for (int component = 0; component < 3; ++component)
      largest = std::max(
          largest,
          static_cast<double>(std::abs(naive[i].velocity[component] -
                                       optimised[(3 + static_cast<size_t>(component)) * naive.size() + i])));
  return largest;
}

}  // namespace strandcast
