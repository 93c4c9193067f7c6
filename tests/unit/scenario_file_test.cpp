// Scenario files: what is read, and how wrong ones are told.
#include <fstream>
#include <set>

#include "common/scene/scenario_file.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::scenario_file_test {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

Result<Scenario> parse(const std::string& text) {
  return parse_scenario(text, "test.textproto", "/folder");
}

TEST(ScenarioFile, ReadsActionsInOrderWithTheirLines) {
  const auto scenario = parse(R"(name: "all"
about: "a promise"
limit_s: 12.5
repeat: 2
do { start { scene: "../scenes/minimal.textproto" set: "substeps=2" lockstep: true relay: true record: true
  option: "--sim-device" } }
do { feed { motion: "walk.bvh" wind: "steady" wind_mps { x: 2 } from_s: 1.5 } }
do { step: 240 }
do { run_s: 0.5 }
do { set: "look.hair_color=red" }
do { command: RESTART }
do { view { name: "thin" mode: "auto" link_mbit: 2 delay_ms: 20 width: 64 height: 48 codec: "step"
  draws: "software" draw_ms: 40 } }
do { leave: "thin" }
do { refuse { input: NOT_A_NUMBER says: "nan" } }
do { remember: "here" }
do { expect { viewer: "thin" stretch_below: 0.01 no_quarantine: true hash: "00ff" same_as: "here" kbit_below: 3
  hz_above: 10 mode: "frames" because: "slow" back_within_s: 5 realtime_above: 0.95
  bits_per_vertex_below: 2
  picture { golden: "a.png" db_above: 30 } metric { name: "x" above: 1 within_s: 2 }
  slow_motion: false realtime_below: 0.5 feed_pace_within: 0.1 head_mps_below: 12 within_s: 3 } }
do { send { port: 39541 hex: "00 fF" hex: "7f" file: "packet.bin" random_bytes: 9 count: 3 rate_hz: 50 } }
do { link { viewer: "thin" fault: HALF_OPEN loss: 0.05 delay_ms: 20 link_mbit: 3 } }
do { expect { hash_file: "kept.txt" order_above: 0.5 incoherent_below: 0.4 cpu_share_below: 1.5 } }
do { disk { full_at_mb: 2.5 } }
do { disk { } }
)");
  ASSERT_TRUE(scenario) << scenario.error().to_string();
  EXPECT_EQ(scenario->name, "all");
  EXPECT_EQ(scenario->about, "a promise");
  EXPECT_EQ(scenario->limit_s, 12.5);
  EXPECT_EQ(scenario->repeat, 2u);
  ASSERT_EQ(scenario->actions.size(), 16u);
  EXPECT_EQ(scenario->actions[0].line, 5);
  EXPECT_EQ(scenario->actions[10].line, 17);
  const auto& start = std::get<ScenarioStart>(scenario->actions[0].work);
  EXPECT_EQ(start.scene, "/scenes/minimal.textproto") << "from the scenario's folder";
  EXPECT_EQ(start.overrides, std::vector<std::string>{"substeps=2"});
  EXPECT_TRUE(start.is_lockstep);
  EXPECT_TRUE(start.has_relay);
  EXPECT_TRUE(start.records);
  EXPECT_EQ(start.options, std::vector<std::string>{"--sim-device"});
  const auto& feed = std::get<ScenarioFeed>(scenario->actions[1].work);
  EXPECT_EQ(feed.motion, "/folder/walk.bvh");
  EXPECT_EQ(feed.wind, "steady") << "a word is no file";
  EXPECT_EQ(feed.wind_mps, glm::vec3(2.0f, 0.0f, 1.0f)) << "what is missing keeps its default";
  EXPECT_EQ(feed.from_s, 1.5);
  EXPECT_EQ(std::get<ScenarioSteps>(scenario->actions[2].work).count, 240u);
  EXPECT_EQ(std::get<ScenarioRunTime>(scenario->actions[3].work).seconds, 0.5);
  EXPECT_EQ(std::get<ScenarioSet>(scenario->actions[4].work).assignment, "look.hair_color=red");
  EXPECT_EQ(std::get<ScenarioCommand>(scenario->actions[5].work), ScenarioCommand::Restart);
  const auto& view = std::get<ScenarioView>(scenario->actions[6].work);
  EXPECT_EQ(view.link_mbit, 2.0);
  EXPECT_EQ(view.codec, "step");
  EXPECT_EQ(view.height, 48u);
  EXPECT_EQ(view.draws, "software");
  EXPECT_EQ(view.draw_ms, 40.0);
  EXPECT_EQ(std::get<ScenarioLeave>(scenario->actions[7].work).viewer, "thin");
  EXPECT_EQ(std::get<ScenarioRefusal>(scenario->actions[8].work).input, ScenarioInput::NotANumber);
  EXPECT_EQ(std::get<ScenarioRemember>(scenario->actions[9].work).name, "here");
  const auto& expect = std::get<ScenarioExpect>(scenario->actions[10].work);
  EXPECT_EQ(expect.hash, 0xffu);
  EXPECT_EQ(expect.stretch_below, 0.01);
  EXPECT_EQ(expect.picture->golden, "/folder/a.png");
  EXPECT_EQ(expect.metric->above, 1.0);
  EXPECT_FALSE(expect.metric->below);
  EXPECT_EQ(expect.mode, "frames");
  EXPECT_EQ(expect.because, "slow");
  EXPECT_EQ(expect.is_slow, std::optional(false));
  EXPECT_EQ(expect.realtime_below, 0.5);
  EXPECT_EQ(expect.feed_pace_within, 0.1);
  EXPECT_EQ(expect.head_mps_below, 12.0);
  EXPECT_EQ(expect.within_s, 3.0);
  const auto& send = std::get<ScenarioSend>(scenario->actions[11].work);
  EXPECT_EQ(send.port, 39'541);
  EXPECT_EQ(send.datagrams,
            (std::vector<std::vector<std::byte>>{{std::byte{0}, std::byte{255}}, {std::byte{127}}}));
  EXPECT_EQ(send.files, std::vector<std::filesystem::path>{"/folder/packet.bin"});
  EXPECT_EQ(send.random_bytes, 9u);
  EXPECT_EQ(send.count, 3u);
  EXPECT_EQ(send.rate_hz, 50.0);
  const auto& link = std::get<ScenarioLink>(scenario->actions[12].work);
  EXPECT_EQ(link.viewer, "thin");
  EXPECT_EQ(link.fault, ScenarioFault::HalfOpen);
  EXPECT_EQ(link.loss, 0.05);
  EXPECT_EQ(link.delay_ms, 20.0);
  EXPECT_EQ(link.link_mbit, 3.0);
  const auto& hair = std::get<ScenarioExpect>(scenario->actions[13].work);
  EXPECT_EQ(hair.hash_file, "/folder/kept.txt");
  EXPECT_EQ(hair.order_above, 0.5);
  EXPECT_EQ(hair.incoherent_below, 0.4);
  EXPECT_EQ(hair.cpu_share_below, 1.5);
  EXPECT_EQ(std::get<ScenarioDisk>(scenario->actions[14].work).full_at_mb, 2.5);
  EXPECT_FALSE(std::get<ScenarioDisk>(scenario->actions[15].work).full_at_mb);
}

TEST(ScenarioFile, SaysWhereItIsWrong) {
  const std::string head = "name: \"x\"\n";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {head + "do { step: 0 }", "test.textproto:2:6: step is 0, it must be within 1 .. 100000 steps"},
      {head + "do {\n  run_s: nan\n}", "test.textproto:3:3: run_s is nan"},
      {head + "do { expect { stretch_under: 1 } }", "test.textproto:2:28: "},
      {head + "do { expect { stretch_under: 1 } }", "known: viewer, stretch_below"},
      {head + "do { view { mode: \"both\" } }", "must be one of strands, frames, auto"},
      {head + "do { view { link_mbit: -2 } }", "link_mbit is -2"},
      {head + "do { link { loss: 0.6 } }", "loss is 0.6, it must be within 0 .. 0.5"},
      {head + "do { view { draws: \"gpu\" } }", "must be one of hardware, software, none"},
      {head + "do { view { draw_ms: -1 } }", "draw_ms is -1"},
      {head + "do { expect { because: \"slow\" } }", "because is of a mode"},
      {head + "do { expect { hash: \"xyz\" } }", "16 hexadecimal digits"},
      {head + "do { expect { metric { name: \"a\" } } }", "below, above or equals"},
      {head + "do { expect { picture { db_above: 3 } } }", "golden"},
      {head + "do { refuse { says: \"no\" } }", "either an input or a set"},
      {head + "do { refuse { input: OVERLONG set: \"a=1\" } }", "either an input or a set"},
      {head + "do { send { hex: \"00\" } }", "needs the port"},
      {head + "do { send { port: 0 hex: \"00\" } }", "port is 0"},
      {head + "do { send { port: 7 hex: \"0\" } }", "pairs of hexadecimal digits"},
      {head + "do { send { port: 7 hex: \"0g\" } }", "pairs of hexadecimal digits"},
      {head + "do { send { port: 7 } }", "say what with hex, file or random_bytes"},
      {head + "do { send { port: 7 random_bytes: 65508 } }", "random_bytes is 65508"},
      {head + "do { command: NONE }", "command is none of its values"},
      {head + "do { }", "says nothing to do"},
      {head + "do { step: 1 step: 2 }", "test.textproto:2:"},
      {head + "do { set: \"a\\nb\" }", "printable"},
      {head + "do { start { } }\ndo { disk { full_at_mb: 1 } }",
       "test.textproto:3:1: do number 2 is about a disk"},
      {head + "do { disk {} }", "begin with start { record: true }"},
      {head + "repeat: 11 do { step: 1 }", "repeat is 11"},
      {head + "limit_s: 0 do { step: 1 }", "limit_s is 0"},
      {head + "do { start { option: \"--record=/etc/passwd\" } }", "option is '--record=/etc/passwd'"},
      {head + "do { start { option: \"--listen\" option: \"0.0.0.0\" } }",
       "a scenario may give: --sim-device"},
      {head + "do { start { option: \"--shader-dir\" option: \"/tmp\" } }", "option is '--shader-dir'"},
      {head, "the scenario does nothing"},
      {"do { step: 1 }", "the scenario has no name"},
      {"name", "test.textproto:1:5"}};
  for (const auto& [text, part] : cases) {
    const auto scenario = parse(text);
    ASSERT_FALSE(scenario) << text;
    EXPECT_EQ(scenario.error().code, ErrorCode::BadInput) << text;
    EXPECT_THAT(scenario.error().to_string(), HasSubstr(part)) << text;
    EXPECT_THAT(scenario.error().to_string(), StartsWith("test.textproto")) << text;
  }
}

