// strandcast-report pruning: what is left out of each scene, what that saves, and that nothing is seen of it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "common/base/command_line_error.h"
#include "common/scene/scene_file.h"
#include "server/report/pruning.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

Result<std::vector<std::filesystem::path>> find_scenes(const PruningOptions& options) {
  std::error_code error;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(options.scenes, error)) {
    const std::string name = entry.path().stem().string();
    const bool is_wanted = options.only.empty() ||
                           std::find(options.only.begin(), options.only.end(), name) != options.only.end();
    if (entry.path().extension() == ".textproto" && is_wanted) paths.push_back(entry.path());
  }
  if (paths.empty())
    return make_error(ErrorCode::NotFound, "there is no scene in '{}' of these names",
                      options.scenes.string());
  std::sort(paths.begin(), paths.end());
  return paths;
}

Status run_command(const PruningOptions& options) {
  ASSIGN_OR_RETURN(const auto paths, find_scenes(options));
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  std::vector<PruningRun> runs;
  std::vector<FollowedRun> followed;
  for (const std::filesystem::path& path : paths) {
    PruningDesc desc;
    desc.motion = built_in_stream_motions()[1];
    desc.steps = options.steps;
    desc.has_pictures = options.has_pictures;
    const auto scene = load_scene(path, {});
    if (!scene) {
      fmt::print(stderr, "{}: {}\n", path.stem().string(), scene.error().to_string());
      continue;
    }
    desc.scene = *scene;
    auto run = run_pruning(desc, *executor);
    // Groom files are not shipped with the scenes that name them.
    if (!run && run.error().code == ErrorCode::NotFound) {
      fmt::print(stderr, "{}: left out: {}\n", path.stem().string(), run.error().to_string());
      continue;
    }
    if (!run) return run.error();
    runs.push_back(std::move(run).value());
    fmt::print(stderr, "{}: {} passes are left out\n", desc.scene.name, runs.back().passes.size());
    const bool has_volume = desc.scene.volume.acts();
    if (desc.scene.name != "default" && !has_volume) continue;
    for (const double share : options.shares) {
      std::vector<FollowedDesc> parts{{.share = share}, {.share = share, .has_every_vertex = false}};
      if (has_volume) parts.push_back({.share = share, .has_volume = true});
      for (const FollowedDesc& part : parts) {
        ASSIGN_OR_RETURN(FollowedRun measured, run_followed(desc, part, *executor));
        followed.push_back(std::move(measured));
      }
    }
  }
  fmt::print("{}", pruning_text(runs, followed));
  RETURN_IF_ERROR(save_text(options.out / "pruning.csv", pruning_csv(runs)));
  RETURN_IF_ERROR(save_text(options.out / "followed.csv", followed_csv(followed)));
  RETURN_IF_ERROR(save_text(options.out / "pruning.html", pruning_page(runs, followed)));
  fmt::print("{}\n", (options.out / "pruning.html").string());
  const std::vector<std::string> breaks = pruning_breaks(runs);
  for (const std::string& sentence : breaks) fmt::print(stderr, "{}\n", sentence);
  if (breaks.empty()) return {};
  return make_error(ErrorCode::Internal, "{} passes change what is seen though nobody asked for them",
                    breaks.size());
}

}  // namespace

void declare_pruning(CLI::App& command, PruningOptions& options) {
  command.add_option("--scenes", options.scenes, "folder of scene files")->capture_default_str();
  command.add_option("--scene", options.only, "only the scene of this name; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--share", options.shares, "of strands that are simulated; repeatable")
      ->expected(1)
      ->take_all()
      ->check(without_nan(CLI::Range(0.001, 1.0)));
  command.add_option("--steps", options.steps, "of each run")
      ->check(CLI::Range(10, 100'000))
      ->capture_default_str();
  command.add_flag("!--no-pictures", options.has_pictures, "compare no pictures");
  command.add_option("--out", options.out, "folder for the page and the CSV files")->required();
  add_sim_device_options(command, options.device);
}

void add_pruning_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<PruningOptions>();
  CLI::App* command = app.add_subcommand(
      "pruning", "what is left out of each scene, and what that saves, by running it both ways");
  declare_pruning(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
