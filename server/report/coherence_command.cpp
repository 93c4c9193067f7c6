// strandcast-report coherence: how a whole head of hair moves together.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "common/scene/scene_file.h"
#include "server/report/coherence_study.h"
#include "server/report/report_commands.h"
#include "server/report/report_files.h"
#include "server/report/report_options.h"

namespace strandcast {
namespace {

constexpr uint32_t kQuickStrands = 1000;

Result<SceneDesc> scene_of(const CoherenceOptions& options) {
  if (!options.scene_path.empty()) return load_scene(options.scene_path, options.overrides);
  std::vector<std::string> overrides;
  if (options.is_quick) overrides.push_back(fmt::format("groom.procedural.strand_count={}", kQuickStrands));
  overrides.insert(overrides.end(), options.overrides.begin(), options.overrides.end());
  return built_in_scene_with(overrides);
}

Status run_command(const CoherenceOptions& options) {
  CoherenceStudyDesc desc;
  ASSIGN_OR_RETURN(desc.scene, scene_of(options));
  desc.has_pictures = options.has_pictures;
  if (options.is_quick) {
    desc.rows = coherence_rows(false);
    desc.hold_s = 4.0;
    desc.moments = 10;
    desc.picture_size = {224, 224};
    desc.reality.step_rates_hz = {60.0, 960.0};
    desc.reality.lock_strands = 200;
    desc.reality.ponytails.ratios = {0.7, 1.0, 1.4};
    desc.reality.ponytails.step_rate_hz = 120.0;
    desc.reality.ponytails.tuft_strands = 60;
  }
  RETURN_IF_ERROR(make_report_folder(options.out));
  ASSIGN_OR_RETURN(const auto executor, open_executor(options.device));
  ASSIGN_OR_RETURN(const CoherenceStudy study,
                   run_coherence_study(desc, *executor,
                                       [](const std::string& part) { fmt::print(stderr, "{}\n", part); }));
  RETURN_IF_ERROR(save_coherence_study(study, options.out));
  fmt::print("{}{}\n", coherence_text(study), (options.out / kCoherencePage).string());
  return {};
}

}  // namespace

void declare_coherence(CLI::App& command, CoherenceOptions& options) {
  command.add_option("--scene", options.scene_path, "scene file; default: the built-in scene");
  command.add_option("--set", options.overrides, "path=value: override a field of the scene; repeatable")
      ->expected(1)
      ->take_all();
  command.add_flag("!--no-pictures", options.has_pictures, "draw no moments");
  command.add_flag("--quick", options.is_quick, "fewer strands, fewer rows and shorter runs");
  command.add_option("--out", options.out, "folder for the page, the plot and the CSV file")->required();
  add_sim_device_options(command, options.device);
}

void add_coherence_command(CLI::App& app, ReportAction& action) {
  const auto options = std::make_shared<CoherenceOptions>();
  CLI::App* command = app.add_subcommand(
      "coherence",
      "how a whole head of hair moves together in a shake, and hair in air beside what is known of it");
  declare_coherence(*command, *options);
  command->callback([options, &action] { action = [options] { return run_command(*options); }; });
}

}  // namespace strandcast
