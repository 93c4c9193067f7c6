#include "server/sim/solver_registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "server/sim/solvers/angular_projection/angular_projection.h"
#include "server/sim/solvers/articulated/articulated.h"
#include "server/sim/solvers/dftl/dftl.h"
#include "server/sim/solvers/dftl_parallel/dftl_parallel.h"
#include "server/sim/solvers/direct_rod/direct_rod.h"
#include "server/sim/solvers/ftl/ftl.h"
#include "server/sim/solvers/mass_spring/mass_spring.h"
#include "server/sim/solvers/position_based/position_based.h"
#include "server/sim/solvers/shape_constraints/shape_constraints.h"
#include "server/sim/solvers/super_helix/super_helix.h"
#include "server/sim/solvers/tractrix/tractrix.h"

namespace strandcast {

const std::vector<SolverRow>& solver_table() {
  static const std::vector<SolverRow> table = {dftl_row(),
                                               dftl_parallel_row(),
                                               ftl_row(),
                                               pbd_row(),
                                               xpbd_row(),
                                               mass_spring_row(),
                                               shape_constraints_row(),
                                               tractrix_emulation_row(),
                                               tractrix_split_row(),
                                               tractrix_hybrid_row(),
                                               angular_projection_row(),
                                               articulated_row(),
                                               super_helix_row(),
                                               direct_rod_row()};
  return table;
}

Result<const SolverRow*> find_solver(const std::string& name) {
  std::string known;
  for (const SolverRow& row : solver_table()) {
    if (row.name == name) return &row;
    known += (known.empty() ? "" : ", ") + row.name;
  }
  return make_error(ErrorCode::NotFound, "unknown solver '{}' (known: {})", name, known);
}

Status hand_over(Solver& from, Solver& to, const Groom& groom, const glm::dquat& world_from_head_rotation) {
  if (to.strands() != nullptr && to.strands() == from.strands()) return to.follow();
  SolverState state;
  from.read(state);
  RETURN_IF_ERROR(to.load(groom, world_from_head_rotation));
  to.write(state);
  return {};
}

Status check_step(const SolverRow& row, const SolverParameters& complete, double substep_s) {
  return row.check_step ? row.check_step(complete, substep_s) : Status();
}

namespace {

/// Says which solvers have a parameter; empty text if none has it.
std::string others_with(const std::string& parameter) {
  std::vector<std::string> names;
  for (const SolverRow& row : solver_table())
    for (const SolverParameterInfo& info : row.parameters)
      if (info.name == parameter) names.push_back(row.name);
  if (names.empty()) return {};
  return fmt::format(", but {} has: choose it with solver.name={}", fmt::join(names, ", "), names.back());
}

}  // namespace

Result<SolverParameters> complete_parameters(const SolverRow& row, const SolverParameters& given) {
  SolverParameters complete;
  std::string known;
  for (const SolverParameterInfo& info : row.parameters) {
    complete[info.name] = info.default_value;
    known += (known.empty() ? "" : ", ") + info.name;
  }
  for (const auto& [name, value] : given) {
    const auto info =
        std::find_if(row.parameters.begin(), row.parameters.end(),
                     [&name](const SolverParameterInfo& candidate) { return candidate.name == name; });
    if (info == row.parameters.end()) {
      return make_error(ErrorCode::BadInput, "solver '{}' has no parameter '{}'{} (known: {})", row.name,
                        name, others_with(name), known);
    }
    // Written so that NaN is refused as well.
    if (!(value >= info->minimum && value <= info->maximum)) {
      return make_error(ErrorCode::BadInput, "{} of solver '{}' is {} {} (allowed: {} to {})", name, row.name,
                        value, info->unit, info->minimum, info->maximum);
    }
    complete[name] = value;
  }
  return complete;
}

}  // namespace strandcast
