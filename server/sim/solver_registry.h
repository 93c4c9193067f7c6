// The table of strand models. Everything that must cover all solvers walks it: --list-solvers, scene
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

/// How a kernel that comes in both forms spreads its work. Auto: per strand on processors, which pay more for
/// the barriers between vertices than for the work, else per vertex.
enum class KernelForm { Auto, PerVertex, PerStrand };

/// What a solver is built from besides the scene's parameters.
struct SolverContext {
  Executor* executor = nullptr;  // outlives the solver
  SceneFeatures features;
  KernelForm form = KernelForm::Auto;
  /// The strands to work on, which outlive the solver as the caller likes; nullptr = the solver's own.
  std::shared_ptr<StrandState> strands = {};
  /// Gravity that the steps will say the groom has its shape under, as far as it is known: what follows from
  /// it is then found by load() and not by the first step.
  glm::dvec3 groom_gravity_in_head_mps2 = {};
  /// How strands act on each other, where the features say that they do.
  VolumeDesc volume = {};
  /// What strands are kept out of where features.has_distance_field says so; head space.
  std::shared_ptr<const DistanceField> head_field = {};
  /// How far segments bend, where features.has_bend_limit.
  BendLimitDesc bend_limit = {};
  /// Hair whose volume is the target, where there is one; head space. nullptr: the strands' own groom.
  std::shared_ptr<const Groom> volume_target = {};
  /// Of the drag across a hair, what there is along it, where features.has_oriented_drag.
  double drag_along_share = 1.0;
};

struct SolverRow {
  std::string name;
  std::string summary;
  std::string source;  // paper, section and equation
  std::vector<SolverParameterInfo> parameters;
  /// Largest relative change of a segment's length with default parameters, whatever the head does within the
  /// motion that the laws test; 0 = lengths are exact to rounding under any motion.
  double stretch_bound = 0.0;
  /// Under constant forces strands come to rest within ten seconds.
  bool comes_to_rest = true;
  /// BadInput when a step of `substep_s` with complete parameters is outside the model's stable range, with
  /// the limit, the value and the ways out; empty = every step is stable.
  std::function<Status(const SolverParameters&, double substep_s)> check_step;
  /// The parameters that come nearest to a hair of these constants, cut into segments of `segment_m` and
  /// stepped by `substep_s`, without a pull to the groomed shape and without drag: for tests against the
  /// theory of rods. Empty = nothing in the model stands for such constants.
  std::function<SolverParameters(const HairConstants&, double segment_m, double substep_s)> as_hair;
  /// The parameter that buys accuracy with time ("iterations", "solves"); "" = none.
  std::string effort_parameter;
  /// False: there is no kernel. make then makes the double-precision solver as well, which runs on one
  /// thread of the processor, slowly, through the same interface.
  bool has_kernel = true;
  /// False: forces between strands feed its motion for ever.
  bool bears_volume = true;
  /// Does ahead what takes long of loading a groom under this gravity, so that load() finds it done, and
  /// gives what a person should know of the groom under this model, a sentence each. Any thread; ends early,
  /// with nothing, when told to stop. Empty = loading takes no time.
  std::function<Result<std::vector<std::string>>(const Groom&, const SolverParameters&,
                                                 const glm::dvec3& groom_gravity_in_head_mps2,
                                                 const std::stop_token&)>
      prepare;
  std::function<Result<std::unique_ptr<Solver>>(const SolverParameters&, const SolverContext&)> make;
  std::function<std::unique_ptr<Solver>(const SolverParameters&)>
      make_reference;  // double precision, one thread
};

const std::vector<SolverRow>& solver_table();

/// NotFound: "unknown solver 'x' (known: dftl, dftl_parallel, direct_rod)".
Result<const SolverRow*> find_solver(const std::string& name);

/// The row's check_step, if it has one.
Status check_step(const SolverRow& row, const SolverParameters& complete, double substep_s);

/// Defaults filled in; BadInput for unknown names and values out of range.
Result<SolverParameters> complete_parameters(const SolverRow& row, const SolverParameters& given);

}  // namespace strandcast
