// strandcast-view: shows the hair of a running server, in a window or (--headless) as pictures and a report.
#include <exception>
#include <iostream>
#include <thread>

#include "client/app/diagnose.h"
#include "client/app/recording_film.h"
#include "client/app/stop_signal.h"
#include "client/app/view_options.h"
#include "client/app/view_report.h"
#include "client/app/views.h"
#include "common/base/output_file.h"
#include "common/log/log.h"
#include "common/strands/head/head_mesh.h"

namespace {

using namespace strandcast;

constexpr int kMissingExit = 1;
constexpr int kBadInputExit = 2;

int fail(const std::string& sentence) {
  std::cerr << "strandcast-view: " << sentence << '\n';
  return kBadInputExit;
}

int run(int argc, char** argv) {
  const ViewCommandLine line = read_view_command_line(argc, argv);
  if (!line.options) return line.exit_code;
  const ViewOptions& options = *line.options;
  if (!init_log(options.log_level))
    return fail(
        fmt::format("unknown log level '{}' (known: error, warn, info, debug, off)", options.log_level));

  const auto& stop = catch_stop_signals();
  if (options.is_diagnosis) {
    const Diagnosis diagnosis = diagnose(options, stop);
    std::cout << to_text(diagnosis);
    return would_work(diagnosis) ? 0 : kMissingExit;
  }
  if (!options.film.empty()) {
    const auto made = run_film(options, stop);
    if (!made) return fail(made.error().to_string());
    std::cout << *made;
    return 0;
  }
  if (!options.recording.empty()) {
    const Status played = run_playback(options, stop);
    return played ? 0 : fail(played.error().to_string());
  }
  // While connecting: the asset names it.
  const std::jthread head_maker([] { make_head(1.0f); });
  auto report = options.is_headless ? run_headless(options, stop) : run_windowed(options, stop);
  if (!report) return fail(report.error().to_string());
  std::cout << to_summary(*report);
  const bool is_drawn = !stop;  // run_headless() draws nothing after that
  if (is_drawn && !options.screenshot.empty())
    std::cout << "  picture         " << options.screenshot.string() << '\n';
  if (is_drawn && !options.clip.empty()) std::cout << "  clip            " << options.clip.string() << '\n';
  if (options.report.empty()) return 0;
  const auto saved = save_report(options.report, *report);
  return saved ? 0 : fail(saved.error().to_string());
}

}  // namespace

int main(int argc, char** argv) {
  open_standard_files();
  try {
    return run(argc, argv);
  } catch (const std::exception& failure) {
    return fail(failure.what());
  }
}
