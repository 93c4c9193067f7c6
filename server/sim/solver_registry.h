// The table of strand models. Code that must cover all solvers iterates over it: --list-solvers, scene
// validation, property tests, stability runs, reports and benches.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "server/sim/hair_constants.h"
#include "server/sim/solver.h"

namespace strandcast {

class Executor;
struct DistanceField;

struct SolverParameterInfo {
  std::string name;
  double default_value = 0.0;
  double minimum = 0.0;
  double maximum = 1.0;
  std::string unit;  // "" = dimensionless
  std::string summary;
};

/// How a kernel with two forms divides its work. Auto: per strand on processors, where barriers between
/// vertices cost more than the work; otherwise per vertex.
enum class KernelForm { Auto, PerVertex, PerStrand };

/// Inputs from which a solver is made, besides the scene's parameters.
struct SolverContext {
  Executor* executor = nullptr;  // outlives the solver
  SceneFeatures features;
  KernelForm form = KernelForm::Auto;
  /// Strands to work on; nullptr = the solver makes its own. They may outlive the solver.
  std::shared_ptr<StrandState> strands = {};
  /// Gravity under which the groom has its shape, if known in advance. load() then computes what follows from
  /// it, instead of the first step.
  glm::dvec3 groom_gravity_in_head_mps2 = {};
  /// Forces between strands; used if the features say so.
  VolumeDesc volume = {};
  /// Distance field that strands stay out of, in head space; used if features.has_distance_field.
  std::shared_ptr<const DistanceField> head_field = {};
  /// Limits of bending; used if features.has_bend_limit.
  BendLimitDesc bend_limit = {};
  /// Hair whose volume is the target, in head space; nullptr: the groom of the strands.
  std::shared_ptr<const Groom> volume_target = {};
  /// Drag along a hair relative to that across; used if features.has_oriented_drag.
  double drag_along_share = 1.0;
};

struct SolverRow {
  std::string name;
  std::string summary;
  std::string source;  // paper, section and equation
  std::vector<SolverParameterInfo> parameters;
  /// Largest relative change of a segment's length with default parameters, under any head motion that the
  /// laws test. 0 = lengths are exact to rounding under any motion.
  double stretch_bound = 0.0;
  /// Whether strands come to rest within ten seconds under constant forces.
  bool comes_to_rest = true;
  /// Checks the stability of a step of `substep_s` with complete parameters. BadInput states the limit, the
  /// value and remedies; empty = every step is stable.
  std::function<Status(const SolverParameters&, double substep_s)> check_step;
  /// Returns the parameters that best represent a hair of these constants, cut into segments of `segment_m`
  /// and stepped by `substep_s`. They have no pull to the groomed shape and no drag, for tests against the
  /// theory of rods. Empty = the model cannot represent such constants.
  std::function<SolverParameters(const HairConstants&, double segment_m, double substep_s)> as_hair;
  /// Name of the parameter that trades time for accuracy ("iterations", "solves"); "" = none.
  std::string effort_parameter;
  /// Whether there is a kernel. Without one, make() returns the double-precision solver, which is slow and
  /// uses one processor thread.
  bool has_kernel = true;
  /// Whether the model tolerates forces between strands; false: they would feed its motion forever.
  bool bears_volume = true;
  /// Does the slow part of loading a groom under this gravity in advance, so that load() finds it done.
  /// Returns notes for a person, one sentence each. Any thread; ends early without notes if told to stop.
  /// Empty = loading is fast.
  std::function<Result<std::vector<std::string>>(const Groom&, const SolverParameters&,
                                                 const glm::dvec3& groom_gravity_in_head_mps2,
                                                 const std::stop_token&)>
      prepare;
  std::function<Result<std::unique_ptr<Solver>>(const SolverParameters&, const SolverContext&)> make;
  std::function<std::unique_ptr<Solver>(const SolverParameters&)>
      make_reference;  // double precision, one thread
};

const std::vector<SolverRow>& solver_table();

/// Finds a row. NotFound: "unknown solver 'x' (known: dftl, dftl_parallel, direct_rod)".
Result<const SolverRow*> find_solver(const std::string& name);

/// Calls the row's check_step, if it has one.
Status check_step(const SolverRow& row, const SolverParameters& complete, double substep_s);

/// Fills in defaults. BadInput for unknown names and values out of range.
Result<SolverParameters> complete_parameters(const SolverRow& row, const SolverParameters& given);

}  // namespace strandcast
