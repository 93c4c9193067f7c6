#include <algorithm>
#include <cmath>

#include "server/sim/kernel_solver.h"
#include "server/sim/solvers/mass_spring/mass_spring.h"
#include "server/sim/strand_parameters.h"

namespace strandcast {
namespace {

constexpr const char* kIntegratorNames[] = {"symplectic Euler", "Verlet", "backward Euler"};

Result<std::unique_ptr<Solver>> make_spring_kernel(const SolverParameters& given,
                                                   const SolverContext& context) {
  const MassSpringParameters parameters = read_mass_spring(given);
  StrandKernelDesc desc;
  desc.name = "mass_spring";
  desc.constants = {{"u_stretch", parameters.stretch_mps2},
                    {"u_stretch_damping", parameters.stretch_damping_mps},
                    {"u_bend", parameters.bend_m3ps2},
                    {"u_altitude", parameters.altitude_mps2},
                    {"u_shortest_segment", parameters.shortest_segment_m},
                    {"u_stretch_limit", parameters.stretch_limit}};
  if (parameters.integrator == SpringIntegrator::BackwardEuler) {
    desc.shader_path =
        parameters.altitude_mps2 > 0.0 ? "sim/mass_spring_altitude.comp" : "sim/mass_spring.comp";
    desc.constants["u_solves"] = parameters.solves;
    desc.constants["u_most_stiffness"] = kMaxImplicitRatio;
  } else {
    desc.shader_path = "sim/mass_spring_explicit.comp";
    desc.constants["u_middle"] = parameters.integrator == SpringIntegrator::Verlet ? 0.5 : 0.0;
  }
  return StrandKernel::make(std::move(desc), read_strand_parameters(given), context);
}

Status check_explicit_step(const SolverParameters& given, double substep_s) {
  const MassSpringParameters parameters = read_mass_spring(given);
  if (parameters.integrator == SpringIntegrator::BackwardEuler) return {};
  const double load = explicit_load(parameters, substep_s);
  if (load <= 1.0) return {};
  const double mass_kg = given.at("linear_density_kg_per_m") * parameters.shortest_segment_m;
  const double unit_npm = mass_kg / (substep_s * substep_s);
  const double of_dampers = 2.0 * substep_s * parameters.stretch_damping_mps / parameters.shortest_segment_m;
  const double of_springs = load - of_dampers;
  // Of n substeps each has 1 / n of the dampers' load and 1 / n^2 of the springs'.
  const double substeps =
      std::ceil(0.5 * (of_dampers + std::sqrt(of_dampers * of_dampers + 4.0 * of_springs)));
  return make_error(
      ErrorCode::BadInput,
      "springs of solver 'mass_spring' are too stiff for integrator {} ({}): stretch + {} bend / L^2 + {} "
      "altitude is {:.6g} N/m, stable is up to {:.6g} N/m for substeps of {:.6g} s and vertices of {:.6g} kg "
      "(linear_density_kg_per_m x shortest_segment_m, less what the dampers take); use {} times as many "
      "substeps, softer springs, or integrator 2 (backward Euler)",
      static_cast<uint32_t>(parameters.integrator),
      kIntegratorNames[static_cast<uint32_t>(parameters.integrator)], kBendPerStretch, kAltitudePerStretch,
      of_springs * unit_npm, std::max(0.0, 1.0 - of_dampers) * unit_npm, substep_s, mass_kg, substeps);
}

SolverParameters parameters_of_hair(const HairConstants& hair, double segment_m, double) {
  const double cubed = segment_m * segment_m * segment_m;
  return {{"stretch_stiffness_n_per_m", hair.stretch_stiffness_n() / segment_m},
          {"stretch_damping_ns_per_m", 0.0},
          {"bend_stiffness_nm_per_rad", hair.bending_stiffness_nm2() / segment_m},
          {"altitude_stiffness_n_per_m", hair.twist_stiffness_nm2() / cubed},
          {"linear_density_kg_per_m", hair.linear_density_kgpm()},
          {"style_stiffness_per_s2", 0.0},
          {"air_drag_per_s", 0.0}};
}

}  // namespace

MassSpringParameters read_mass_spring(const SolverParameters& parameters) {
  const double density = parameters.at("linear_density_kg_per_m");
  MassSpringParameters result;
  result.integrator = static_cast<SpringIntegrator>(std::lround(parameters.at("integrator")));
  result.solves = read_count(parameters, "solves");
  result.stretch_mps2 = parameters.at("stretch_stiffness_n_per_m") / density;
  result.stretch_damping_mps = parameters.at("stretch_damping_ns_per_m") / density;
  result.bend_m3ps2 = parameters.at("bend_stiffness_nm_per_rad") / density;
  result.altitude_mps2 = parameters.at("altitude_stiffness_n_per_m") / density;
  result.shortest_segment_m = parameters.at("shortest_segment_m");
  result.stretch_limit = parameters.at("stretch_limit");
  return result;
}

double explicit_load(const MassSpringParameters& parameters, double substep_s) {
  const double shortest = parameters.shortest_segment_m;
  const double stiffness = parameters.stretch_mps2 +
                           kBendPerStretch * parameters.bend_m3ps2 / (shortest * shortest) +
                           kAltitudePerStretch * parameters.altitude_mps2;
  return substep_s * (substep_s * stiffness + 2.0 * parameters.stretch_damping_mps) / shortest;
}

// Defaults: density and bending of the reference hair (0.05 mm radius, 1300 kg/m^3, 3 GPa) cut into segments
// of 15 mm. True stretch would be 1,600 N/m; at 1 N/m a strand of 16 vertices hangs 0.2 % long, and float is
// good.
SolverRow mass_spring_row() {
  SolverRow row;
  row.name = "mass_spring";
  row.summary = "masses and springs: stretch with dampers, angular, altitude; explicit or implicit; SI units";
  row.source =
      "Sams, Hair Simulation for Real-Time Applications, Bournemouth University 2014, sections 3.1 and 3.2; "
      "Selle, Lentine, Fedkiw, A Mass Spring Model for Hair Simulation, SIGGRAPH 2008, sections 3 and 4; "
      "implicit step: Baraff, Witkin, Large Steps in Cloth Simulation, SIGGRAPH 1998, equation 6";
  row.parameters = uncorrected_parameter_infos();
  row.parameters.insert(
      row.parameters.end(),
      {{"integrator", 2.0, 0.0, 2.0, "",
        "0 = symplectic Euler, 1 = Verlet, 2 = backward Euler (rounded); 0 and 1 need soft springs or short "
        "substeps"},
       {"solves", 2.0, 1.0, 4.0, "", "Newton steps per substep of backward Euler (rounded)"},
       {"stretch_stiffness_n_per_m", 1.0, 0.0, 1e12, "N/m", "of the spring along a segment"},
       {"stretch_damping_ns_per_m", 1e-4, 0.0, 1e6, "N s/m", "of the damper along a segment"},
       {"bend_stiffness_nm_per_rad", 1e-6, 0.0, 1e6, "N m/rad", "of the angular spring between segments"},
       {"altitude_stiffness_n_per_m", 3e-3, 0.0, 1e12, "N/m",
        "of the spring that keeps four vertices from collapsing; resists twist where a strand is curved"},
       {"linear_density_kg_per_m", 1.02e-5, 1e-7, 1e3, "kg/m", "mass per length of a strand"},
       {"shortest_segment_m", 1e-3, 1e-6, 10.0, "m",
        "shorter segments have the mass and the leverage of this length"},
       {"stretch_limit", 0.05, 0.0, 10.0, "",
        "largest relative change of a segment's length, restored after each substep"}});
  row.effort_parameter = "solves";
  row.check_step = check_explicit_step;
  row.as_hair = parameters_of_hair;
  // What the springs give: the weight and the pull of the head's motion over 1 N/m.
  row.stretch_bound = 0.006;
  row.make = make_spring_kernel;
  row.make_reference = make_mass_spring_reference;
  return row;
}

}  // namespace strandcast
