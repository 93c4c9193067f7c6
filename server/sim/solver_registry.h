// The table of strand models. Everything that must cover all solvers walks it: --list-solvers, scene
// validation, property tests, stability runs, reports and benches.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/gl/program.h"
#include "server/sim/solver.h"

namespace strandcast {

struct SolverParameterInfo {
  std::string name;
  double default_value = 0.0;
  double minimum = 0.0;
  double maximum = 1.0;
  std::string unit;  // "" = dimensionless
  std::string summary;
};

/// What a GPU solver is built from besides the scene's parameters.
struct GpuSolverContext {
  const gl::ShaderLibrary* shaders = nullptr;
  SceneFeatures features;
};

struct SolverRow {
  std::string name;
  std::string summary;
  std::string source;  // paper, section and equation
  std::vector<SolverParameterInfo> parameters;
  std::function<Result<std::unique_ptr<Solver>>(const SolverParameters&, const GpuSolverContext&)> make_gpu;
  std::function<std::unique_ptr<Solver>(const SolverParameters&)>
      make_reference;  // double precision, one thread
};

const std::vector<SolverRow>& solver_table();

/// NotFound: "unknown solver 'x' (known: dftl, dftl_parallel, direct_rod)".
Result<const SolverRow*> find_solver(const std::string& name);

/// Defaults filled in; BadInput for unknown names and values out of range.
Result<SolverParameters> complete_parameters(const SolverRow& row, const SolverParameters& given);

}  // namespace strandcast
