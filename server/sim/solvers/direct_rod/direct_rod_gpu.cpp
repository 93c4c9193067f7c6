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
// Planes of the scratch buffer in shaders/sim/direct_rod_band.glsl without and with twist, and how much of it
// is worth having: strands that do not fit wait for the next dispatch. A software device finds on the way
// back what still fits its caches; hardware wants all strands at once.
constexpr uint32_t kStrandPlanes = 4;  // of u_strand
constexpr double kLongestM = 1e12;     // an edge beyond has no direction
constexpr size_t kScratchPlanes[] = {7, 11};
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

/// What the kernel is compiled for besides the scene's features.
struct RodVariant {
  bool has_pinned_tail = false;
  bool has_twist = false;
  bool operator==(const RodVariant&) const = default;
};

/// Rest direction of an edge in the frame before it, of a joint tangent half way.
glm::dvec3 rest_direction(const glm::dvec3& joint_tangent) {
  return 2.0 * joint_tangent.z * joint_tangent - glm::dvec3(0.0, 0.0, 1.0);
}

class DirectRodGpu final : public Solver {
 public:
  DirectRodGpu(const RodParameters& parameters, const GpuSolverContext& context)
      : parameters_(parameters), features_(context.features), shaders_(*context.shaders) {}

  Status compile(const RodVariant& wanted) {
    programs_.clear();
    std::vector<uint32_t> capacities = {0};
    if (features_.has_colliders)
      capacities.assign(std::begin(kColliderCapacities), std::end(kColliderCapacities));
    for (const uint32_t capacity : capacities) {
      const gl::Variant variant = {{"COLLIDERS", static_cast<int>(capacity)},
                                   {"HAS_TURBULENCE", features_.has_turbulence ? 1 : 0},
                                   {"HAS_PINNED_TAIL", wanted.has_pinned_tail ? 1 : 0},
                                   {"HAS_TWIST", wanted.has_twist ? 1 : 0}};
      ASSIGN_OR_RETURN(gl::Program program, gl::Program::make(shaders_, {"sim/direct_rod.comp"}, variant));
      program.set("u_stiffness", static_cast<float>(parameters_.stiffness_m4ps2));
      program.set("u_tip_length", static_cast<float>(parameters_.tip_length_m));
      if (wanted.has_twist) {
        program.set("u_twist_stiffness", static_cast<float>(parameters_.twist_stiffness_m4ps2));
        program.set("u_spin_inertia", static_cast<float>(parameters_.spin_inertia_m2));
      }
      program.set("u_bending_damping", static_cast<float>(parameters_.bending_damping_s));
      program.set("u_solves", parameters_.solves);
      program.set("u_order", parameters_.order);
      programs_[capacity] = std::move(program);
    }
    variant_ = wanted;
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
    layout_ = std::move(layout);
    previous_rotation_ = limited_rotation(world_from_head);
    groom_gravity_in_head_mps2_ = glm::dvec3(0.0);
    is_untouched_ = true;
    const RestArrays rest = make_rest_arrays();
    // Under weight that is known later even a straight rod has a bent rest shape.
    const bool can_twist = parameters_.twist_stiffness_m4ps2 > 0.0;
    const bool is_bent = parameters_.sag_free > 0.0 || rest.most_turn_rad > kStraightTurnRad;
    const RodVariant wanted = {layout_.pinned_tail_count > 0, can_twist && is_bent};
    if (programs_.empty() || wanted != variant_) RETURN_IF_ERROR(compile(wanted));
    make_buffers(rest);
    if (parameters_.sag_free <= 0.0) layout_.rest = {};
    layout_.arc = {};
    return {};
  }

  void substep(const StepInput& input) override {
    const glm::dvec3 groom_gravity = limited(input.groom_gravity_in_head_mps2, kMaxGravityMps2);
    if (parameters_.sag_free > 0.0 && groom_gravity != groom_gravity_in_head_mps2_) {
      groom_gravity_in_head_mps2_ = groom_gravity;
      write_rest(make_rest_arrays());
    }
    is_untouched_ = false;
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
    axis_.buffer.bind_storage(shader::kBindingRodAxis);
    glBindTextureUnit(shader::kUnitRest, rest_.view.name());
    glBindTextureUnit(shader::kUnitPosition, position_.view.name());
    glBindTextureUnit(shader::kUnitVelocity, velocity_.view.name());
    glBindTextureUnit(shader::kUnitDisplacement, displacement_.view.name());
    glBindTextureUnit(shader::kUnitVelocityChange, velocity_change_.view.name());
    glBindTextureUnit(shader::kUnitRodEdge, edge_.view.name());
    glBindTextureUnit(shader::kUnitRodStrand, strand_.view.name());
    glBindTextureUnit(shader::kUnitRodAxis, axis_.view.name());
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
    if (variant_.has_twist) untwist(is_changed, state);
    is_untouched_ = is_untouched_ && std::count(is_changed.begin(), is_changed.end(), true) == 0;
  }

