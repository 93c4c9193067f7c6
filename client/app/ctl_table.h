// The table of strandcast-ctl's commands: name, line of help, arguments and function of each. The command
// line and --help are made from it; a new command is a new row.
#pragma once

#include <span>
#include <vector>

#include "client/app/bake_command.h"
#include "client/app/bundle_command.h"
#include "client/app/camera_command.h"
#include "client/app/ctl_commands.h"
#include "client/app/export_command.h"
#include "client/app/latency_command.h"
#include "client/app/parameter_command.h"
#include "client/app/scenario/test_command.h"

namespace strandcast {

/// Parsed arguments of all commands.
struct CtlCommandLine {
  CtlTarget target{"127.0.0.1:" + std::to_string(kDefaultPort), {}, {}, false, {}, nullptr, {}};
  std::string log_level = "warn";
  FeedOptions feed;
  double monitor_s = 0.0;
  std::string assignment;
  std::string subject;
  uint64_t check_frames = 120;
  double check_timeout_s = 60.0;
  uint64_t session = 0;
  double ban_s = 0.0;
  std::string scene_path;
  ExportCommand exported;
  BakeCommand bake;
  BundleCommand bundle;
  std::string recording;
  std::string other_recording;
  std::string recording_name;
  std::string slate;
  uint32_t take = 0;
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
  /// Adds the command's arguments to `app`, which stores pointers into `line`; null: it has none.
  void (*declare)(CLI::App& app, CtlCommandLine& line);
  /// Runs the command and returns the exit code; null: it sends `message`, or only its sub-commands can be
  /// called.
  int (*run)(const CtlCommandLine& line, const std::atomic<bool>& stop);
  /// Returns the message of a command that only sends one; null: it does more.
  ClientMessage (*message)(const CtlCommandLine& line) = nullptr;
};

/// Returns the commands in the order of --help; sub-commands follow their parent.
std::span<const CtlCommand> ctl_commands();

/// Runs a command that can be called, and returns the exit code: stopped_exit_code() where `stop` came first.
int carry_out(const CtlCommand& command, const CtlCommandLine& line, const std::atomic<bool>& stop);

}  // namespace strandcast
