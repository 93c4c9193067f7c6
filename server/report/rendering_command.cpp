// strandcast-report rendering: every way to draw a scene's hair, its time, and how far it is from the truth.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>

#include "common/scene/scene_file.h"
#include "server/report/rendering.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

Status run_command(const RenderingOptions& options) {
  RenderingReportDesc desc = options.desc;
  if (std::sscanf(options.size.c_str(), "%ux%u", &desc.size.width, &desc.size.height) != 2 ||
      desc.size.width == 0 || desc.size.height == 0)
    return make_error(ErrorCode::BadInput, "--size is {} but must look like 640x360", options.size);
  ASSIGN_OR_RETURN(desc.scene, options.scene_path.empty()
                                   ? built_in_scene_with(options.overrides)
                                   : load_scene(options.scene_path, options.overrides));
  RETURN_IF_ERROR(make_report_folder(options.out));
  desc.on_progress = [](const std::string& doing) { fmt::print(stderr, "rendering: {}\n", doing); };
  ASSIGN_OR_RETURN(const RenderingReport report, run_rendering(desc));
  fmt::print("{}", rendering_text(report));
  RETURN_IF_ERROR(save_text(options.out / "rendering.csv", rendering_csv(report)));
  RETURN_IF_ERROR(save_text(options.out / "rendering.html", rendering_page(desc, report)));
  for (const RenderingOutcome& row : report.rows) {
    if (!row.trouble.empty()) continue;
    std::string name = row.name;
    for (char& c : name)
      if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
    RETURN_IF_ERROR(save_png(options.out / ("rendering_" + name + ".png"), row.near.picture));
  }
  fmt::print("{}\n", (options.out / "rendering.html").string());
  return {};
}

}  // namespace

void declare_rendering(CLI::App& command, RenderingOptions& options) {
  command.add_option("--scene", options.scene_path, "scene file; default: the built-in scene");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_option("--size", options.size, "of the pictures")->capture_default_str();
  command.add_option("--rounds", options.desc.rounds, "turns of each way; the median counts")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      .add_option("--gpu,--gl-device", options.desc.gl_device, "auto, software, hardware or a device number")
      ->capture_default_str();
  command.add_option("--out", options.out, "folder for the page, the CSV and the pictures")->required();
}

void add_rendering_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<RenderingOptions>();
  CLI::App* command =
      app.add_subcommand("rendering", "error against time of every way to draw hair, with pictures");
  declare_rendering(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
