#include <epoxy/gl.h>

#include <algorithm>
#include <span>
#include <string_view>

#include "common/base/check.h"
#include "common/gl/objects.h"
#include "server/sim/solvers/direct_rod/direct_rod_rest.h"
#include "server/sim/step_block.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

// Values of the variant COLLIDERS in shaders/sim/follow.glsl besides 0.
constexpr uint32_t kColliderCapacities[] = {1, 4, kMaxSphereColliders};
// Planes of the scratch buffer in shaders/sim/direct_rod.comp, and how much of it is worth having: strands
// that do not fit wait for the next dispatch. A software device finds on the way back what still fits its
// caches; hardware wants all strands at once.
constexpr size_t kScratchPlanes = 7;
constexpr size_t kCachedScratchBytes = size_t{2} << 20;
constexpr size_t kMaxScratchBytes = size_t{64} << 20;

size_t worthwhile_scratch_bytes() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  const bool is_software =
      renderer != nullptr && std::string_view(renderer).find("llvmpipe") != std::string_view::npos;
  return is_software ? kCachedScratchBytes : kMaxScratchBytes;
}

/// A buffer of vec4 with a buffer texture over all of it: what a kernel writes and fetches.
struct Plane {
  gl::Buffer buffer;
  gl::Handle<gl::delete_texture> view;
};

Plane make_plane(const std::string& label, const std::vector<glm::vec4>& values) {
  Plane plane;
  plane.buffer = gl::Buffer::of(label, values);
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  glTextureBuffer(name, GL_RGBA32F, plane.buffer.name());
  glObjectLabel(GL_TEXTURE, name, -1, label.c_str());
  plane.view = gl::Handle<gl::delete_texture>(name);
  return plane;
}

class DirectRodGpu final : public Solver {
 public:
  DirectRodGpu(const RodParameters& parameters, const GpuSolverContext& context)
      : parameters_(parameters), features_(context.features), shaders_(*context.shaders) {}

  Status compile(bool has_pinned_tail) {
    programs_.clear();
    std::vector<uint32_t> capacities = {0};
    if (features_.has_colliders)
      capacities.assign(std::begin(kColliderCapacities), std::end(kColliderCapacities));
    for (const uint32_t capacity : capacities) {
      const gl::Variant variant = {{"COLLIDERS", static_cast<int>(capacity)},
                                   {"HAS_TURBULENCE", features_.has_turbulence ? 1 : 0},
                                   {"HAS_PINNED_TAIL", has_pinned_tail ? 1 : 0}};
      ASSIGN_OR_RETURN(gl::Program program, gl::Program::make(shaders_, {"sim/direct_rod.comp"}, variant));
      program.set("u_stiffness", static_cast<float>(parameters_.stiffness_m4ps2));
      program.set("u_bending_damping", static_cast<float>(parameters_.bending_damping_s));
      program.set("u_solves", parameters_.solves);
      program.set("u_order", parameters_.order);
      programs_[capacity] = std::move(program);
    }
    is_compiled_for_tail_ = has_pinned_tail;
    return {};
  }

