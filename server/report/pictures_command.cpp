// strandcast-report pictures: our pictures beside a path tracer's.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/scene/scene_file.h"
#include "server/report/pictures_study.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

Status run_command(const PicturesOptions& options) {
  PicturesDesc desc = options.desc;
  if (desc.is_keeping && !desc.has_blender)
    return make_error(ErrorCode::BadInput, "--keep keeps what --blender makes: give both");
  if (!options.scene_path.empty()) {
    ASSIGN_OR_RETURN(desc.scene, load_scene(options.scene_path, options.overrides));
  } else if (!options.overrides.empty()) {
    ASSIGN_OR_RETURN(desc.scene, built_in_scene_with(options.overrides));
  }
  RETURN_IF_ERROR(make_report_folder(options.out));
  desc.scratch = options.out / "cycles";
  desc.cycles.script = default_truth_folder() / "cycles.py";
  desc.on_progress = [](const std::string& doing) { fmt::print(stderr, "pictures: {}\n", doing); };
  ASSIGN_OR_RETURN(const PicturesReport report, run_pictures(desc));
  fmt::print("{}", pictures_text(report));
  RETURN_IF_ERROR(save_text(options.out / "pictures.csv", pictures_csv(report)));
  RETURN_IF_ERROR(save_text(options.out / "pictures.html", pictures_page(report)));
  fmt::print("{}\n", (options.out / "pictures.html").string());
  return {};
}

}  // namespace

void declare_pictures(CLI::App& command, PicturesOptions& options) {
  PicturesDesc& desc = options.desc;
  command.add_option("--scene", options.scene_path, "scene file of other hair, with --blender");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--only", desc.only, "name of a view; repeatable; default: all")
      ->expected(1)
      ->take_all();
  command.add_flag("--methods", desc.has_methods, "draw some of the views by every method of shading, too");
  command.add_option("--truths", desc.truths, "folder of kept truths")->capture_default_str();
  command.add_flag("--blender", desc.has_blender,
                   "path-trace new truths by Blender, which takes a minute each");
  command.add_option("--blender-program", desc.cycles.program, "Blender 3.4")->capture_default_str();
  command.add_option("--samples", desc.cycles.samples, "of Blender, in a pixel")
      ->check(CLI::Range(1, 65536))
      ->capture_default_str();
  command.add_option("--threads", desc.cycles.threads, "of Blender")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.add_flag("--keep", desc.is_keeping, "keep the new truths in --truths");
  command.add_option("--rounds", desc.rounds, "times that each picture is drawn; the median time counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option("--gpu,--gl-device", desc.gl_device,
                  "of --methods: auto, software, hardware or a device number")
      ->capture_default_str();
  command.add_option("--out", options.out, "folder for the page and the CSV")->required();
}

void add_pictures_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<PicturesOptions>();
  CLI::App* command = app.add_subcommand("pictures", "how near pictures are to those of a path tracer");
  declare_pictures(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
