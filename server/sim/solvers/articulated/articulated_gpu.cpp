#include <cmath>

#include "server/sim/solvers/articulated/articulated.h"
#include "server/sim/strand_kernel.h"
#include "server/sim/strand_parameters.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

constexpr const char* kCorrectionName = "s_damping";  // of the follow solvers only

Result<std::unique_ptr<Solver>> make_gpu(const SolverParameters& given, const GpuSolverContext& context) {
  const ChainParameters parameters = read_chain_parameters(given);
  StrandKernelDesc desc;
  desc.name = "articulated";
  desc.shader_path = "sim/articulated.comp";
  desc.local_size = shader::kStrandLocalSize;
  desc.uniforms["u_chain"] =
      glm::vec4(glm::dvec4(parameters.bend_stiffness_m4ps2, parameters.twist_stiffness_m4ps2,
                           parameters.damping_s, parameters.solves));
  SolverParameters shared = given;
  shared[kCorrectionName] = 0.0;
  return StrandKernel::make(std::move(desc), read_strand_parameters(shared), context);
}

}  // namespace

ChainParameters read_chain_parameters(const SolverParameters& parameters) {
  const double radius = parameters.at("radius_m");
  ChainParameters result;
  // Of a full circle: E pi r^4 / 4 over rho pi r^2, and G J = E I / (1 + nu).
  result.bend_stiffness_m4ps2 =
      parameters.at("young_modulus_pa") * radius * radius / (4.0 * parameters.at("density_kgpm3"));
  result.twist_stiffness_m4ps2 = result.bend_stiffness_m4ps2 / (1.0 + parameters.at("poisson_ratio"));
  result.damping_s = parameters.at("bending_damping_s");
  result.solves = static_cast<uint32_t>(std::lround(parameters.at("solves")));
  return result;
}

SolverRow articulated_row() {
  SolverRow row;
  row.name = "articulated";
  row.summary = "chain of rigid segments with ball joints: exact lengths, bending and twist of a real hair";
  row.source =
      "Woodhouse, Real-Time Hair Rendering and Simulation, University of Bristol 2017, section 2.1.1 (rigid "
      "multi-body serial chain); Featherstone, Robot Dynamics Algorithms, 1984 (articulated-body method); "
      "Hadap, Magnenat-Thalmann, Modeling Dynamic Hair as a Continuum, 2001; Chang, Jin, Yu, 2002. Implicit "
      "joints and tension are ours";
  row.parameters = shared_parameter_infos();
  std::erase_if(row.parameters, [](const SolverParameterInfo& info) { return info.name == kCorrectionName; });
  row.parameters.push_back({"radius_m", 5e-5, 1e-6, 1e-2, "m", "radius of the circular cross section"});
  row.parameters.push_back({"density_kgpm3", 1300.0, 1.0, 1e5, "kg/m^3", "density"});
  row.parameters.push_back({"young_modulus_pa", 3e9, 0.0, 1e16, "Pa", "Young's modulus; 0 = loose joints"});
  row.parameters.push_back({"poisson_ratio", 0.45, 0.0, 0.5, "", "sets the stiffness against twist"});
  row.parameters.push_back(
      {"bending_damping_s", 2e-3, 0.0, 1.0, "s", "material damping: time by which moments lead"});
  row.parameters.push_back({"solves", 1.0, 1.0, 8.0, "", "linear solves per step (rounded)"});
  row.effort_parameter = "solves";
  row.as_hair = [](const HairConstants& hair, double, double) {
    return SolverParameters{{"radius_m", hair.radius_m},
                            {"density_kgpm3", hair.density_kgpm3},
                            {"young_modulus_pa", hair.young_modulus_pa},
                            {"poisson_ratio", hair.poisson_ratio},
                            {"bending_damping_s", 0.0},
                            {"style_stiffness_per_s2", 0.0},
                            {"air_drag_per_s", 0.0}};
  };
  row.make_gpu = make_gpu;
  row.make_reference = make_articulated_reference;
  return row;
}

}  // namespace strandcast
