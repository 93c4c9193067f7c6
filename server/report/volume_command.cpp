// strandcast-report volume: error against time of hair that acts on hair.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "common/scene/scene_file.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"
#include "server/report/volume_study.h"

namespace strandcast {
namespace {

/// Hairs of the built-in scene where all are looked at.
constexpr uint32_t kAllHairs = 12'000;

Result<SceneDesc> scene_of(const VolumeReportOptions& options) {
  if (!options.scene_path.empty()) return load_scene(options.scene_path, options.overrides);
  // Hair that hangs: a style that is kept shows less of what a volume does.
  std::vector<std::string> overrides = {fmt::format("groom.procedural.strand_count={}", kAllHairs),
                                        "solver.parameters.sag_free=0.3"};
  overrides.insert(overrides.end(), options.overrides.begin(), options.overrides.end());
  return built_in_scene_with(overrides);
}

Status run_command(const VolumeReportOptions& options) {
  VolumeStudyDesc desc;
  ASSIGN_OR_RETURN(desc.scene, scene_of(options));
  desc.guide_count = options.guides;
  if (options.is_quick) {
    desc.seconds = 0.5;
    desc.moments = 2;
    desc.rounds = 2;
    desc.resolutions = {16, 32, 64};
    desc.smoothings = {0, 1};
    desc.intervals = {1, 2};
    desc.shake_s = 4.0;
    desc.hold_s = 6.0;
    desc.look_s = 1.0;
  }
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  ASSIGN_OR_RETURN(const VolumeStudy study,
                   run_volume_study(desc, *executor, options.device.gl_device,
                                    [](const std::string& part) { fmt::print(stderr, "{}\n", part); }));
  RETURN_IF_ERROR(save_volume_study(study, options.out));
  fmt::print("{}{}\n", volume_summary(study), (options.out / kVolumePage).string());
  return {};
}

}  // namespace

void declare_volume(CLI::App& command, VolumeReportOptions& options) {
  command.add_option("--scene", options.scene_path,
                     fmt::format("scene file; default: the built-in scene with {} hairs", kAllHairs));
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--guides", options.guides, "of its hairs that are simulated where only guides are")
      ->check(CLI::Range(1u, 1'000'000u))
      ->capture_default_str();
  command.add_flag("--quick", options.is_quick, "fewer volumes and shorter runs");
  command.add_option("--out", options.out, "folder for the page, the plot and the CSV files")->required();
  add_sim_device_options(command, options.device);
}

void add_volume_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<VolumeReportOptions>();
  CLI::App* command = app.add_subcommand(
      "volume",
      "hair that acts on hair: what a volume knows of it against what it takes, and how hair lies with it");
  declare_volume(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
