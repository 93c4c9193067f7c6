#include <cmath>

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/position_based/position_based.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

constexpr const char* kSweepsName = "tractrix_sweeps";
constexpr const char* kFirstName = "tractrix_first";
constexpr double kDefaultIterations = 10.0;
constexpr double kDefaultCompliantIterations = 20.0;
constexpr double kDefaultHybridIterations = 4.0;
constexpr double kMaxIterations = 64.0;

Result<std::unique_ptr<Solver>> make_kernel(const SolverParameters& given, const SolverContext& context,
                                            bool is_compliant) {
  const PositionBasedParameters parameters = read_position_based(given, is_compliant);
  StrandKernelDesc desc;
  desc.name = is_compliant ? "xpbd" : "pbd";
  desc.shader_path = is_compliant ? "sim/xpbd.comp" : "sim/pbd.comp";
  const double density = parameters.linear_density_kgpm;
  const glm::dvec2 give =
      is_compliant ? density * glm::dvec2(parameters.stretch_compliance_mpn, parameters.bend_compliance_mpn)
                   : glm::dvec2(parameters.stretch_share, parameters.bend_share);
  desc.constants = {
      {"u_stretch_give", give.x}, {"u_bend_give", give.y}, {"u_iterations", parameters.iterations}};
  if (parameters.tractrix_sweeps > 0) {
    desc.name = "tractrix_hybrid";
    desc.shader_path = "sim/tractrix_hybrid.comp";
    desc.constants["u_tractrix_sweeps"] = parameters.tractrix_sweeps;
    desc.constants["u_tractrix_first"] = parameters.has_tractrix_first ? 1u : 0u;
  }
  return StrandKernel::make(std::move(desc), read_strand_parameters(given), context);
}

SolverRow common_row(bool is_compliant) {
  SolverRow row;
  row.parameters = uncorrected_parameter_infos();
  row.parameters.push_back({"iterations", is_compliant ? kDefaultCompliantIterations : kDefaultIterations,
                            1.0, kMaxIterations, "",
                            "times all constraints are solved per substep (rounded)"});
  row.effort_parameter = "iterations";
  row.make = [is_compliant](const SolverParameters& parameters, const SolverContext& context) {
    return make_kernel(parameters, context, is_compliant);
  };
  row.make_reference = [is_compliant](const SolverParameters& parameters) {
    return make_position_based_reference(parameters, is_compliant);
  };
  return row;
}

}  // namespace

PositionBasedParameters read_position_based(const SolverParameters& parameters, bool is_compliant) {
  PositionBasedParameters result;
  result.iterations = read_count(parameters, "iterations");
  result.is_compliant = is_compliant;
  if (parameters.contains(kSweepsName)) {
    result.tractrix_sweeps = read_count(parameters, kSweepsName);
    result.has_tractrix_first = parameters.at(kFirstName) >= 0.5;
  }
  if (is_compliant) {
    result.stretch_compliance_mpn = parameters.at("stretch_compliance_m_per_n");
    result.bend_compliance_mpn = parameters.at("bend_compliance_m_per_n");
    result.linear_density_kgpm = parameters.at("linear_density_kg_per_m");
    return result;
  }
  // After all iterations the share k of a lone constraint's error is gone, whatever their number.
  const auto per_iteration = [&result](double share) {
    return 1.0 - std::pow(1.0 - share, 1.0 / result.iterations);
  };
  result.stretch_share = per_iteration(parameters.at("stretch_stiffness"));
  result.bend_share = per_iteration(parameters.at("bend_stiffness"));
  return result;
}

SolverRow pbd_row() {
  SolverRow row = common_row(false);
  row.name = "pbd";
  row.summary = "position-based dynamics: stretch and bending as distances, iterated; stiffness per step";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 2.1.3, "
      "equation 2.1; Mueller et al., Position Based Dynamics, 2007, sections 3.3 and 3.4";
  row.parameters.push_back(
      {"stretch_stiffness", 1.0, 0.0, 1.0, "", "share of a segment's stretch taken back per substep"});
  row.parameters.push_back(
      {"bend_stiffness", 0.05, 0.0, 1.0, "",
       "share of the error of a vertex's distance to the second next one taken back per substep"});
  row.stretch_bound = 0.4;
  return row;
}

// Defaults: a hair of 0.05 mm radius, 1300 kg/m^3 and 3 GPa, segments of 2 cm: l / (E A) and l^3 / (E I). Ten
// iterations at 60 Hz would leave strands of 16 vertices that stand against gravity restless at that.
SolverRow xpbd_row() {
  SolverRow row = common_row(true);
  row.name = "xpbd";
  row.summary = "compliant position-based dynamics: stretch and bending as distances, iterated; SI units";
  row.source =
      "Macklin, Mueller, Chentanez, XPBD: Position-Based Simulation of Compliant Constrained Dynamics, 2016, "
      "equations 17 and 18; constraints as in pbd";
  row.parameters.push_back(
      {"stretch_compliance_m_per_n", 1e-3, 0.0, 1e6, "m/N", "stretch of a segment per force"});
  row.parameters.push_back({"bend_compliance_m_per_n", 500.0, 0.0, 1e9, "m/N",
                            "change of a vertex's distance to the second next one per force"});
  row.parameters.push_back(
      {"linear_density_kg_per_m", 1.02e-5, 1e-7, 1.0, "kg/m", "mass per length of a strand"});
  row.as_hair = [](const HairConstants& hair, double segment_m, double) {
    return SolverParameters{
        {"stretch_compliance_m_per_n", segment_m / hair.stretch_stiffness_n()},
        {"bend_compliance_m_per_n", segment_m * segment_m * segment_m / hair.bending_stiffness_nm2()},
        {"linear_density_kg_per_m", hair.linear_density_kgpm()},
        {"style_stiffness_per_s2", 0.0},
        {"air_drag_per_s", 0.0}};
  };
  row.stretch_bound = 0.15;
  return row;
}

SolverRow tractrix_hybrid_row() {
  SolverRow row = xpbd_row();
  row.name = "tractrix_hybrid";
  row.summary =
      "compliant position-based dynamics finished by tractrix sweeps: exact lengths, few iterations";
  row.source =
      "Zappe, Simulation of hair with the Tractrix curve, Ravensburg-Weingarten 2020, chapter 6 (proposed "
      "there); constraints as in xpbd";
  for (SolverParameterInfo& info : row.parameters) {
    if (info.name == "iterations") info.default_value = kDefaultHybridIterations;
  }
  row.parameters.push_back({kSweepsName, 2.0, 0.0, 2.0, "",
                            "0 = none, 1 = from the root to the tip, 2 = from the tip first (rounded)"});
  row.parameters.push_back(
      {kFirstName, 0.0, 0.0, 1.0, "", "1 = sweeps before the iterations, as a first guess"});
  row.stretch_bound = 0.0;
  return row;
}

}  // namespace strandcast