  Status load(const Groom& groom, const glm::dquat& world_from_head) override {
    ASSIGN_OR_RETURN(StrandLayout layout, make_strand_layout(groom));
    GLint most_texels = 0;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most_texels);
    if (layout.size() > static_cast<size_t>(std::max(most_texels, 0))) {
      return make_error(ErrorCode::Unsupported,
                        "{} strands x {} vertices do not fit the device ({} vertices at most)",
                        layout.strand_count, layout.vertex_count, most_texels);
    }
    const bool has_pinned_tail = layout.pinned_tail_count > 0;
    if (programs_.empty() || has_pinned_tail != is_compiled_for_tail_)
      RETURN_IF_ERROR(compile(has_pinned_tail));
    previous_rotation_ = limited_rotation(world_from_head);
    upload(layout);
    layout.rest = {};
    layout.arc = {};
    layout_ = std::move(layout);
    return {};
  }

  void substep(const StepInput& input) override {
    StrandParameters shared;
    shared.air_drag_per_s = parameters_.air_drag_per_s;
    shared.collider_friction = parameters_.collider_friction;
    shared.max_speed_mps = parameters_.max_speed_mps;
    const StepBlock block = make_step_block(input, shared, layout_, previous_rotation_);
    step_.write(0, std::as_bytes(std::span(&block, 1)));
    previous_rotation_ = limited_rotation(input.world_from_head);

    step_.bind_uniform(shader::kBindingStep);
    position_.buffer.bind_storage(shader::kBindingPosition);
    velocity_.buffer.bind_storage(shader::kBindingVelocity);
    displacement_.buffer.bind_storage(shader::kBindingDisplacement);
    velocity_change_.buffer.bind_storage(shader::kBindingVelocityChange);
    scratch_.bind_storage(shader::kBindingRodScratch);
    glBindTextureUnit(shader::kUnitRest, rest_.view.name());
    glBindTextureUnit(shader::kUnitPosition, position_.view.name());
    glBindTextureUnit(shader::kUnitVelocity, velocity_.view.name());
    glBindTextureUnit(shader::kUnitDisplacement, displacement_.view.name());
    glBindTextureUnit(shader::kUnitVelocityChange, velocity_change_.view.name());
    glBindTextureUnit(shader::kUnitRodEdge, edge_.view.name());
    glBindTextureUnit(shader::kUnitRodStrand, strand_.view.name());
    const gl::Program& program = program_for(input.colliders.size());
    program.use();
    for (uint32_t begin = 0; begin < layout_.strand_count; begin += batch_) {
      const uint32_t end = std::min(begin + batch_, layout_.strand_count);
      program.set("u_strand_begin", begin);
      program.set("u_strand_end", end);
      glDispatchCompute((end - begin + shader::kStrandLocalSize - 1) / shader::kStrandLocalSize, 1, 1);
      // The next dispatch uses the same scratch, the next substep fetches the state, read() copies it.
      glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                      GL_BUFFER_UPDATE_BARRIER_BIT);
    }
  }

  void read(SolverState& state) override {
    const auto copy_out = [this](const gl::Buffer& buffer, std::vector<glm::vec3>& values) {
      buffer.read(0, std::as_writable_bytes(std::span(staging_)));
      values.resize(staging_.size());
      std::transform(staging_.begin(), staging_.end(), values.begin(),
                     [](const glm::vec4& v) { return glm::vec3(v); });
    };
    copy_out(position_.buffer, state.position_m);
    copy_out(velocity_.buffer, state.velocity_mps);
  }

  // A strand that is written as it was read goes on as if nothing had happened; another one starts anew,
  // without tension or history.
  void write(const SolverState& state) override {
    CHECK(state.position_m.size() == staging_.size() && state.velocity_mps.size() == staging_.size());
    std::vector<bool> is_changed(layout_.strand_count, false);
    position_.buffer.read(0, std::as_writable_bytes(std::span(staging_)));
    for (size_t i = 0; i < staging_.size(); ++i) {
      if (glm::vec3(staging_[i]) != state.position_m[i]) is_changed[i % layout_.strand_count] = true;
      staging_[i] = glm::vec4(state.position_m[i], 0.0f);
    }
    position_.buffer.write(staging_);
    velocity_.buffer.read(0, std::as_writable_bytes(std::span(staging_)));
    for (size_t i = 0; i < staging_.size(); ++i) {
      if (glm::vec3(staging_[i]) != state.velocity_mps[i]) is_changed[i % layout_.strand_count] = true;
    }
    for (size_t i = 0; i < staging_.size(); ++i) {
      const float kept = is_changed[i % layout_.strand_count] ? 0.0f : staging_[i].w;
      staging_[i] = glm::vec4(state.velocity_mps[i], kept);
    }
    velocity_.buffer.write(staging_);
  }

  uint64_t memory_bytes() const override {
    return position_.buffer.size_bytes() + velocity_.buffer.size_bytes() + displacement_.buffer.size_bytes() +
           velocity_change_.buffer.size_bytes() + rest_.buffer.size_bytes() + edge_.buffer.size_bytes() +
           strand_.buffer.size_bytes() + scratch_.size_bytes() + step_.size_bytes();
  }

 private:
  void upload(const StrandLayout& layout) {
    const glm::dvec3 gravity_in_head =
        glm::conjugate(previous_rotation_) * glm::dvec3(0.0, -kStandardGravityMps2, 0.0);
    const uint32_t strand_count = layout.strand_count;
    std::vector<glm::vec4> edge(layout.size());
    std::vector<glm::vec4> strand(size_t{2} * strand_count);
    std::vector<glm::vec4> velocity(layout.size(), glm::vec4(0.0f));
    staging_.assign(layout.size(), glm::vec4(0.0f));
    for (uint32_t s = 0; s < strand_count; ++s) {
      const RodRest rest = make_rod_rest(layout, s, parameters_, gravity_in_head);
      strand[s] = glm::vec4(glm::dvec4(rest.clamp_direction, rest.mean_segment_m));
      strand[strand_count + s] = glm::vec4(glm::dvec4(rest.frame_axis, 0.0));
      for (uint32_t i = 0; i < layout.vertex_count; ++i) {
        const size_t at = layout.index(i, s);
        edge[at] = glm::vec4(glm::dvec4(rest.rest_direction[i], rest.segment_m[i]));
        velocity[at].w = i == 0 ? 0.0f : static_cast<float>(rest.tension_m2ps2[i]);
        staging_[at] = glm::vec4(glm::vec3(previous_rotation_ * glm::dvec3(layout.rest[at])), 0.0f);
      }
    }
    rest_ = make_plane("direct_rod rest", layout.rest);
    edge_ = make_plane("direct_rod edge", edge);
    strand_ = make_plane("direct_rod strand", strand);
    position_ = make_plane("direct_rod position", staging_);
    velocity_ = make_plane("direct_rod velocity", velocity);
    std::fill(velocity.begin(), velocity.end(), glm::vec4(0.0f));
    displacement_ = make_plane("direct_rod displacement", velocity);
    velocity_change_ = make_plane("direct_rod velocity change", velocity);
    const size_t bytes_per_strand = kScratchPlanes * sizeof(glm::vec4) * layout.vertex_count;
    const size_t fitting = std::max<size_t>(
        worthwhile_scratch_bytes() / bytes_per_strand / shader::kStrandLocalSize * shader::kStrandLocalSize,
        shader::kStrandLocalSize);
    batch_ = static_cast<uint32_t>(std::min<size_t>(fitting, strand_count));
    scratch_ = gl::Buffer("direct_rod scratch", bytes_per_strand * batch_);
    step_ = gl::Buffer("direct_rod step", sizeof(StepBlock));
  }

  const gl::Program& program_for(size_t collider_count) const {
    const auto fitting =
        programs_.lower_bound(static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders)));
    return fitting == programs_.end() ? programs_.rbegin()->second : fitting->second;
  }

  RodParameters parameters_;
  SceneFeatures features_;
  gl::ShaderLibrary shaders_;
  std::map<uint32_t, gl::Program> programs_;  // by how many colliders they can hold
  bool is_compiled_for_tail_ = false;

  StrandLayout layout_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
  uint32_t batch_ = 0;     // strands per dispatch
  Plane rest_;             // (vertex_count x strand_count) head space, m; segment before it, m
  Plane edge_;             // (vertex_count x strand_count) rest direction in the frame before; length, m
  Plane strand_;           // (2 x strand_count) clamp direction, mean length, m; frame axis
  Plane position_;         // (vertex_count x strand_count) head-relative world, m
  Plane velocity_;         // (vertex_count x strand_count) world, m/s; tension, m^2/s^2, or history step, s
  Plane displacement_;     // (vertex_count x strand_count) world, m, during the last step
  Plane velocity_change_;  // (vertex_count x strand_count) world, m/s, during the last step
  gl::Buffer scratch_;     // (vertex_count x kScratchPlanes x batch) vec4
  gl::Buffer step_;        // StepBlock
  std::vector<glm::vec4> staging_;
};

}  // namespace

Result<std::unique_ptr<Solver>> make_direct_rod_gpu(const SolverParameters& parameters,
                                                    const GpuSolverContext& context) {
  CHECK(context.shaders != nullptr);
  auto solver = std::make_unique<DirectRodGpu>(read_rod_parameters(parameters), context);
  RETURN_IF_ERROR(solver->compile(false));
  return std::unique_ptr<Solver>(std::move(solver));
}

}  // namespace strandcast
