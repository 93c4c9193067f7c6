// strandcast-report collisions: what keeps hair out of head and body, by depth against time.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "common/scene/scene_file.h"
#include "server/report/collision_study.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

Status run_command(const CollisionOptions& options) {
  CollisionStudyDesc desc = options.desc;
  if (options.scene_path.empty()) {
    ASSIGN_OR_RETURN(desc.scene, built_in_scene_with(options.overrides));
  } else {
    ASSIGN_OR_RETURN(desc.scene, load_scene(options.scene_path, options.overrides));
  }
  if (options.is_quick) {
    desc.resolutions = {32, 64};
    desc.shake_steps = 30;
    desc.rest_steps = 120;
    desc.body_steps = 150;
    desc.body_rest_steps = 120;
  }
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  ASSIGN_OR_RETURN(const CollisionStudy study,
                   run_collision_study(desc, *executor,
                                       [](const std::string& part) { fmt::print(stderr, "{}\n", part); }));
  RETURN_IF_ERROR(save_collision_study(study, options.out));
  fmt::print("{}{}\n", collision_summary(study), (options.out / kCollisionPage).string());
  return {};
}

}  // namespace

void declare_collisions(CLI::App& command, CollisionOptions& options) {
  command.add_option("--scene", options.scene_path, "scene file; default: the built-in scene");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--motion", options.desc.clip,
                     "BVH file whose neck, chest, shoulders and arms are the body (default: built in)");
  add_motion_file_options(command, options.desc.clip_options);
  command.add_flag("!--no-pictures", options.desc.has_pictures, "draw no moments");
  command.add_flag("--quick", options.is_quick, "fewer fields and shorter runs");
  command.add_option("--out", options.out, "folder for the page, the plots and the CSV files")->required();
  add_sim_device_options(command, options.device);
}

void add_collisions_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<CollisionOptions>();
  CLI::App* command = app.add_subcommand(
      "collisions",
      "what keeps hair out of the head (spheres, fields) and how it answers to a body: depth against time");
  declare_collisions(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
