// The voxel stages of Woodhouse 2017 (4.2.4), which Strandcast does not have, as its two versions did them:
// density and mean velocity of the hair per voxel, and friction towards that mean. `naive`: sums in a buffer
// by atomic additions in 16.16 fixed point, one invocation per group. `optimised`: points drawn into the
// layers of a texture, summed by blending. GL context's thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/gl/objects.h"
#include "common/gl/program.h"

namespace strandcast {

struct VoxelTimes {
  double clear_ms = 0.0;
  double calculation_ms = 0.0;  // sums, then friction
};

class VoxelStages {
 public:
  /// Along each side: as many as take the 250,000 bytes of Woodhouse 2017, 5.1.
  static constexpr uint32_t kVoxels = 25;
  static constexpr uint64_t kBytes = 16ull * kVoxels * kVoxels * kVoxels;

  /// `shaders` holds the stages. Velocities are made up: a turn about the vertical.
  static Result<VoxelStages> make(const std::vector<glm::vec3>& position_m, const gl::ShaderLibrary& shaders);
  /// From the same velocities each time; waits for the device after each stage.
  VoxelTimes run_naive();
  VoxelTimes run_optimised();
  /// Of the velocities after both, m/s.
  double largest_difference_mps() const;

 private:
  struct Particle {
    glm::vec4 position;
    glm::vec4 velocity;
  };
  void set_grid(const gl::Program& program) const;
  void draw_points() const;

  uint32_t particle_count_ = 0;
  glm::vec3 origin_m_{0.0f};
  float voxel_m_ = 1.0f;
  std::vector<Particle> particle_;  // as made
  std::vector<float> state_;        // (6 x particles)
  gl::Buffer particles_;
  gl::Buffer sums_;
  gl::Buffer states_;
  gl::Texture texture_;
  gl::Framebuffer framebuffer_;
  gl::VertexArray no_attributes_;
  gl::Program naive_densities_;
  gl::Program naive_friction_;
  gl::Program points_;
  gl::Program friction_;
};

}  // namespace strandcast