  uint64_t memory_bytes() const override {
    return position_.buffer.size_bytes() + velocity_.buffer.size_bytes() + displacement_.buffer.size_bytes() +
           velocity_change_.buffer.size_bytes() + rest_.buffer.size_bytes() + edge_.buffer.size_bytes() +
           strand_.buffer.size_bytes() + axis_.buffer.size_bytes() + scratch_.size_bytes() +
           step_.size_bytes();
  }

 private:
  /// The rest shape of all strands as the kernel takes it.
  struct RestArrays {
    std::vector<glm::vec4> edge;     // joint tangents; length, m
    std::vector<glm::vec4> strand;   // planes of u_strand
    std::vector<glm::vec4> axis;     // of the edges, world
    std::vector<glm::vec4> tension;  // w, m^2/s^2
    double most_turn_rad = 0.0;
  };

  RestArrays make_rest_arrays() const {
    const size_t size = size_t{layout_.strand_count} * layout_.vertex_count;
    const uint32_t strand_count = layout_.strand_count;
    RestArrays arrays;
    arrays.edge.resize(size);
    arrays.strand.resize(size_t{kStrandPlanes} * strand_count);
    arrays.axis.resize(size);
    arrays.tension.assign(size, glm::vec4(0.0f));
    for (uint32_t s = 0; s < strand_count; ++s) {
      const RodRest rest = make_rod_rest(layout_, s, parameters_, groom_gravity_in_head_mps2_);
      arrays.most_turn_rad = std::max(arrays.most_turn_rad, rest.turn_rad);
      arrays.strand[s] = glm::vec4(glm::dvec4(rest.clamp_direction, rest.mean_segment_m));
      arrays.strand[strand_count + s] = glm::vec4(glm::dvec4(rest.clamp_axis, rest.shortest_m));
      arrays.strand[2 * strand_count + s] = glm::vec4(glm::dvec4(rest.tail_direction, 0.0));
      arrays.strand[3 * strand_count + s] = glm::vec4(glm::dvec4(rest.tail_axis, 0.0));
      for (uint32_t i = 0; i < layout_.vertex_count; ++i) {
        const size_t at = layout_.index(i, s);
        const bool is_clamp = i == layout_.pinned_root_count || i > layout_.tail_begin();
        const glm::dvec3 tangent = is_clamp ? glm::dvec3(0.0, 0.0, 1.0) : rest.joint_tangent[i];
        arrays.edge[at] = glm::vec4(glm::dvec4(tangent, rest.segment_m[i]));
        arrays.axis[at] = glm::vec4(glm::dvec4(previous_rotation_ * rest.axis[i], 0.0));
        if (i > 0) arrays.tension[at].w = static_cast<float>(rest.tension_m2ps2[i]);
      }
    }
    return arrays;
  }

  void make_buffers(const RestArrays& rest) {
    const std::vector<glm::vec4> zero(layout_.rest.size(), glm::vec4(0.0f));
    staging_ = layout_.rest;
    for (glm::vec4& point : staging_)
      point = glm::vec4(glm::vec3(previous_rotation_ * glm::dvec3(point)), 0.0f);
    rest_ = make_plane("direct_rod rest", layout_.rest);
    edge_ = make_plane("direct_rod edge", rest.edge);
    strand_ = make_plane("direct_rod strand", rest.strand);
    // A kernel without twist knows no axes.
    axis_ = make_plane("direct_rod axis", variant_.has_twist ? rest.axis : std::vector<glm::vec4>(1));
    position_ = make_plane("direct_rod position", staging_);
    velocity_ = make_plane("direct_rod velocity", zero);
    displacement_ = make_plane("direct_rod displacement", zero);
    velocity_change_ = make_plane("direct_rod velocity change", zero);
    write_rest(rest);
    const size_t bytes_per_strand =
        kScratchPlanes[variant_.has_twist ? 1 : 0] * sizeof(glm::vec4) * layout_.vertex_count;
    const size_t fitting = std::max<size_t>(
        worthwhile_scratch_bytes() / bytes_per_strand / shader::kStrandLocalSize * shader::kStrandLocalSize,
        shader::kStrandLocalSize);
    batch_ = static_cast<uint32_t>(std::min<size_t>(fitting, layout_.strand_count));
    scratch_ = gl::Buffer("direct_rod scratch", bytes_per_strand * batch_);
    step_ = gl::Buffer("direct_rod step", sizeof(StepBlock));
  }

