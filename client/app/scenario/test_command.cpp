#include "client/app/scenario/test_command.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <iostream>
#include <mutex>
#include <thread>

#include "client/app/ctl_commands.h"
#include "client/app/scenario/scenario_run.h"
#include "common/base/file.h"
#include "common/scene/scenario_file.h"

namespace strandcast {
namespace {

/// Refuses two scenarios of one name, because they would write over each other's files.
Status check_names(const std::vector<Scenario>& scenarios) {
  for (size_t i = 0; i < scenarios.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if (scenarios[i].name == scenarios[j].name)
        return make_error(ErrorCode::BadInput, "two scenarios have the name '{}'", scenarios[i].name);
  return {};
}

using PrintLine = std::function<void(const std::string&)>;

/// All runs of one scenario; the states that their steps lead to must be the same.
ScenarioResult run_scenario(const Scenario& scenario, const ScenarioOptions& options,
                            const PrintLine& print) {
  print(scenario.name + (scenario.about.empty() ? "" : ": ") + scenario.about);
  const auto tell = [&](const CheckResult& check) { print(to_line(check)); };
  ScenarioResult result;
  for (uint32_t i = 0; i < scenario.repeat; ++i) {
    if (scenario.repeat > 1) print(fmt::format("  run {} of {}", i + 1, scenario.repeat));
    ScenarioResult next = ScenarioRun(scenario, options, tell).run();
    if (i == 0) {
      result = std::move(next);
      continue;
    }
    const bool is_same = !result.hashes.empty() && next.hashes == result.hashes;
    const CheckResult check{0,
                            fmt::format("states of run {}", i + 1),
                            "those of the first run",
                            is_same
                                ? fmt::format("are, after each of {} actions of steps", next.hashes.size())
                            : next.hashes.empty() ? std::string("no step led to a state")
                                                  : std::string("are others"),
                            is_same,
                            0.0};
    tell(check);
    result.seconds += next.seconds;
    result.is_file_wrong = result.is_file_wrong || next.is_file_wrong;
    result.checks.insert(result.checks.end(), next.checks.begin(), next.checks.end());
    result.checks.push_back(check);
  }
  if (result.checks.empty() && !*options.stop) {
    print(fmt::format("{}: nothing is expected in it: add expect or refuse", result.name));
    result.is_file_wrong = true;
  } else {
    print(fmt::format("{}: {} of {} checks hold, {:.1f} s", result.name,
                      result.checks.size() - result.failed_count(), result.checks.size(), result.seconds));
  }
  return result;
}

/// Runs them, `jobs` at the same time; those that did not begin before the stop are left out. The lines of
/// one scenario stand together.
std::vector<ScenarioResult> run_all(const std::vector<Scenario>& scenarios, const ScenarioOptions& options,
                                    uint32_t jobs) {
  std::vector<std::optional<ScenarioResult>> done(scenarios.size());
  std::atomic<size_t> next = 0;
  std::mutex printing;
  const auto work = [&] {
    for (size_t i = next++; i < scenarios.size() && !*options.stop; i = next++) {
      std::string lines;
      const auto keep = [&](const std::string& line) { lines += line + '\n'; };
      const auto show = [](const std::string& line) { std::cout << line << std::endl; };
      done[i] = run_scenario(scenarios[i], options, jobs > 1 ? PrintLine(keep) : PrintLine(show));
      const std::lock_guard lock(printing);
      std::cout << lines << std::flush;
    }
  };
  {
    std::vector<std::jthread> workers;
    for (uint32_t i = 1; i < jobs; ++i) workers.emplace_back(work);
    work();
  }
  std::vector<ScenarioResult> results;
  for (auto& result : done)
    if (result) results.push_back(std::move(*result));
  return results;
}

/// When the files and the server program were written last.
/// The files that scenarios read, but for those that --renew writes. Words for motion and wind are no files.
void add_read_files(const std::filesystem::path& scenario, std::vector<std::filesystem::path>& paths) {
  const auto loaded = load_scenario(scenario);
  if (!loaded) return;
  for (const ScenarioAction& action : loaded->actions) {
    if (const auto* start = std::get_if<ScenarioStart>(&action.work)) paths.push_back(start->scene);
    if (const auto* feed = std::get_if<ScenarioFeed>(&action.work))
      paths.insert(paths.end(), {feed->motion, feed->wind});
    if (const auto* send = std::get_if<ScenarioSend>(&action.work))
      paths.insert(paths.end(), send->files.begin(), send->files.end());
  }
}

std::vector<std::filesystem::file_time_type> written_times(const TestOptions& options,
                                                           const std::filesystem::path& server) {
  const auto files = scenario_files(options.scenarios);
  std::vector<std::filesystem::path> paths = files ? *files : options.scenarios;
  for (const std::filesystem::path& scenario : std::vector(paths)) add_read_files(scenario, paths);
  if (!server.empty()) paths.push_back(server);
  std::vector<std::filesystem::file_time_type> times;
  std::error_code is_gone;
  for (const std::filesystem::path& path : paths)
    times.push_back(std::filesystem::last_write_time(path, is_gone));
  return times;
}

Result<std::vector<Scenario>> load_all(const TestOptions& options) {
  const auto files = scenario_files(options.scenarios);
  if (!files) return files.error();
  std::vector<Scenario> scenarios;
  for (const std::filesystem::path& path : *files) {
    auto scenario = load_scenario(path);
    if (!scenario) return scenario.error();
    scenarios.push_back(std::move(scenario).value());
  }
  if (const Status status = check_names(scenarios); !status) return status.error();
  return scenarios;
}

/// Loads all files and runs them once.
int run_round(const TestOptions& options, const ScenarioOptions& run) {
  const auto loaded = load_all(options);
  if (!loaded) return ctl_failure(loaded.error());
  const std::vector<Scenario>& scenarios = *loaded;
  const std::vector<ScenarioResult> results = run_all(scenarios, run, options.jobs);
  if (!options.junit.empty()) {
    const std::string xml = to_junit(results);
    if (const Status saved = save_file(options.junit, std::as_bytes(std::span(xml))); !saved)
      return ctl_failure(saved.error());
  }
  size_t failed = 0;
  for (const ScenarioResult& result : results) failed += result.failed_count() > 0;
  if (results.size() > 1)
    std::cout << fmt::format("{} of {} scenarios hold\n", results.size() - failed, results.size());
  if (failed > 0) std::cout << fmt::format("what failed: {}\n", options.out.string());
  const auto is_wrong = [](const ScenarioResult& result) { return result.is_file_wrong; };
  if (std::any_of(results.begin(), results.end(), is_wrong)) return kBadInputExit;
  return failed == 0 && results.size() == scenarios.size() ? kDoneExit : kRefusedExit;
}

}  // namespace

Result<std::vector<std::filesystem::path>> scenario_files(const std::vector<std::filesystem::path>& given) {
  std::vector<std::filesystem::path> files;
  std::error_code failure;
  for (const std::filesystem::path& path : given) {
    if (!std::filesystem::is_directory(path, failure)) {
      files.push_back(path);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator(path, failure))
      if (entry.path().extension() == ".textproto" && entry.is_regular_file(failure))
        inside.push_back(entry.path());
    if (inside.empty())
      return make_error(ErrorCode::NotFound, "there is no .textproto in the folder {}", path.string());
    std::sort(inside.begin(), inside.end());
    files.insert(files.end(), inside.begin(), inside.end());
  }
  return files;
}

int run_test(const CtlTarget& target, const TestOptions& options, const std::atomic<bool>& stop) {
  // Files first: a typing error must not need a server to be found.
  if (const auto loaded = load_all(options); !loaded) return ctl_failure(loaded.error());
  ScenarioOptions run{{}, {}, options.out, options.renews_goldens, &stop};
  if (options.uses_running) {
    if (options.jobs > 1)
      return ctl_failure(make_error(ErrorCode::BadInput,
                                    "one server that runs already takes one scenario at a time: no --jobs"));
    run.running = target;
  } else {
    auto server = find_server_program(options.server);
    if (!server) return ctl_failure(server.error());
    run.server = std::move(server).value();
  }
  constexpr std::chrono::milliseconds kLookAgain{200};
  while (true) {
    const auto times = written_times(options, run.server);
    const int outcome = run_round(options, run);
    if (stop) std::cout << "stopped\n";
    if (stop || !options.is_watching) return outcome;
    std::cout << "waiting for a change (Ctrl-C ends)" << std::endl;
    while (!stop && written_times(options, run.server) == times) std::this_thread::sleep_for(kLookAgain);
    if (stop) return outcome;
  }
}

}  // namespace strandcast
