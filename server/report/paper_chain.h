// T18: the set-up with which Mueller et al. (Fast Simulation of Inextensible Hair and Fur, 2012) compare
// models: 30 particles 2 cm apart, steps of 10 ms, gravity 10 m/s^2. Here the chain is released from
// horizontal and compared with one solved in small steps in double precision.
#pragma once

#include "server/report/analytic_tests.h"

namespace strandcast {

inline constexpr uint32_t kPaperChainVertices = 30;
inline constexpr double kPaperChainRateHz = 100.0;

/// Measures the error: RMS distance of the particles from the exact ones, relative to the length.
AnalyticResult run_paper_chain(const Workbench& workbench, const RunSetting& setting);

}  // namespace strandcast
