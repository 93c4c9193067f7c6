// Sub-commands of strandcast-report. Each has files of its own name and adds itself, with its options, to the
// program's command line; report_main.cpp lists them.
#pragma once

#include <functional>
#include <string>

#include "common/base/result.h"

namespace CLI {
class App;
}

namespace strandcast {

struct MotionFileOptions;
/// Adds --unit, --up, --joint, --filter-glitches and --keep-first-frames, as strandcast-ctl feed has them.
void add_motion_file_options(CLI::App& command, MotionFileOptions& options);

struct ExecutorConfig;
struct SimDeviceHelp {
  bool has_all = false;   // the report can run on every executor (kAllDevices)
  std::string none = {};  // what a GL device of that name stands for; "" = it is none
};
/// Adds --sim-device and --gl-device, which choose the device of the simulation.
void add_sim_device_options(CLI::App& command, ExecutorConfig& config, const SimDeviceHelp& help = {});

/// Work of the chosen sub-command, called after parsing. Its error ends the program with one sentence.
using ReportAction = std::function<Status()>;

/// Adds a sub-command and sets `action` if the command line names it.
using AddReportCommand = void (*)(CLI::App& app, ReportAction& action);

void add_work_precision_command(CLI::App& app, ReportAction& action);
void add_coherence_command(CLI::App& app, ReportAction& action);
void add_collisions_command(CLI::App& app, ReportAction& action);
void add_pictures_command(CLI::App& app, ReportAction& action);
void add_pruning_command(CLI::App& app, ReportAction& action);
void add_recommend_command(CLI::App& app, ReportAction& action);
void add_rendering_command(CLI::App& app, ReportAction& action);
void add_scalp_command(CLI::App& app, ReportAction& action);
void add_stability_command(CLI::App& app, ReportAction& action);
void add_streaming_command(CLI::App& app, ReportAction& action);
void add_volume_command(CLI::App& app, ReportAction& action);

}  // namespace strandcast
