#include "server/sim/solvers/super_helix/super_helix.h"

#include <algorithm>
#include <cmath>

#include "server/sim/chain_parameters.h"
#include "server/sim/reference_contact.h"
#include "server/sim/reference_strands.h"
#include "server/sim/solvers/super_helix/helix_shape.h"

namespace strandcast {
namespace {

constexpr const char* kEffortName = "elements";
constexpr uint32_t kMostSteps = 12;
// A pinned tip, and the inside of a collider, hold a vertex so many times as hard as its inertia does: at 60
// Hz its own weight sinks in by 3e-6 m.
constexpr double kAnchorShare = 1e4;
constexpr double kContactShare = 1e3;
constexpr double kMinDistanceM = 1e-9;

class SuperHelixReference final : public ReferenceStrands {
 public:
  explicit SuperHelixReference(const SolverParameters& parameters)
      : ReferenceStrands(read_strand_parameters(parameters)),
        parameters_(read_chain_parameters(parameters, kEffortName)),
        friction_(parameters.at("collider_friction")) {}

 private:
  bool has_free_vertices() const { return layout().tail_begin() > layout().pinned_root_count; }
  uint32_t clamp_vertex() const { return layout().pinned_root_count - 1; }

  /// Change of every element's curvatures against the natural ones.
  size_t memory_size() const override {
    return has_free_vertices() ? 3 * std::min(parameters_.effort, layout().vertex_count - 1 - clamp_vertex())
                               : 0;
  }

  void prepare() override {
    lines_.clear();
    if (!has_free_vertices()) return;
    std::vector<glm::dvec3> points;
    for (uint32_t s = 0; s < layout().strand_count; ++s) {
      points.clear();
      for (uint32_t i = clamp_vertex(); i < layout().vertex_count; ++i)
        points.emplace_back(layout().rest[layout().index(i, s)]);
      lines_.push_back(make_helix_line(points, parameters_.effort));
    }
  }

  void solve(ReferenceStrand& strand) const override {
    if (!has_free_vertices()) return;
    const HelixLine& line = lines_[strand.index];
    std::vector<double> grip(line.edge_m.size(), 0.0);
    const HelixProblem problem = make_problem(strand, line, grip);
    std::vector<glm::dvec3> q(line.natural);
    for (size_t i = 0; i < strand.memory.size(); ++i) q[i / 3][static_cast<int>(i % 3)] += strand.memory[i];
    settle_helix(problem, q);
    HelixShape shape = make_helix_shape(line, q, problem.root_m, problem.clamp);
    // Friction of what was found to press against the colliders.
    if (friction_ > 0.0 && find_grip(line, shape, grip)) {
      settle_helix(problem, q);
      shape = make_helix_shape(line, q, problem.root_m, problem.clamp);
    }
    const bool is_sound = std::all_of(shape.vertex_m.begin(), shape.vertex_m.end(),
                                      [](const glm::dvec3& x) { return std::isfinite(glm::dot(x, x)); });
    for (size_t i = 0; i < strand.memory.size(); ++i) {
      const int c = static_cast<int>(i % 3);
      strand.memory[i] = is_sound ? q[i / 3][c] - line.natural[i / 3][c] : 0.0;
    }
    for (uint32_t i = layout().pinned_root_count; i < layout().tail_begin(); ++i)
      strand.placed_m[i] = is_sound ? shape.vertex_m[i - 1 - clamp_vertex()] : strand.target_m[i];
  }

  HelixProblem make_problem(const ReferenceStrand& strand, const HelixLine& line,
                            const std::vector<double>& grip) const {
    HelixProblem problem;
    problem.line = &line;
    problem.root_m = strand.target_m[clamp_vertex()];
    problem.clamp = rotation() * line.clamp;
    problem.most_steps = kMostSteps;
    // Damping: the moment leads by a time, which pulls the curvatures to what they were.
    const double h2 = h_s() * h_s();
    const double rate = parameters_.damping_s / h_s();
    const glm::dvec3 stiffness(parameters_.bend_stiffness_m4ps2, parameters_.bend_stiffness_m4ps2,
                               parameters_.twist_stiffness_m4ps2);
    for (size_t e = 0; e < line.element_m.size(); ++e) {
      const glm::dvec3 change(strand.memory[3 * e], strand.memory[3 * e + 1], strand.memory[3 * e + 2]);
      problem.elastic.stiffness.push_back(h2 * (1.0 + rate) * line.element_m[e] * stiffness);
      problem.elastic.center.push_back(line.natural[e] + rate / (1.0 + rate) * change);
    }
    problem.energy = [this, &strand, &line, &grip](const HelixShape& shape,
                                                   std::vector<VertexEnergy>* derivatives) {
      return vertex_energy(strand, line, grip, shape, derivatives);
    };
    return problem;
  }

  double mass_m(const HelixLine& line, size_t k) const {
    return 0.5 * (line.edge_m[k] + (k + 1 < line.edge_m.size() ? line.edge_m[k + 1] : 0.0));
  }

