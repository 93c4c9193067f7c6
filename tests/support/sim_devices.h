// What runs the simulation's kernels in tests: the one list of executors that every test walks.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/sim/executor/executor.h"

namespace strandcast {

/// All executors. Fails where one is not there, because deploy/install_deps.sh brings llvmpipe.
inline std::vector<SimDevice> sim_devices() {
  return {SimDevice::Gl, SimDevice::Lanes};
}

/// For tests that have one as their parameter.
inline std::string name_of_device(const testing::TestParamInfo<SimDevice>& device) {
  return to_string(device.param);
}

/// What runs a solver: an executor, or nothing, then it is the double-precision reference.
struct SolverHost {
  std::optional<SimDevice> device;

  bool is_kernel() const { return device.has_value(); }
  std::string name() const { return device ? to_string(*device) : "double"; }
};
inline constexpr SolverHost kReferenceHost = {};
inline constexpr SolverHost kGlHost = {SimDevice::Gl};
inline constexpr SolverHost kLanesHost = {SimDevice::Lanes};

/// Every executor.
inline std::vector<SolverHost> kernel_hosts() {
  std::vector<SolverHost> hosts;
  for (const SimDevice device : sim_devices()) hosts.push_back({device});
  return hosts;
}
/// The reference, then every executor.
inline std::vector<SolverHost> solver_hosts() {
  std::vector<SolverHost> hosts = kernel_hosts();
  hosts.insert(hosts.begin(), kReferenceHost);
  return hosts;
}

/// Executors of a test, opened when they are first asked for. They outlive what is made with them.
class SimExecutors {
 public:
  Executor& on(SimDevice device) {
    std::unique_ptr<Executor>& executor = executors_[device];
    if (executor == nullptr) {
      auto opened = open_executor({to_string(device), "auto", {}});
      EXPECT_TRUE(opened) << opened.error().to_string();
      executor = std::move(opened).value();
    }
    return *executor;
  }

 private:
  std::map<SimDevice, std::unique_ptr<Executor>> executors_;
};

}  // namespace strandcast
