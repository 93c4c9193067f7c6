#include <algorithm>

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/direct_rod/direct_rod_rest.h"
#include "server/sim/solvers/direct_rod/direct_rod_style.h"

namespace strandcast {
namespace {

constexpr uint32_t kStrandPlanes = 4;         // of u_strand
constexpr double kLongestM = 1e12;            // an edge beyond has no direction
constexpr uint32_t kScratchRows[] = {7, 11};  // in shaders/sim/direct_rod_band.glsl without and with twist

StrandParameters shared_parameters(const RodParameters& parameters) {
  StrandParameters shared;
  shared.air_drag_per_s = parameters.air_drag_per_s;
  shared.collider_friction = parameters.collider_friction;
  shared.max_speed_mps = parameters.max_speed_mps;
  return shared;
}

/// Rest direction of an edge in the frame before it, of a joint tangent half way.
glm::dvec3 rest_direction(const glm::dvec3& joint_tangent) {
  return 2.0 * joint_tangent.z * joint_tangent - glm::dvec3(0.0, 0.0, 1.0);
}

class DirectRod final : public KernelSolver {
 public:
  DirectRod(const RodParameters& parameters, const SolverContext& context)
      : KernelSolver(context, shared_parameters(parameters)),
        parameters_(parameters),
        known_gravity_in_head_mps2_(limited(context.groom_gravity_in_head_mps2, kMaxGravityMps2)) {}

 private:
  void prepare() override {
    groom_gravity_in_head_mps2_ = known_gravity_in_head_mps2_;
    rest_shape_ = make_rest_arrays();
    // Under weight that is known later even a straight rod has a bent rest shape.
    const bool can_twist = parameters_.twist_stiffness_m4ps2 > 0.0;
    const bool is_bent = parameters_.sag_free > 0.0 || rest_shape_.most_turn_rad > kStraightTurnRad;
    has_twist_ = can_twist && is_bent;
    make_planes();
  }

  KernelDesc kernel() const override {
    KernelDesc desc;
    desc.shader_path = "sim/direct_rod.comp";
    desc.variant = {{"HAS_PINNED_TAIL", layout().pinned_tail_count > 0 ? 1 : 0},
                    {"HAS_TWIST", has_twist_ ? 1 : 0}};
    desc.constants = {{"u_tip_length", parameters_.tip_length_m},
                      {"u_spin_inertia", parameters_.spin_inertia_m2},
                      {"u_bending_damping", parameters_.bending_damping_s},
                      {"u_solves", parameters_.solves},
                      {"u_order", parameters_.order}};
    desc.scratch_rows = kScratchRows[has_twist_ ? 1 : 0];
    return desc;
  }

  void begin() override {
    write_rest();
    if (!state().is_at_rest()) forget(std::vector<bool>(layout().strand_count, true));
  }

  void adapt(const StepInput& input) override {
    const glm::dvec3 groom_gravity = limited(input.groom_gravity_in_head_mps2, kMaxGravityMps2);
    if (parameters_.sag_free <= 0.0 || groom_gravity == groom_gravity_in_head_mps2_) return;
    groom_gravity_in_head_mps2_ = groom_gravity;
    rest_shape_ = make_rest_arrays();
    write_rest();
  }

  void bind(BoundPlanes& planes) const override {
    plane_of(planes, PlaneRole::Displacement) = displacement_.get();
    plane_of(planes, PlaneRole::VelocityChange) = velocity_change_.get();
    plane_of(planes, PlaneRole::RodEdge) = edge_.get();
    plane_of(planes, PlaneRole::RodStrand) = strand_.get();
    plane_of(planes, PlaneRole::RodAxis) = axis_.get();
  }

  // Without tension, history or twist.
  void forget(const std::vector<bool>& is_changed) override {
    const bool is_any = std::count(is_changed.begin(), is_changed.end(), true) > 0;
    if (has_twist_ && is_any) untwist(is_changed);
  }

  // Its history is of the way that strands really went; velocity changes are without impulses.
  CarriedPlanes carried() const override { return {displacement_.get(), axis_.get()}; }

  void turn_memory(const glm::dquat& turn) override {
    turn_plane(*displacement_, turn);
    turn_plane(*velocity_change_, turn);
    if (has_twist_) turn_plane(*axis_, turn);
  }

  uint64_t model_bytes() const override {
    uint64_t bytes = 0;
    for (const auto* plane : {&edge_, &strand_, &axis_, &displacement_, &velocity_change_})
      if (*plane) bytes += (*plane)->size_bytes();
    return bytes;
  }

  /// The rest shape of all strands as the kernel takes it.
  struct RestArrays {
    std::vector<glm::vec4> edge;       // joint tangents; length, m
    std::vector<glm::vec4> strand;     // planes of u_strand
    std::vector<glm::vec4> axis;       // of the edges, world
    std::vector<float> tension_m2ps2;  // to start with
    double most_turn_rad = 0.0;
  };

