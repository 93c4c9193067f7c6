#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "common/base/command_line_error.h"
#include "common/motion/motion_file.h"
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

void add_motion_file_options(CLI::App& command, MotionFileOptions& options) {
  command
      .add_option("--unit", options.unit_m, "metres per unit of the .bvh file; 0 = guessed from the bones")
      ->check(without_nan(CLI::Range(0.0, 1e3)))
      ->capture_default_str();
  command.add_option("--up", options.up, "up axis of the .bvh file; default: guessed from the rest pose")
      ->check(CLI::IsMember({"y", "z"}));
  command.add_option("--joint", options.joint, "head joint of the .bvh file; default: found by name");
  command.add_flag("--filter-glitches", options.is_filtering_glitches,
                   "take steps out of the .bvh file that are faster than any head moves");
  command.add_flag(
      "--keep-first-frames", options.is_keeping_first_frames,
      "keep frames of the .bvh file that the head jumps from, as from a T-pose before the motion");
}

}  // namespace strandcast
