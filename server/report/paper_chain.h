// T18: the set-up that Mueller et al. (Fast Simulation of Inextensible Hair and Fur, 2012) compare models
// with: 30 particles 2 cm apart, steps of 10 ms, gravity 10 m/s^2, here let go from horizontal, against the
// same chain solved with small steps in double precision.
#pragma once

#include "server/report/analytic_tests.h"

namespace strandcast {

inline constexpr uint32_t kPaperChainVertices = 30;
inline constexpr double kPaperChainRateHz = 100.0;

/// error: root of the mean squared distance of the particles from the exact ones over the length.
AnalyticResult run_paper_chain(const Workbench& workbench, const RunSetting& setting);

}  // namespace strandcast
