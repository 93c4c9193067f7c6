#include "client/app/scenario/scene_recording.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "client/app/scenario/scenario_run.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

constexpr double kStartLimitS = 120.0;
constexpr double kPatienceS = 60.0;            // with a machine that is busy: no state is left out
constexpr std::string_view kKeyframeS = "10";  // a player steps so far to any moment
constexpr double kLimitPerSecond = 120.0;      // a scene that is simulated so much slower than in real time

bool is_scene_file(const std::filesystem::path& path) {
  return path.empty() || path.extension() == ".textproto";
}

Result<Scenario> scenario_of(const SceneRecordingOptions& options, const std::filesystem::path& out) {
  ScenarioStart start;
  start.is_lockstep = true;
  start.overrides = options.overrides;
  start.options = {"--record", out.string(), "--record-exact", std::string(kKeyframeS)};
  const bool has_scene_file = is_scene_file(options.scene) && !options.scene.empty();
  if (has_scene_file) start.scene = options.scene;
  if (!is_scene_file(options.scene))
    start.options.insert(start.options.end(), {"--groom", options.scene.string()});
  ASSIGN_OR_RETURN(const SceneDesc scene, has_scene_file ? load_scene(options.scene, options.overrides)
                                                         : built_in_scene_with(options.overrides));
  ScenarioFeed feed;
  feed.motion = options.motion;
  feed.wind = options.wind;
  // Steps wait for who sees them by the same codec: the recording has them all.
  ScenarioView view;
  view.name = "recording";
  view.codec = scene.stream.codec;
  const double steps = std::max(1.0, std::ceil(options.seconds * scene.step_rate_hz));
  Scenario scenario;
  scenario.name = "recording";
  scenario.limit_s = kStartLimitS + kLimitPerSecond * options.seconds;
  scenario.actions = {{start}, {feed}, {view}, {ScenarioSteps{static_cast<uint32_t>(steps)}}};
  return scenario;
}

}  // namespace

Status record_scene(const SceneRecordingOptions& options, const std::filesystem::path& out,
                    const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(const std::filesystem::path server, find_server_program(options.server));
  ASSIGN_OR_RETURN(const Scenario scenario, scenario_of(options, out));
  const ScenarioOptions run{{}, server, out.parent_path(), false, &stop, kPatienceS};
  const ScenarioResult result = ScenarioRun(scenario, run, [](const CheckResult&) {}).run();
  for (const CheckResult& check : result.checks)
    if (!check.has_passed) return make_error(ErrorCode::Unavailable, "{}", check.measured);
  return {};
}

}  // namespace strandcast