  double vertex_energy(const ReferenceStrand& strand, const HelixLine& line, const std::vector<double>& grip,
                       const HelixShape& shape, std::vector<VertexEnergy>* derivatives) const {
    double energy = 0.0;
    for (size_t k = 0; k < shape.vertex_m.size(); ++k) {
      const uint32_t i = clamp_vertex() + 1 + static_cast<uint32_t>(k);
      const double mass = mass_m(line, k);
      const bool is_held = is_pinned(i);
      const double inertia = mass * (is_held ? kAnchorShare : strand.inertia[i]);
      const glm::dvec3 off = shape.vertex_m[k] - (is_held ? strand.target_m[i] : strand.predicted_m[i]);
      VertexEnergy at{inertia * off, glm::dmat3(inertia)};
      energy += 0.5 * inertia * glm::dot(off, off);
      if (!is_held) {
        energy += add_contacts(shape.vertex_m[k], kContactShare * mass, at);
        if (grip[k] > 0.0)
          energy +=
              add_friction(shape.vertex_m[k] - carry() * strand.old_m[i], grip[k], kContactShare * mass, at);
      }
      if (derivatives != nullptr) (*derivatives)[k] = at;
    }
    return energy;
  }

  double depth_m(size_t c, const glm::dvec3& x) const {
    const ReferenceSphere sphere = sphere_of(input(), c);
    return sphere.radius_m - glm::distance(x, sphere.center_m);
  }

  /// Every collider that the vertex is inside of pushes it out in proportion to the depth.
  double add_contacts(const glm::dvec3& x, double stiffness, VertexEnergy& at) const {
    double energy = 0.0;
    for (size_t c = 0; c < sphere_count(input()); ++c) {
      const double depth = depth_m(c, x);
      const glm::dvec3 outward = x - sphere_of(input(), c).center_m;
      const double distance = glm::length(outward);
      if (depth <= 0.0 || distance < kMinDistanceM) continue;
      const glm::dvec3 normal = outward / distance;
      energy += 0.5 * stiffness * depth * depth;
      at.gradient -= stiffness * depth * normal;
      at.stiffness += stiffness * glm::outerProduct(normal, normal);
    }
    return energy;
  }

  /// Sliding against the turning head is held like a spring up to the force `grip`, then by that force.
  static double add_friction(const glm::dvec3& slip, double grip, double stiffness, VertexEnergy& at) {
    const double way = glm::length(slip);
    const double bound = grip / stiffness;
    const double held = way > bound ? grip / way : stiffness;
    at.gradient += held * slip;
    at.stiffness += glm::dmat3(held);
    return way > bound ? grip * (way - 0.5 * bound) : 0.5 * stiffness * way * way;
  }

  /// Most that friction can hold at every vertex; false when nothing touches.
  bool find_grip(const HelixLine& line, const HelixShape& shape, std::vector<double>& grip) const {
    bool is_touching = false;
    for (size_t k = 0; k < grip.size(); ++k) {
      double depth = 0.0;
      for (size_t c = 0; c < sphere_count(input()); ++c)
        depth += std::max(0.0, depth_m(c, shape.vertex_m[k]));
      grip[k] = friction_ * kContactShare * mass_m(line, k) * depth;
      is_touching = is_touching || depth > 0.0;
    }
    return is_touching;
  }

  ChainParameters parameters_;
  double friction_;
  std::vector<HelixLine> lines_;
};

}  // namespace

std::unique_ptr<Solver> make_super_helix_reference(const SolverParameters& parameters) {
  return std::make_unique<SuperHelixReference>(parameters);
}

SolverRow super_helix_row() {
  SolverRow row;
  row.name = "super_helix";
  row.summary =
      "a few helical pieces with curvature and twist as unknowns, a Kirchhoff rod; exact arc length";
  row.source =
      "Bertails, Audoly, Cani, Querleux, Leroy, Leveque, Super-Helices for Predicting the Dynamics of "
      "Natural "
      "Hair, SIGGRAPH 2006, sections 3 and 4; backward Euler by Newton's method instead of their "
      "semi-implicit step, and mass at the vertices, are ours";
  row.parameters = chain_parameter_infos();
  row.parameters.push_back({kEffortName, 4.0, 1.0, 16.0, "", "helical pieces of a strand (rounded)"});
  row.effort_parameter = kEffortName;
  row.as_hair = [](const HairConstants& hair, double, double) { return chain_as_hair(hair); };
  // The arc keeps its length; the distance of two vertices shrinks as the arc between them bends.
  row.stretch_bound = 0.004;
  row.has_kernel = false;
  row.make = [](const SolverParameters& parameters, const SolverContext&) {
    return Result<std::unique_ptr<Solver>>(make_super_helix_reference(parameters));
  };
  row.make_reference = make_super_helix_reference;
  return row;
}

}  // namespace strandcast
