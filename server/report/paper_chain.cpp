#include "server/report/analytic_tests.h"

#include <algorithm>
#include <cmath>

namespace strandcast {
namespace {

constexpr double kSegmentM = 0.02;
constexpr double kPaperLengthM = kSegmentM * (kPaperChainVertices - 1);
constexpr glm::dvec3 kPaperGravityMps2(0.0, -10.0, 0.0);
// Until shortly before the tip whips round; what comes then depends on everything.
constexpr double kPaperTimeS = 0.4;
constexpr uint32_t kExactSubsteps = 64;

using ChainMotion = std::vector<std::vector<glm::vec3>>;  // positions after each step

Result<ChainMotion> fall(const Workbench& workbench, const RunSetting& setting, double& stretch) {
  RunPhysics physics;
  physics.length_m = kPaperLengthM;
  const Groom groom =
      groom_of({straight_run(kPaperChainVertices, kPaperLengthM, {1.0, 0.0, 0.0})}, Pinning::Root);
  ASSIGN_OR_RETURN(StrandRun run, StrandRun::make(workbench, setting, physics, groom));
  StepInput input;
  input.gravity_mps2 = kPaperGravityMps2;
  ChainMotion motion;
  for (int step = 0; step < kPaperTimeS * kPaperChainRateHz; ++step) {
    run.step(input);
    stretch = std::max(stretch, largest_run_stretch(groom, run.state()));
    motion.push_back(run.state().position_m);
  }
  return motion;
}

/// A limp direct_rod with steps of 1/6400 s; an error when that row is not there.
const Result<ChainMotion>& exact_motion() {
  static const Result<ChainMotion> motion = []() -> Result<ChainMotion> {
    ASSIGN_OR_RETURN(const SolverRow* rod, find_solver("direct_rod"));
    RunSetting setting{rod, Material::Limp, kPaperChainVertices, kPaperChainRateHz, kExactSubsteps};
    setting.is_reference = true;
    double stretch = 0.0;
    return fall({}, setting, stretch);
  }();
  return motion;
}

}  // namespace

AnalyticResult run_paper_chain(const Workbench& workbench, const RunSetting& setting) {
  AnalyticResult result;
  const Result<ChainMotion>& exact = exact_motion();
  const auto motion = exact ? fall(workbench, setting, result.stretch) : exact;
  if (!motion) {
    result.note = motion.error().to_string();
    return result;
  }
  double sum = 0.0;
  for (size_t k = 0; k < motion->size(); ++k) {
    for (size_t i = 0; i < kPaperChainVertices; ++i) {
      const double distance = glm::distance(glm::dvec3((*motion)[k][i]), glm::dvec3((*exact)[k][i]));
      sum += distance * distance;
    }
  }
  const double count = static_cast<double>(motion->size()) * (kPaperChainVertices - 1);
  result.value = result.error = std::sqrt(sum / count) / kPaperLengthM;
  result.exact = 0.0;
  return result;
}

}  // namespace strandcast
