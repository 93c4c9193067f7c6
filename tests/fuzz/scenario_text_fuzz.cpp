// libFuzzer entry: a scenario file. What is accepted has something to do, and every number within its range.
#include <cmath>

#include "common/base/check.h"
#include "common/scene/scenario_file.h"
#include "tests/fuzz/fuzz_input.h"

namespace strandcast::scenario_text_fuzz {

extern "C" int FUZZ_ENTRY(scenario_text)(const uint8_t* data, size_t size) {
  const auto scenario = parse_scenario(FuzzInput(data, size).take_rest_as_text(), "fuzz", "/folder");
  if (!scenario) {
    CHECK(!scenario.error().message.empty());
    return 0;
  }
  CHECK(!scenario->name.empty() && !scenario->actions.empty());
  CHECK(scenario->actions.size() <= kMaxScenarioActions);
  CHECK(scenario->limit_s > 0.0 && scenario->limit_s <= kMaxScenarioS);
  CHECK(scenario->repeat >= 1 && scenario->repeat <= kMaxScenarioRepeats);
  for (const ScenarioAction& action : scenario->actions) {
    CHECK(action.line >= 1);
    if (const auto* steps = std::get_if<ScenarioSteps>(&action.work)) CHECK(steps->count >= 1);
    if (const auto* run = std::get_if<ScenarioRunTime>(&action.work))
      CHECK(run->seconds >= 0.0 && run->seconds <= kMaxScenarioS);
    if (const auto* view = std::get_if<ScenarioView>(&action.work))
      CHECK(std::isfinite(view->link_mbit) && view->width >= 16 && view->height >= 16);
  }
  return 0;
}

}  // namespace strandcast::scenario_text_fuzz
