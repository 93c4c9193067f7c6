#include "tests/bench/peers/naive_strands.h"

#include <epoxy/gl.h>

#include "common/base/profile.h"
#include "common/gl/device_limits.h"

namespace strandcast {
namespace {

/// As in naive.glsl.
struct Particle {
  glm::vec4 position;   // m; w = segment before it, m
  glm::vec4 predicted;  // m; w = 1 when pinned
  glm::vec4 velocity;   // m/s
  glm::vec4 moved;      // by the constraints, m
};
constexpr size_t kBytesPerParticle = 64;  // 123,904 bytes for 242 x 8: Woodhouse 2017, 5.1
static_assert(sizeof(Particle) == kBytesPerParticle);

}  // namespace

Result<NaiveStrands> NaiveStrands::make(const Groom& groom, const StrandParameters& parameters,
                                        const gl::ShaderLibrary& shaders) {
  RETURN_IF_ERROR(gl::check_device_limit(gl::read_device_limits(), gl::DeviceLimit::GroupCount,
                                         groom.rest_position_m.size(), "a solver with a group per particle"));
  NaiveStrands strands;
  strands.strand_count_ = groom.strand_count();
  strands.vertex_count_ = groom.uniform_vertex_count();
  strands.parameters_ = parameters;
  std::vector<Particle> particles;
  for (size_t i = 0; i < groom.rest_position_m.size(); ++i) {
    const glm::vec3 point = groom.rest_position_m[i];
    const bool is_root = i % strands.vertex_count_ == 0;
    const float segment_m = is_root ? 0.0f : glm::distance(point, groom.rest_position_m[i - 1]);
    particles.push_back({glm::vec4(point, segment_m), glm::vec4(point, groom.pinned[i] != 0 ? 1.0f : 0.0f),
                         glm::vec4(0.0f), glm::vec4(0.0f)});
  }
  strands.particles_ = gl::Buffer::of("naive particles", particles);
  const char* paths[] = {"naive_predict.comp", "naive_follow.comp", "naive_velocity.comp"};
  for (size_t i = 0; i < strands.programs_.size(); ++i) {
    ASSIGN_OR_RETURN(strands.programs_[i], gl::Program::make(shaders, {paths[i]}, {}));
  }
  return strands;
}

std::array<double, NaiveStrands::kStages.size()> NaiveStrands::step_ms(double h_s) {
  std::array<double, kStages.size()> times_ms{};
  particles_.bind_storage(0);
  const uint32_t groups[] = {strand_count_ * vertex_count_, strand_count_, strand_count_ * vertex_count_};
  for (size_t stage = 0; stage < kStages.size(); ++stage) {
    const gl::Program& program = programs_[stage];
    program.set("u_h", static_cast<float>(h_s));
    program.set("u_gravity", glm::vec3(0.0f, -9.81f, 0.0f));
    program.set("u_drag", static_cast<float>(parameters_.air_drag_per_s));
    program.set("u_s_damping", static_cast<float>(parameters_.s_damping));
    program.set("u_vertices", vertex_count_);
    glFinish();
    const int64_t begin_ns = now_ns();
    program.use();
    glDispatchCompute(groups[stage], 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    glFinish();
    times_ms[stage] = static_cast<double>(now_ns() - begin_ns) * 1e-6;
  }
  return times_ms;
}

std::vector<glm::vec3> NaiveStrands::positions_m() const {
  const auto particles = particles_.read_all<Particle>();
  std::vector<glm::vec3> positions;
  for (uint32_t vertex = 0; vertex < vertex_count_; ++vertex)
    for (uint32_t strand = 0; strand < strand_count_; ++strand)
      positions.emplace_back(particles[strand * vertex_count_ + vertex].position);
  return positions;
}

}  // namespace strandcast
