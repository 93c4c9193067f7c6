#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "server/report/report_commands.h"
#include "server/report/report_executor.h"

namespace strandcast {

void add_sim_device_options(CLI::App& command, ExecutorConfig& config, const std::string& none) {
  command
      .add_option("--sim-device", config.sim_device,
                  "what simulates: auto, gl or lanes (the processors, without OpenGL)")
      ->check(CLI::IsMember({"auto", "gl", "lanes"}))
      ->capture_default_str();
  std::string known = "auto, software, hardware";
  known +=
      none.empty() ? " or a device number" : fmt::format(", a device number, or {}: {}", kNoDevice, none);
  command.add_option("--gl-device", config.gl_device, known)->capture_default_str();
}

Result<std::unique_ptr<Executor>> open_report_executor(const ExecutorConfig& config) {
  if (config.gl_device == kNoDevice && config.sim_device != "lanes") return std::unique_ptr<Executor>();
  return open_executor(config);
}

}  // namespace strandcast