  /// What has not moved yet also starts with the tensions and frames of the rest shape.
  void write_rest(RestArrays rest) {
    if (!variant_.has_twist) {
      for (glm::vec4& edge : rest.edge) edge = glm::vec4(glm::vec3(rest_direction(glm::dvec3(edge))), edge.w);
    }
    edge_.buffer.write(rest.edge);
    strand_.buffer.write(rest.strand);
    if (!is_untouched_) return;
    velocity_.buffer.write(rest.tension);
    if (variant_.has_twist) axis_.buffer.write(rest.axis);
  }

  /// Frames without twist for the strands that were written.
  void untwist(const std::vector<bool>& is_changed, const SolverState& state) {
    const std::vector<glm::vec4> edge = edge_.buffer.read_all<glm::vec4>();
    const std::vector<glm::vec4> strand = strand_.buffer.read_all<glm::vec4>();
    std::vector<glm::vec4> axes = axis_.buffer.read_all<glm::vec4>();
    for (uint32_t s = 0; s < layout_.strand_count; ++s) {
      if (!is_changed[s]) continue;
      glm::dvec3 before = previous_rotation_ * glm::dvec3(strand[s]);
      glm::dvec3 axis = previous_rotation_ * glm::dvec3(strand[layout_.strand_count + s]);
      for (uint32_t i = layout_.pinned_root_count; i < layout_.vertex_count; ++i) {
        const size_t at = layout_.index(i, s);
        const glm::dvec3 way =
            glm::dvec3(state.position_m[at]) - glm::dvec3(state.position_m[layout_.index(i - 1, s)]);
        const double length = glm::length(way);
        const bool has_direction = edge[at].w > strand[layout_.strand_count + s].w && length > 0.0;
        const glm::dvec3 direction = has_direction && length < kLongestM ? way / length : before;
        axis = untwisted_axis(axis, before, direction, glm::dvec3(edge[at]));
        axes[at] = glm::vec4(glm::dvec4(axis, 0.0));
        before = direction;
      }
    }
    axis_.buffer.write(axes);
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
  RodVariant variant_;
  glm::dvec3 groom_gravity_in_head_mps2_{0.0};  // under which the rest shape was found
  bool is_untouched_ = true;                    // as loaded

  StrandLayout layout_;
  glm::dquat previous_rotation_{1.0, 0.0, 0.0, 0.0};
  uint32_t batch_ = 0;     // strands per dispatch
  Plane rest_;             // (vertex_count x strand_count) head space, m; segment before it, m
  Plane edge_;             // (vertex_count x strand_count) joint in the frame before it; length, m
  Plane strand_;           // (kStrandPlanes x strand_count) clamps at root and tip
  Plane axis_;             // (vertex_count x strand_count) material axis, world; spin in the last step, rad
  Plane position_;         // (vertex_count x strand_count) head-relative world, m
  Plane velocity_;         // (vertex_count x strand_count) world, m/s; tension, m^2/s^2, or history step, s
  Plane displacement_;     // (vertex_count x strand_count) world, m, during the last step
  Plane velocity_change_;  // (vertex_count x strand_count) world, m/s, during the last step
  gl::Buffer scratch_;     // (vertex_count x planes x batch) vec4
  gl::Buffer step_;        // StepBlock
  std::vector<glm::vec4> staging_;
};

}  // namespace

Result<std::unique_ptr<Solver>> make_direct_rod_gpu(const SolverParameters& parameters,
                                                    const GpuSolverContext& context) {
  CHECK(context.shaders != nullptr);
  auto solver = std::make_unique<DirectRodGpu>(read_rod_parameters(parameters), context);
  RETURN_IF_ERROR(solver->compile({}));
  return std::unique_ptr<Solver>(std::move(solver));
}

}  // namespace strandcast
