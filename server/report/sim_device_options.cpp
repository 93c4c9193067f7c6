#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "server/report/report_commands.h"
#include "server/report/report_executor.h"

namespace strandcast {

void add_sim_device_options(CLI::App& command, ExecutorConfig& config, const SimDeviceHelp& help) {
  std::vector<std::string> names = {"auto", "gl", "lanes"};
  std::string simulates = "what simulates: auto, gl or lanes (the processors, without OpenGL)";
  if (help.has_all) {
    names.emplace_back(kAllDevices);
    simulates += fmt::format(", or {}: each in turn, beside each other", kAllDevices);
  }
  command.add_option("--sim-device", config.sim_device, simulates)
      ->check(CLI::IsMember(names))
      ->capture_default_str();
  std::string known = "auto, software, hardware";
  known += help.none.empty() ? " or a device number"
                             : fmt::format(", a device number, or {}: {}", kNoDevice, help.none);
  command.add_option("--gl-device", config.gl_device, known)->capture_default_str();
}

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
