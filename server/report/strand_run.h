// StrandRun: one strand model at one setting, loaded with a groom and advanced step by step, by its kernel or
// as its double-precision reference. All measurements of work-precision use it. Kernels run on the executor's
// thread; reference runs may be on any thread.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "server/sim/executor/executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// What the parameters of a row represent.
enum class Material {
  Hair,      // the row's nearest to a real hair
  Limp,      // a chain: no bending, no pull to the style, no drag
  AsShipped  // the row's defaults
};
const char* to_string(Material material);

struct RunSetting {
  const SolverRow* row = nullptr;
  Material material = Material::Hair;
  uint32_t vertex_count = 32;
  double rate_hz = 60.0;
  uint32_t substeps = 1;
  double effort = std::numeric_limits<double>::quiet_NaN();  // of row->effort_parameter; NaN = its default
  bool is_reference = false;                                 // the double-precision version

  double substep_s() const { return 1.0 / (rate_hz * substeps); }
};

/// Describes a setting: "32 vertices, 60 Hz, solves 1".
std::string setting_words(const RunSetting& setting);
/// Describes a setting with its solver: "direct_rod, 32 vertices, 60 Hz, solves 1".
std::string to_string(const RunSetting& setting);

/// Physical properties of the strand, independent of the model.
struct RunPhysics {
  HairConstants hair;
  double length_m = 0.3;
  SolverParameters given;  // put over the material's, as far as the row has them
};

/// Returns the row's parameters for the setting. BadInput if the hair is out of their range or the step
/// outside the stable range.
Result<SolverParameters> run_parameters(const RunSetting& setting, const RunPhysics& physics);

/// Returns whether the row can represent a chain without stiffness; tested once per row by letting one hang.
bool can_be_limp(const SolverRow& row);

/// Returns values of a row's effort parameter around its default to try, ascending; {NaN} without one.
std::vector<double> effort_values(const SolverRow& row, const std::vector<double>& factors);

/// Device name of runs without a kernel.
inline constexpr const char* kRanInDouble = "double";

/// Whether and where kernels run.
struct Workbench {
  Executor* executor = nullptr;  // nullptr: every row runs as its reference

  bool runs_kernel(const RunSetting& setting) const {
    return executor != nullptr && !setting.is_reference && setting.row->make != nullptr;
  }
  /// Returns "gl" or "lanes", or "double" for a reference.
  std::string name_of(const RunSetting& setting) const {
    return runs_kernel(setting) ? to_string(executor->info().device) : kRanInDouble;
  }
};

bool has_parameter(const SolverRow& row, const std::string& name);

class StrandRun {
 public:
  static Result<StrandRun> make(const Workbench& workbench, const RunSetting& setting,
                                const RunPhysics& physics, const Groom& groom);

  /// Advances by one step of the setting's rate. `input` holds what all its substeps share; head_shift_m is
  /// that of the whole step.
  void step(StepInput input);
  /// Advances by input.h_s.
  void substep(const StepInput& input) { solver_->substep(input); }
  /// Returns the present state, valid until the next call.
  const SolverState& state();
  void write(const SolverState& state) { solver_->write(state); }

  const RunSetting& setting() const { return setting_; }

 private:
  StrandRun(const RunSetting& setting, std::unique_ptr<Solver> solver)
      : setting_(setting), solver_(std::move(solver)) {}

  RunSetting setting_;
  std::unique_ptr<Solver> solver_;
  SolverState state_;
};

/// Returns whether every position and velocity is finite.
bool is_state_finite(const SolverState& state);

/// Returns the largest relative change of a segment's length since the groom; segments below a micrometre are
/// ignored.
double largest_run_stretch(const Groom& groom, const SolverState& state);

/// Makes a uniform groom of polylines with equal numbers of points.
Groom groom_of(const std::vector<std::vector<glm::dvec3>>& strands, Pinning pinning);

/// Returns `vertex_count` points evenly spaced on a straight line from the head joint.
std::vector<glm::dvec3> straight_run(uint32_t vertex_count, double length_m, const glm::dvec3& direction);

}  // namespace strandcast
