#include "server/sim/chain_parameters.h"

#include "server/sim/kernel_solver.h"

namespace strandcast {

std::vector<SolverParameterInfo> chain_parameter_infos() {
  std::vector<SolverParameterInfo> infos = uncorrected_parameter_infos();
  infos.push_back({"radius_m", 5e-5, 1e-6, 1e-2, "m", "radius of the circular cross section"});
  infos.push_back({"density_kgpm3", 1300.0, 1.0, 1e5, "kg/m^3", "density"});
  infos.push_back({"young_modulus_pa", 3e9, 0.0, 1e16, "Pa", "Young's modulus; 0 = limp"});
  infos.push_back({"poisson_ratio", 0.45, 0.0, 0.5, "", "sets the stiffness against twist"});
  infos.push_back({"bending_damping_s", 2e-3, 0.0, 1.0, "s", "material damping: time by which moments lead"});
  return infos;
}

ChainParameters read_chain_parameters(const SolverParameters& parameters, const std::string& effort_name) {
  const double radius = parameters.at("radius_m");
  ChainParameters result;
  // Of a full circle: E pi r^4 / 4 over rho pi r^2, and G J = E I / (1 + nu).
  result.bend_stiffness_m4ps2 =
      parameters.at("young_modulus_pa") * radius * radius / (4.0 * parameters.at("density_kgpm3"));
  // A model without twist has no such entry.
  if (const auto poisson_ratio = parameters.find("poisson_ratio"); poisson_ratio != parameters.end())
    result.twist_stiffness_m4ps2 = result.bend_stiffness_m4ps2 / (1.0 + poisson_ratio->second);
  result.damping_s = parameters.at("bending_damping_s");
  result.effort = read_count(parameters, effort_name);
  return result;
}

SolverParameters chain_as_hair(const HairConstants& hair) {
  return {{"radius_m", hair.radius_m},
          {"density_kgpm3", hair.density_kgpm3},
          {"young_modulus_pa", hair.young_modulus_pa},
          {"poisson_ratio", hair.poisson_ratio},
          {"bending_damping_s", 0.0},
          {"style_stiffness_per_s2", 0.0},
          {"air_drag_per_s", 0.0}};
}

Result<std::unique_ptr<Solver>> make_chain_kernel(const std::string& name, const std::string& effort_name,
                                                  const SolverParameters& parameters,
                                                  const SolverContext& context) {
  const ChainParameters chain = read_chain_parameters(parameters, effort_name);
  StrandKernelDesc desc;
  desc.name = name;
  desc.shader_path = "sim/" + name + ".comp";
  desc.constants = {{"u_bend_stiffness", chain.bend_stiffness_m4ps2},
                    {"u_twist_stiffness", chain.twist_stiffness_m4ps2},
                    {"u_bending_damping", chain.damping_s},
                    {"u_rounds", chain.effort}};
  return StrandKernel::make(std::move(desc), read_strand_parameters(parameters), context);
}

}  // namespace strandcast
