#include <cmath>

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/shape_constraints/shape_constraints.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

// TressFX takes 2, for hair without gravity. At 60 Hz 2 / 4 / 8 let limp strands of 16 vertices and 30 cm
// swing with a period of 0.74 / 0.91 / 1.005 of that of many small steps.
constexpr double kDefaultLengthIterations = 8.0;
constexpr double kDefaultShapeIterations = 2.0;  // as TressFX
// Few sweeps from root to tip turn errors around, and the next step repeats what it finds: stiff strands
// flicker, as TressFX's do (its issue 19). From four on they converge well enough to take all of a
// correction.
constexpr uint32_t kConvergingShapeIterations = 4;
constexpr double kShapeRelaxation = 0.7;
constexpr double kConvergedShapeIterations = 8.0;
constexpr double kDefaultStretchLimit = 0.1;
constexpr double kMaxShapeIterations = 64.0;
// The local shape holds the style as well, so the pull to it may be weaker; at the tip it still carries all
// of the weight.
constexpr double kDefaultStylePerS2 = 100.0;
// 1.4 of TressFX's units, centimetres, per step and step at 60 Hz.
constexpr double kDefaultFastMps2 = 50.0;

Result<std::unique_ptr<Solver>> make_shape_kernel(const SolverParameters& given,
                                                  const SolverContext& context) {
  const ShapeConstraintsParameters model = read_shape_constraints(given);
  StrandKernelDesc desc;
  desc.name = "shape_constraints";
  desc.shader_path = "sim/shape_constraints.comp";
  desc.constants = {{"u_iterations", model.length_iterations},
                    {"u_stretch_limit", model.stretch_limit},
                    {"u_bend_stiffness", model.bend_stiffness_m4ps2},
                    {"u_shape_iterations", model.shape_iterations},
                    {"u_shape_relaxation", model.shape_relaxation},
                    {"u_shock_share", model.shock_share},
                    {"u_fast", model.fast_mps2},
                    {"u_damping", model.damping_per_s},
                    {"u_fast_damping", model.fast_damping_per_s},
                    {"u_air_along", model.air_along_share}};
  return StrandKernel::make(std::move(desc), read_strand_parameters(given), context);
}

std::vector<SolverParameterInfo> parameter_infos() {
  std::vector<SolverParameterInfo> infos = uncorrected_parameter_infos();
  for (SolverParameterInfo& info : infos) {
    if (info.name == "style_stiffness_per_s2") info.default_value = kDefaultStylePerS2;
  }
  const HairConstants hair;
  infos.insert(
      infos.end(),
      {{"iterations", kDefaultLengthIterations, 0.0, kMaxShapeIterations, "",
        "times the segments are given their lengths per substep (rounded); 0 = they are not"},
       {"shape_iterations", kDefaultShapeIterations, 0.0, kMaxShapeIterations, "",
        "times the segments are turned to their groomed angles per substep (rounded); 0 = limp, 2 as "
        "TressFX, "
        "softer than bend_stiffness, from 4 on as stiff as that at any rate, but folded strands may flutter"},
       {"bend_stiffness_m4_per_s2", hair.bending_stiffness_nm2() / hair.linear_density_kgpm(), 0.0, 1.0,
        "m^4/s^2", "bending stiffness over mass per length; default: a hair of 0.05 mm radius"},
       {"shock_share", 0.8, 0.0, 1.0, "",
        "share of every change of the root's motion that the whole strand takes on at once"},
       {"damping_per_s", 4.8, 0.0, 1000.0, "1/s", "rate at which strands take on the motion of the head"},
       {"fast_acceleration_mps2", kDefaultFastMps2, 0.1, 1e9, "m/s^2",
        "acceleration of the root from which on shock_share grows to 1 and stretch_limit falls to 0, where "
        "both "
        "are at twice that"},
       {"stretch_limit", kDefaultStretchLimit, 0.0, 10.0, "",
        "largest relative change of a segment's length that the iterations may leave"},
       {"fast_damping_per_s", 20.0, 0.0, 1000.0, "1/s", "further damping then"},
       {"air_along_share", 0.5, 0.0, 1.0, "",
        "drag along a strand over the drag across it; slender bodies have 0.5, TressFX 0"}});
  return infos;
}

}  // namespace

ShapeConstraintsParameters read_shape_constraints(const SolverParameters& parameters) {
  ShapeConstraintsParameters result;
  result.length_iterations = read_count(parameters, "iterations");
  result.bend_stiffness_m4ps2 = parameters.at("bend_stiffness_m4_per_s2");
  if (result.bend_stiffness_m4ps2 > 0.0) result.shape_iterations = read_count(parameters, "shape_iterations");
  if (result.shape_iterations < kConvergingShapeIterations) result.shape_relaxation = kShapeRelaxation;
  result.shock_share = parameters.at("shock_share");
  result.fast_mps2 = parameters.at("fast_acceleration_mps2");
  result.damping_per_s = parameters.at("damping_per_s");
  result.fast_damping_per_s = parameters.at("fast_damping_per_s");
  result.stretch_limit = parameters.at("stretch_limit");
  result.air_along_share = parameters.at("air_along_share");
  return result;
}

SolverRow shape_constraints_row() {
  SolverRow row;
  row.name = "shape_constraints";
  row.summary =
      "the TressFX model: global and local shape, red-black lengths, velocity shock propagation; SI units";
  row.source =
      "Unity custom hair simulation PT1 (tutorial on TressFX constraints), all sections; Zappe, Simulation "
      "of "
      "hair with the Tractrix curve, 2020, section 2.2.2, algorithm 1; Woodhouse 2017, section 2.1.5; "
      "Macklin, Mueller, Chentanez 2016, equation 18 (stiffness of the local shape)";
  row.parameters = parameter_infos();
  row.effort_parameter = "iterations";
  row.as_hair = [](const HairConstants& hair, double, double) {
    return SolverParameters{
        {"bend_stiffness_m4_per_s2", hair.bending_stiffness_nm2() / hair.linear_density_kgpm()},
        {"shape_iterations", kConvergedShapeIterations},
        {"style_stiffness_per_s2", 0.0},
        {"air_drag_per_s", 0.0},
        {"damping_per_s", 0.0},
        {"fast_damping_per_s", 0.0},
        {"shock_share", 0.0}};
  };
  row.stretch_bound = (1.0 + 1e-3) * kDefaultStretchLimit;  // lengths are rounded
  row.make = make_shape_kernel;
  row.make_reference = make_shape_constraints_reference;
  return row;
}

}  // namespace strandcast