TEST(ScenarioFile, IsBounded) {
  std::string many = "name: \"x\"\n";
  for (size_t i = 0; i <= kMaxScenarioActions; ++i) many += "do { step: 1 }\n";
  EXPECT_THAT(parse(many).error().to_string(), HasSubstr("do has 1001 entries, the limit is 1000"));
  const std::string long_text = "name: \"x\"\n" + std::string(kMaxScenarioFileBytes, '#');
  EXPECT_EQ(parse(long_text).error().code, ErrorCode::LimitExceeded);
}

/// Pictures that it writes are held to the folder, and a folder without a name holds nothing.
TEST(ScenarioFile, HasAWholeFolderWhereItIsNamedAlone) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "mine.textproto") << "name: \"mine\"\ndo { step: 1 }\n";
  const std::filesystem::path before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const auto scenario = load_scenario("mine.textproto");
  std::filesystem::current_path(before);
  ASSERT_TRUE(scenario) << scenario.error().to_string();
  EXPECT_EQ(scenario->folder, std::filesystem::canonical(folder.path()));
}

// One promise each, and none that a person could not run: every picture to compare with is there.
TEST(ScenarioFile, EveryShippedScenarioParses) {
  const std::filesystem::path folder = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy" / "scenarios";
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".textproto") continue;
    const auto scenario = load_scenario(entry.path());
    ASSERT_TRUE(scenario) << scenario.error().to_string();
    EXPECT_EQ(scenario->name, entry.path().stem().string());
    EXPECT_FALSE(scenario->about.empty()) << scenario->name;
    EXPECT_TRUE(names.insert(scenario->name).second);
    for (const ScenarioAction& action : scenario->actions) {
      const auto* expect = std::get_if<ScenarioExpect>(&action.work);
      if (expect == nullptr || !expect->picture) continue;
      EXPECT_TRUE(std::filesystem::exists(expect->picture->golden)) << expect->picture->golden;
    }
  }
  EXPECT_EQ(names.size(), 16u);
  const auto example = load_scenario(std::filesystem::path(STRANDCAST_SOURCE_DIR) /
                                     "examples/ci/same_as_last_release.textproto");
  EXPECT_TRUE(example) << example.error().to_string();
}

// What people begin with is what the page shows: all of it is right.
TEST(ScenarioFile, TheDocumentedOneParses) {
  std::ifstream file(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "docs/use/test-a-server.md");
  std::string text, line;
  while (std::getline(file, line) && line != "```") {
  }
  while (std::getline(file, line) && line != "```") text += line + "\n";
  const auto scenario = parse(text);
  ASSERT_TRUE(scenario) << scenario.error().to_string() << text;
  std::set<size_t> kinds;
  for (const ScenarioAction& action : scenario->actions) kinds.insert(action.work.index());
  EXPECT_GE(kinds.size(), 9u);
}

}  // namespace
}  // namespace strandcast::scenario_file_test
