#include "client/app/scenario/test_command.h"

#include <iostream>

#include "client/app/ctl_commands.h"
#include "client/app/scenario/scenario_run.h"
#include "common/base/file.h"
#include "common/scene/scenario_file.h"

namespace strandcast {
namespace {

Result<std::filesystem::path> find_server(const TestOptions& options) {
  std::error_code failure;
  std::filesystem::path path = options.server;
  if (path.empty())
    path = std::filesystem::read_symlink("/proc/self/exe", failure).parent_path() / "strandcast-server";
  if (std::filesystem::is_regular_file(path, failure)) return std::filesystem::absolute(path, failure);
  return make_error(ErrorCode::NotFound, "there is no server program {}: name it with --server PATH",
                    path.string());
}

/// Scenarios of the same name would write over each other.
Status check_names(const std::vector<Scenario>& scenarios) {
  for (size_t i = 0; i < scenarios.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      if (scenarios[i].name == scenarios[j].name)
        return make_error(ErrorCode::BadInput, "two scenarios have the name '{}'", scenarios[i].name);
  return {};
}

/// All runs of one scenario; the states that their steps lead to must be the same.
ScenarioResult run_scenario(const Scenario& scenario, const ScenarioOptions& options) {
  const auto print = [](const CheckResult& check) { std::cout << to_line(check) << std::endl; };
  ScenarioResult result;
  for (uint32_t i = 0; i < scenario.repeat; ++i) {
    if (scenario.repeat > 1) std::cout << fmt::format("  run {} of {}\n", i + 1, scenario.repeat);
    ScenarioResult next = ScenarioRun(scenario, options, print).run();
    if (i == 0) {
      result = std::move(next);
      continue;
    }
    const bool is_same = !result.hashes.empty() && next.hashes == result.hashes;
    const CheckResult check{0,
                            fmt::format("states of run {}", i + 1),
                            "those of the first run",
                            is_same               ? fmt::format("are, after {} steps", next.hashes.size())
                            : next.hashes.empty() ? std::string("no step led to a state")
                                                  : std::string("are others"),
                            is_same,
                            0.0};
    print(check);
    result.seconds += next.seconds;
    result.checks.insert(result.checks.end(), next.checks.begin(), next.checks.end());
    result.checks.push_back(check);
  }
  return result;
}

}  // namespace

int run_test(const CtlTarget& target, const TestOptions& options, const std::atomic<bool>& stop) {
  // Files first: a typing error must not need a server to be found.
  std::vector<Scenario> scenarios;
  for (const std::filesystem::path& path : options.scenarios) {
    auto scenario = load_scenario(path);
    if (!scenario) return ctl_failure(scenario.error());
    scenarios.push_back(std::move(scenario).value());
  }
  if (const Status status = check_names(scenarios); !status) return ctl_failure(status.error());
  ScenarioOptions run{{}, {}, options.out, options.renews_goldens, &stop};
  if (options.uses_running) {
    run.running = target;
  } else {
    auto server = find_server(options);
    if (!server) return ctl_failure(server.error());
    run.server = std::move(server).value();
  }
  std::vector<ScenarioResult> results;
  size_t failed = 0;
  for (const Scenario& scenario : scenarios) {
    if (stop) break;
    std::cout << scenario.name << (scenario.about.empty() ? "" : ": ") << scenario.about << std::endl;
    results.push_back(run_scenario(scenario, run));
    const ScenarioResult& result = results.back();
    failed += result.failed_count();
    std::cout << fmt::format("{}: {} of {} checks hold, {:.1f} s\n", result.name,
                             result.checks.size() - result.failed_count(), result.checks.size(),
                             result.seconds);
  }
  if (!options.junit.empty()) {
    const std::string xml = to_junit(results);
    if (const Status saved = save_file(options.junit, std::as_bytes(std::span(xml))); !saved)
      return ctl_failure(saved.error());
  }
  if (failed > 0) std::cout << fmt::format("what failed: {}\n", options.out.string());
  if (stop) std::cout << "stopped\n";
  return failed == 0 && !stop ? kDoneExit : kRefusedExit;
}

}  // namespace strandcast
