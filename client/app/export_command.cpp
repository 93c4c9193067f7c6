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

/// From a recording where one is named, else from the server.
Result<std::unique_ptr<ExportSource>> open_source(const CtlTarget& target, const ExportCommand& command,
                                                  const std::atomic<bool>& stop) {
  if (command.paths.size() > 1) {
    ASSIGN_OR_RETURN(auto recorded, RecordedStates::open(command.paths.front()));
    const LookDesc look = recorded->look().look;
    if (command.is_drawn) return as_drawn(std::move(recorded), look);
    return std::unique_ptr<ExportSource>(std::move(recorded));
  }
  ASSIGN_OR_RETURN(const ClientConfig config, client_config_for(target, Role::Viewer));
  ASSIGN_OR_RETURN(auto live, LiveStates::open(config, stop));
  const LookDesc look = live->look();
  if (command.is_drawn) return as_drawn(std::move(live), look);
  return std::unique_ptr<ExportSource>(std::move(live));
}

}  // namespace

void print_export(const ExportReport& report) {
  const std::string frames =
      report.frame_count == 1
          ? fmt::format("the frame at {:.3f} s", report.first_s)
          : fmt::format("{} frames at {} fps from {}{:.3f} s on", report.frame_count,
                        frame_rate_text(report.fps),
                        report.first_timecode.empty() ? "" : report.first_timecode + ", ", report.first_s);
  std::cout << fmt::format(
      "{} strands x {} vertices, {}, {} in {}{}\n", report.strand_count, report.vertex_count, frames,
      size_text(report.bytes),
      report.file_count == 1 ? std::string() : fmt::format("{} files up to ", report.file_count),
      report.last_path.string());
  for (const std::string& remark : report.remarks) std::cout << "  " << remark << '\n';
}

void declare_export(CLI::App& app, ExportCommand& command) {
  app.add_option(
         "paths", command.paths,
         "[RECORDING.mcap] OUT.usda, .usdc, .usdz, .abc, .ply or .csv: what was recorded, or what the "
         "server sends from now on; a file of the second name is replaced")
      ->required()
      ->expected(1, 2);
  declare_export_options(app, command);
}

void declare_export_options(CLI::App& app, ExportCommand& command) {
  app.add_option("--fps", command.fps,
                 "Frames per second, such as 24, 23.976 or 24000/1001 (default: those of the states' "
                 "timecode, else 30)")
      ->check(CLI::Validator(
          [](std::string text) { return make_frame_rate(text, kLeastFrameRate, kMostFrameRate); }, ""));
  app.add_option("--units", command.unit, "Unit of the file")
      ->check(CLI::IsMember({"cm", "m"}))
      ->capture_default_str();
  app.add_option("--up", command.up, "Up axis of the file; the face looks to +Z, or to -Y where Z is up")
      ->check(CLI::IsMember({"y", "z"}))
      ->capture_default_str();
  app.add_option("--space", command.space,
                 "head: as seen from the head, which stands still; world: with its motion")
      ->check(CLI::IsMember({"head", "world"}))
      ->capture_default_str();
  app.add_flag("--guides", command.is_guides,
               "Tell Unreal that these strands guide others, and are not drawn");
  app.add_flag(
      "--drawn", command.is_drawn,
      "Strands as viewers draw them, with followers, style and taper, instead of the simulated ones");
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
  options.unit = command.unit == "m" ? ExportUnit::Metre : ExportUnit::Centimetre;
  options.up = command.up == "z" ? ExportUp::Z : ExportUp::Y;
  options.space = command.space == "world" ? ExportSpace::World : ExportSpace::Head;
  options.role = command.is_guides ? ExportRole::Guides : ExportRole::Strands;
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
  if (is_timecode(from) && command.seconds)
    return make_error(ErrorCode::BadInput, "behind a timecode --to says the end, as a timecode");
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

int run_export(const CtlTarget& target, const ExportCommand& command, const std::atomic<bool>& stop) {
  const auto options = export_options(command);
  if (!options) return ctl_failure(options.error());
  const auto source = open_source(target, command, stop);
  if (!source) return ctl_failure(source.error());
  const auto report = export_strands(**source, *options, stop);
  if (!report) return ctl_failure(report.error());
  print_export(*report);
  return kDoneExit;
}

}  // namespace strandcast