  RestArrays make_rest_arrays() const {
    const size_t size = layout().size();
    const uint32_t strand_count = layout().strand_count;
    RestArrays arrays;
    arrays.edge.resize(size);
    arrays.strand.resize(size_t{kStrandPlanes} * strand_count);
    arrays.axis.resize(size);
    arrays.tension_m2ps2.assign(size, 0.0f);
    const auto fit = fit_rod_style(layout(), parameters_, groom_gravity_in_head_mps2_);
    for (uint32_t s = 0; s < strand_count; ++s) {
      const RodShape shape = make_rod_shape(layout(), s, parameters_, groom_gravity_in_head_mps2_);
      const RodRest rest = make_rod_rest(shape, parameters_, static_cast<double>(fit->stiffening[s]));
      arrays.most_turn_rad = std::max(arrays.most_turn_rad, rest.turn_rad);
      arrays.strand[s] = glm::vec4(glm::dvec4(rest.clamp_direction, rest.mean_segment_m));
      arrays.strand[strand_count + s] = glm::vec4(glm::dvec4(rest.clamp_axis, rest.shortest_m));
      const RodParameters rod = stiffened(parameters_, rest.stiffening);
      arrays.strand[2 * strand_count + s] = glm::vec4(glm::dvec4(rest.tail_direction, rod.stiffness_m4ps2));
      arrays.strand[3 * strand_count + s] = glm::vec4(glm::dvec4(rest.tail_axis, rod.twist_stiffness_m4ps2));
      for (uint32_t i = 0; i < layout().vertex_count; ++i) {
        const size_t at = layout().index(i, s);
        const bool is_clamp = i == layout().pinned_root_count || i > shape.tail_begin;
        const glm::dvec3 tangent = is_clamp ? glm::dvec3(0.0, 0.0, 1.0) : rest.joint_tangent[i];
        arrays.edge[at] = glm::vec4(glm::dvec4(tangent, rest.segment_m[i]));
        arrays.axis[at] = glm::vec4(glm::dvec4(state().head().world_from_head_rotation * rest.axis[i], 0.0));
        if (i > 0) arrays.tension_m2ps2[at] = static_cast<float>(rest.tension_m2ps2[i]);
      }
    }
    return arrays;
  }

  void make_planes() {
    const std::vector<glm::vec4> zero(layout().size(), glm::vec4(0.0f));
    edge_ = make_plane("direct_rod edge", rest_shape_.edge);
    strand_ = make_plane("direct_rod strand", rest_shape_.strand);
    // A kernel without twist knows no axes.
    axis_ = has_twist_ ? make_plane("direct_rod axis", rest_shape_.axis) : nullptr;
    displacement_ = make_plane("direct_rod displacement", zero);
    velocity_change_ = make_plane("direct_rod velocity change", zero);
  }

  /// What has not moved yet also starts with the tensions and frames of the rest shape.
  void write_rest() {
    if (!has_twist_) {
      for (glm::vec4& edge : rest_shape_.edge)
        edge = glm::vec4(glm::vec3(rest_direction(glm::dvec3(edge))), edge.w);
    }
    edge_->write(rest_shape_.edge);
    strand_->write(rest_shape_.strand);
    if (state().is_at_rest()) {
      state().write_model(rest_shape_.tension_m2ps2);
      if (has_twist_) axis_->write(rest_shape_.axis);
    }
    rest_shape_ = {};
  }

  /// Frames without twist for the strands that were written.
  void untwist(const std::vector<bool>& is_changed) {
    SolverState moved;
    state().read(moved);
    std::vector<glm::vec4> edge, strand, axes;
    edge_->read(edge);
    strand_->read(strand);
    axis_->read(axes);
    for (uint32_t s = 0; s < layout().strand_count; ++s) {
      if (!is_changed[s]) continue;
      glm::dvec3 before = state().head().world_from_head_rotation * glm::dvec3(strand[s]);
      glm::dvec3 axis =
          state().head().world_from_head_rotation * glm::dvec3(strand[layout().strand_count + s]);
      for (uint32_t i = layout().pinned_root_count; i < layout().vertex_count; ++i) {
        const size_t at = layout().index(i, s);
        const glm::dvec3 way =
            glm::dvec3(moved.position_m[at]) - glm::dvec3(moved.position_m[layout().index(i - 1, s)]);
        const double length = glm::length(way);
        const bool has_direction = edge[at].w > strand[layout().strand_count + s].w && length > 0.0;
        const glm::dvec3 direction = has_direction && length < kLongestM ? way / length : before;
        axis = untwisted_axis(axis, before, direction, glm::dvec3(edge[at]));
        axes[at] = glm::vec4(glm::dvec4(axis, 0.0));
        before = direction;
      }
    }
    axis_->write(axes);
  }

  RodParameters parameters_;
  bool has_twist_ = false;
  glm::dvec3 known_gravity_in_head_mps2_;       // before any step tells
  glm::dvec3 groom_gravity_in_head_mps2_{0.0};  // under which the rest shape was found
  RestArrays rest_shape_;                       // on its way to the planes
  // (vertex_count x strand_count) joint in the frame before it; length, m
  std::unique_ptr<StrandPlane> edge_;
  // (kStrandPlanes x strand_count) clamps at root and tip, stiffness
  std::unique_ptr<StrandPlane> strand_;
  // (vertex_count x strand_count) material axis, world; spin in the last step, rad. With twist only
  std::unique_ptr<StrandPlane> axis_;
  std::unique_ptr<StrandPlane> displacement_;     // (vertex_count x strand_count) world, m, in the last step
  std::unique_ptr<StrandPlane> velocity_change_;  // (vertex_count x strand_count) world, m/s, likewise
};

}  // namespace

Result<std::unique_ptr<Solver>> make_direct_rod(const SolverParameters& parameters,
                                                const SolverContext& context) {
  return std::unique_ptr<Solver>(std::make_unique<DirectRod>(read_rod_parameters(parameters), context));
}

}  // namespace strandcast
