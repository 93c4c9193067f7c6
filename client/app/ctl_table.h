// The commands of strandcast-ctl as a table: of each its name, a line of help, its arguments and its
// function. The command line and --help are made from it; another command is another row.
#pragma once

#include <span>
#include <vector>

#include "client/app/camera_command.h"
#include "client/app/ctl_commands.h"
#include "client/app/export_command.h"
#include "client/app/latency_command.h"
#include "client/app/parameter_command.h"
#include "client/app/scenario/test_command.h"

namespace strandcast {

/// What was given with any of them.
struct CtlCommandLine {
  CtlTarget target{"127.0.0.1:" + std::to_string(kDefaultPort), {}, {}, false, {}, nullptr, {}};
  bool names_server = false;  // --connect was given
  FeedOptions feed;
  std::vector<float> wind_mps;
  double monitor_s = 0.0;
  std::string assignment;
  std::string subject;
  uint64_t check_frames = 120;
  double check_timeout_s = 60.0;
  uint64_t session = 0;
  double ban_s = 0.0;
  std::string scene_path;
  ExportCommand exported;
  std::string recording;
  std::string other_recording;
  std::string recording_name;
  uint32_t step_count = 0;
  TestOptions test;
  ParameterOptions params;
  LatencyOptions latency;
  CameraOptions camera;
  std::vector<std::string> script_words;  // of a command that is a script
};

struct CtlCommand {
  const char* name;  // "mocap subject" stands below "mocap"
  const char* summary;
  /// Adds its arguments to `app`, which keeps pointers into `line`; null: it has none.
  void (*declare)(CLI::App& app, CtlCommandLine& line);
  /// Gives the exit code; null: only what stands below it can be called.
  int (*run)(const CtlCommandLine& line, const std::atomic<bool>& stop);
};

/// In the order of --help; what stands below another comes behind it.
std::span<const CtlCommand> ctl_commands();

}  // namespace strandcast
