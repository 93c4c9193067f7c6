// strandcast-report scalp: what of the scalp a head motion lays bare.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/base/command_line_error.h"
#include "common/gl/egl_context.h"
#include "common/scene/scene_file.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"
#include "server/report/scalp.h"

namespace strandcast {
namespace {

Result<StreamMotion> motion_of(const ScalpOptions& options) {
  if (!options.motion_path.empty()) return load_stream_motion(options.motion_path, options.motion_file);
  return built_in_stream_motions()[1];
}

Status run_command(const ScalpOptions& options) {
  ScalpRunDesc desc;
  ASSIGN_OR_RETURN(desc.scene, options.scene_path.empty()
                                   ? built_in_scene_with(options.overrides)
                                   : load_scene(options.scene_path, options.overrides));
  ASSIGN_OR_RETURN(desc.motion, motion_of(options));
  desc.seconds = options.seconds;
  desc.every_s = options.every_s;
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  std::unique_ptr<gl::EglContext> context;  // that draws, where the executor has none
  if (executor->info().device != SimDevice::Gl) {
    ASSIGN_OR_RETURN(context, gl::EglContext::make(options.device.gl_device));
  }
  ASSIGN_OR_RETURN(const gl::DeviceInfo device, gl::read_device_info());
  const gl::ShaderLibrary shaders;
  ASSIGN_OR_RETURN(const ScalpRun run, run_scalp(desc, shaders, device, *executor));
  fmt::print("{}", scalp_text(desc, run));
  RETURN_IF_ERROR(save_text(options.out / "scalp.csv", scalp_csv(run)));
  RETURN_IF_ERROR(save_png(options.out / "scalp_groomed.png", run.groomed_picture));
  RETURN_IF_ERROR(save_png(options.out / "scalp_worst.png", run.worst_picture));
  fmt::print("{}\n", (options.out / "scalp.csv").string());
  return {};
}

}  // namespace

void declare_scalp(CLI::App& command, ScalpOptions& options) {
  command.add_option("--scene", options.scene_path, "scene file; default: the built-in scene");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--motion", options.motion_path, ".bvh file; default: a built-in walk");
  add_motion_file_options(command, options.motion_file);
  command.add_option("--seconds", options.seconds, "of the motion")
      ->check(without_nan(CLI::Range(0.1, 600.0)))
      ->capture_default_str();
  command.add_option("--every-s", options.every_s, "seconds between two measurements")
      ->check(without_nan(CLI::Range(0.01, 60.0)))
      ->capture_default_str();
  command.add_option("--out", options.out, "folder for the CSV and the pictures")->required();
  add_sim_device_options(command, options.device);
}

void add_scalp_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<ScalpOptions>();
  CLI::App* command = app.add_subcommand(
      "scalp", "how much of the scalp shows between the hair in motion, and how far roots lean");
  declare_scalp(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
