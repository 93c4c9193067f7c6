#include "client/app/export_command.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <utility>

#include "client/app/ctl_commands.h"
#include "client/app/drawn_states.h"
#include "client/app/live_states.h"
#include "client/app/recorded_states.h"
#include "client/export/export_strands.h"
#include "common/base/command_line_error.h"

namespace strandcast {
namespace {

constexpr double kUsualUnitM = 0.01;
constexpr double kMostSeconds = 86'400.0;

std::string size_text(uint64_t bytes) {
  constexpr double kBytesPerMb = 1e6;
  return fmt::format("{:.1f} MB", static_cast<double>(bytes) / kBytesPerMb);
}

bool is_timecode(const std::string& text) {
  return text.find(':') != std::string::npos;
}

/// Seconds within a day; a timecode's rate is known later.
std::optional<double> seconds_of(const std::string& text) {
  double seconds = 0.0;
  const bool is_number = CLI::detail::lexical_cast(text, seconds);
  return is_number && seconds >= 0.0 && seconds <= kMostSeconds ? std::optional(seconds) : std::nullopt;
}

std::string trouble_of_moment(const std::string& text) {
  if (is_timecode(text) || seconds_of(text)) return {};
  return fmt::format("{} is neither a timecode (01:02:03:04) nor within 0..{:.0f} seconds", text,
                     kMostSeconds);
}

/// From metres with +Y up to the unit and axis of the file.
glm::dmat4 file_from_metres(const ExportOptions& options) {
  const glm::dmat3 turn =
      options.up == ExportUp::Z ? glm::dmat3(1, 0, 0, 0, 0, 1, 0, -1, 0) : glm::dmat3(1.0);
  return glm::dmat4(turn / options.unit_m);
}

/// In the unit and axes of the hair's files where the command states neither; then in their place too, in the
/// head's space and where curves move the head. These have it in any unit.
void follow_files(const HairOrigin& origin, const ExportCommand& command, ExportOptions& options) {
  if (!command.unit) options.unit_m = origin.unit_m;
  if (!command.up) options.up = origin.is_z_up ? ExportUp::Z : ExportUp::Y;
  if (!command.unit && !command.up && (options.space == ExportSpace::Head || origin.is_world_at_rest))
    options.file_from_space = origin.file_from_head;
  else if (options.space == ExportSpace::World && origin.is_world_at_rest) {
    const glm::dmat3 head_from_file = glm::inverse(glm::dmat3(origin.file_from_head));
    glm::dmat4 placed(1.0);
    placed[3] = glm::dvec4(head_from_file * glm::dvec3(origin.file_from_head[3]), 1.0);
    options.file_from_space = file_from_metres(options) * placed;
  }
}

struct OpenedSource {
  std::unique_ptr<ExportSource> states;
  SceneDesc scene;  // only where a file of its hair is named
  LookDesc look;
};

/// From a recording where one is named, else from the server.
Result<OpenedSource> open_source(const CtlTarget& target, const ExportCommand& command,
                                 const std::atomic<bool>& stop) {
  if (command.paths.size() > 1) {
    ASSIGN_OR_RETURN(auto recorded, RecordedStates::open(command.paths.front()));
    const SceneDesc scene = recorded->simulated();
    const LookDesc look = recorded->look().look;
    return OpenedSource{std::move(recorded), scene, look};
  }
  SceneDesc scene;
  if (!command.grooms.empty()) {
    ASSIGN_OR_RETURN(scene, ask_scene(target));
  }
  ASSIGN_OR_RETURN(const ClientConfig config, client_config_for(target, Role::Viewer));
  ASSIGN_OR_RETURN(auto live, LiveStates::open(config, stop));
  const LookDesc look = live->look();
  return OpenedSource{std::move(live), scene, look};
}

/// How the scene reads its files, with those that are named in their place.
Result<FileGroomDesc> named_files(const SceneDesc& scene, const std::vector<std::string>& grooms) {
  const auto* const file = std::get_if<FileGroomDesc>(&scene.groom);
  if (file == nullptr)
    return make_error(ErrorCode::BadInput, "this hair was grown, and comes of no file: leave --groom out");
  FileGroomDesc named = *file;
  named.path = grooms.front();
  named.more_paths.assign(grooms.begin() + 1, grooms.end());
  return named;
}

Result<ExportReport> export_with(const CtlTarget& target, const ExportCommand& command,
                                 const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(ExportOptions options, export_options(command));
  ASSIGN_OR_RETURN(OpenedSource source, open_source(target, command, stop));
  std::optional<HairOrigin> origin;
  if (!command.grooms.empty()) {
    ASSIGN_OR_RETURN(const FileGroomDesc files, named_files(source.scene, command.grooms));
    ASSIGN_OR_RETURN(origin, load_origin(files, *source.states->scene().asset));
  }
  return export_dressed(std::move(source.states), {origin, source.look}, command, options, stop);
}

}  // namespace

void print_export(const ExportReport& report, std::string_view clock) {
  const std::string frames =
      report.frame_count == 1
          ? fmt::format("the frame at {:.3f} s{}", report.first_s, clock)
          : fmt::format(
                "{} frames at {} fps from {}{:.3f} s{} on", report.frame_count, frame_rate_text(report.fps),
                report.first_timecode.empty() ? "" : report.first_timecode + ", ", report.first_s, clock);
  std::cout << fmt::format(
      "{} strands x {} vertices, {}, {} in {}{}\n", report.strand_count, report.vertex_count, frames,
      size_text(report.bytes),
      report.file_count == 1 ? std::string() : fmt::format("{} files up to ", report.file_count),
      report.last_path.string());
  for (const std::string& remark : report.remarks) std::cout << "  " << remark << '\n';
}

void declare_export(CLI::App& app, ExportCommand& command) {
  app.add_option("paths", command.paths,
                 "[RECORDING.mcap] OUT.usda, .usdc, .usdz, .abc, .csv or .ply (one frame, or numbered files "
                 "of a range): what was recorded, or what the "
                 "server sends from now on; a file of the second name is replaced")
      ->required()
      ->expected(1, 2);
  app.add_option(
         "--groom", command.grooms,
         "File of the hair, repeatable: ids, groups, names, widths, coordinates, unit and axes come from it")
      ->expected(1)
      ->take_all()
      ->allow_extra_args(false);
  declare_export_options(app, command);
}

void declare_export_options(CLI::App& app, ExportCommand& command) {
  app.add_option("--fps", command.fps,
                 "Frames per second, such as 24, 23.976 or 24000/1001 (default: those of the states' "
                 "timecode, else 30)")
      ->check(CLI::Validator(
          [](std::string text) { return make_frame_rate(text, kLeastFrameRate, kMostFrameRate); }, ""));
  app.add_option("--units", command.unit, "Unit of the file (default: that of the hair's file, else cm)")
      ->check(CLI::IsMember({"cm", "m"}));
  app.add_option(
         "--up", command.up,
         "Up axis of the file, with the face at +Z, or at -Y where Z is up (default: as the hair's file "
         "has it, else y)")
      ->check(CLI::IsMember({"y", "z"}));
  app.add_option("--space", command.space,
                 "head: as seen from the head, which stands still (the default); world: with its motion")
      ->check(CLI::IsMember({"head", "world"}));
  app.add_flag("--guides", command.is_guides,
               "Tell Unreal that these strands guide others, and are not drawn");
  app.add_flag(
      "--drawn", command.is_drawn,
      "Strands as viewers draw them, with followers, style and taper, instead of the simulated ones");
  app.add_flag("--followers", command.has_followers,
               "Simulated strands as guides, and the strands that viewers draw between them as hair");
  app.add_flag("--head", command.has_head, "The head, too, as a mesh with its neck at rest; not for .csv");
  const auto seconds = without_nan(CLI::Range(0.0, kMostSeconds));
  const CLI::Validator moment([](const std::string& text) { return trouble_of_moment(text); }, "");
  app.add_option("--from", command.from,
                 "Begin so many seconds after the first state, or at a timecode that it carries: 01:02:03:04")
      ->check(moment);
  app.add_option("--to", command.to, "End so many seconds after the first state, or at a timecode")
      ->check(moment);
  app.add_option("--seconds", command.seconds,
                 "Length in seconds (default: to the end of the recording, or until stopped; what was "
                 "written by then is whole)")
      ->check(seconds);
  app.add_option("--at", command.at_s, "One frame alone, so many seconds after the first state (.ply)")
      ->check(seconds);
}

Result<ExportOptions> export_options(const ExportCommand& command) {
  ExportOptions options;
  options.path = command.paths.back();
  if (command.fps) {
    ASSIGN_OR_RETURN(options.fps, parse_frame_rate(*command.fps));
    options.has_fps = true;
  }
  options.unit_m = command.unit == "m" ? 1.0 : kUsualUnitM;
  options.up = command.up == "z" ? ExportUp::Z : ExportUp::Y;
  options.space = command.space == "world" ? ExportSpace::World : ExportSpace::Head;
  options.role = command.has_followers ? ExportRole::Followers
                 : command.is_guides   ? ExportRole::Guides
                                       : ExportRole::Strands;
  if (command.is_guides && command.has_followers)
    return make_error(ErrorCode::BadInput,
                      "--followers has guides and hair, --guides has guides alone: give one");
  options.has_head = command.has_head;
  const bool is_range = command.from || command.to || command.seconds || command.fps;
  if (command.at_s && is_range)
    return make_error(ErrorCode::BadInput,
                      "--at is one frame: --fps, --from, --to and --seconds say nothing of it");
  const std::string from = command.from.value_or(""), to = command.to.value_or("");
  if (command.to && command.seconds)
    return make_error(ErrorCode::BadInput, "--to and --seconds both say where it ends: give one of them");
  if (command.from && command.to && is_timecode(from) != is_timecode(to))
    return make_error(ErrorCode::BadInput, "--from and --to are both seconds, or both timecodes");
  if (is_timecode(from)) options.from_timecode = from;
  if (is_timecode(to)) options.to_timecode = to;
  options.from_s = command.at_s.value_or(seconds_of(from).value_or(0.0));
  if (command.seconds) options.to_s = options.from_s + *command.seconds;
  if (command.to && !is_timecode(to)) options.to_s = seconds_of(to);
  // A file holds one frame of .ply: a sequence is asked for.
  options.is_one_frame = command.at_s || (options.path.extension() == ".ply" && !is_range);
  RETURN_IF_ERROR(check_export(options));
  return options;
}

Result<ExportReport> export_dressed(std::unique_ptr<ExportSource> states, const ExportDress& dress,
                                    const ExportCommand& command, ExportOptions options,
                                    const std::atomic<bool>& stop) {
  if (dress.origin) {
    follow_files(*dress.origin, command, options);
    states = with_origin(std::move(states), dress.origin->strands);
  }
  if (command.is_drawn || command.has_followers) {
    ASSIGN_OR_RETURN(states, as_drawn(std::move(states), dress.look));
  }
  return export_strands(*states, options, stop);
}

int run_export(const CtlTarget& target, const ExportCommand& command, const std::atomic<bool>& stop) {
  const auto report = export_with(target, command, stop);
  if (!report) return ctl_failure(report.error());
  print_export(*report, " of the server's time");
  return kDoneExit;
}

}  // namespace strandcast
