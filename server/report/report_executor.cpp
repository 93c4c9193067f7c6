#include "server/report/report_executor.h"

namespace strandcast {

Result<std::unique_ptr<Executor>> open_report_executor(const ExecutorConfig& config) {
  if (config.gl_device == kNoDevice && config.sim_device != "lanes") return std::unique_ptr<Executor>();
  return open_executor(config);
}

Result<std::vector<std::unique_ptr<Executor>>> open_report_executors(const ExecutorConfig& config) {
  std::vector<std::unique_ptr<Executor>> executors;
  ExecutorConfig one = config;
  const bool is_all = config.sim_device == kAllDevices;
  if (is_all && config.gl_device != kNoDevice) {
    one.sim_device = "gl";
    ASSIGN_OR_RETURN(auto gl, open_executor(one));
    executors.push_back(std::move(gl));
  }
  if (is_all) one.sim_device = "lanes";
  ASSIGN_OR_RETURN(auto executor, open_report_executor(one));
  if (executor) executors.push_back(std::move(executor));
  return executors;
}

}  // namespace strandcast
