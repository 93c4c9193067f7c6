// Every option of every command of strandcast-ctl: the field that it sets, and that it sets no other; and the
// messages of commands that only send one.
#include "client/app/ctl_options.h"

#include <fstream>

#include "tests/support/option_table.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::test {

inline void tell(FieldTexts& told, const std::string& where, const CtlTarget& all) {
  OPTION_FIELDS(all, connect, token, token_file, is_tls, tls_authorities, stop, head);
}
inline void tell(FieldTexts& told, const std::string& where, const MotionFileOptions& all) {
  OPTION_FIELDS(all, unit_m, up, joint, fps, has_body, body_joints, is_filtering_glitches,
                is_keeping_first_frames, prefix);
}
inline void tell(FieldTexts& told, const std::string& where, const FeedOptions& all) {
  OPTION_FIELDS(all, motion, wind, motion_file, is_looped, is_keeping_facing, blend_s, is_live, speed,
                seconds, rate_hz, timecode, ltc, fps, wind_mps, gust_intensity, seed, is_checking, as, to);
}
inline void tell(FieldTexts& told, const std::string& where, const ExportCommand& all) {
  OPTION_FIELDS(all, paths, fps, grooms, unit, up, space, is_guides, is_drawn, has_followers, has_head, from,
                to, seconds, at_s);
}
inline void tell(FieldTexts& told, const std::string& where, const SceneRecordingOptions& all) {
  OPTION_FIELDS(all, scene, overrides, motion, wind, seconds, server);
}
inline void tell(FieldTexts& told, const std::string& where, const BakeCommand& all) {
  OPTION_FIELDS(all, exported, feed, scene, overrides, server, lead_s, is_replacing);
}
inline void tell(FieldTexts& told, const std::string& where, const BundleCommand& all) {
  OPTION_FIELDS(all, paths, seconds, scene, has_all_solvers);
}
inline void tell(FieldTexts& told, const std::string& where, const TestOptions& all) {
  OPTION_FIELDS(all, scenarios, junit, out, server, uses_running, renews_goldens, jobs, is_watching);
}
inline void tell(FieldTexts& told, const std::string& where, const ParameterOptions& all) {
  OPTION_FIELDS(all, prefix, is_watching, is_live_only);
}
inline void tell(FieldTexts& told, const std::string& where, const LatencyOptions& all) {
  OPTION_FIELDS(all, seconds, mode, out);
}
inline void tell(FieldTexts& told, const std::string& where, const CameraOptions& all) {
  OPTION_FIELDS(all, view, session, yaw_deg, pitch_deg, distance_m, fov_deg, target_m);
}
inline void tell(FieldTexts& told, const std::string& where, const CtlCommandLine& all) {
  OPTION_FIELDS(all, target, log_level, feed, monitor_s, assignment, subject, check_frames, check_timeout_s,
                session, ban_s, scene_path, exported, bake, bundle, recording, other_recording,
                recording_name, slate, take, step_count, test, params, latency, camera, script_words);
}

}  // namespace strandcast::test

namespace strandcast::ctl_options_test {
namespace {

using test::Arguments;
using test::OptionRow;

CtlChoice parse(const Arguments& given) {
  std::vector<const char*> arguments{"strandcast-ctl"};
  for (const std::string& word : given) arguments.push_back(word.c_str());
  return read_ctl_command_line(static_cast<int>(arguments.size()), arguments.data());
}

std::optional<test::FieldTexts> fields_of(const Arguments& given) {
  const CtlChoice choice = parse(given);
  if (choice.command == nullptr) return std::nullopt;
  test::FieldTexts told;
  tell(told, {}, choice.line);
  return told;
}

const Arguments kScenario = {"--scenario", "s"};
const Arguments kOut = {"o.usda"};
const Arguments kBundle = {"a.mcap", "o.html"};

// Options of all commands stand behind one here.
const OptionRow kTargetRows[] = {
    {"--connect", {"other:81"}, {{"target.connect", "other:81"}, {"test.uses_running", "true"}}, {"pause"}},
    {"--token-file", {"t"}, {{"target.token_file", "t"}}, {"pause"}},
    {"--token", {"secret"}, {{"target.token", "secret"}}, {"pause"}},
    {"--tls", {}, {{"target.is_tls", "true"}}, {"pause"}},
    {"--tls-ca", {"ca.pem"}, {{"target.tls_authorities", "ca.pem"}}, {"pause"}},
    {"--head", {"anna"}, {{"target.head", "anna"}}, {"pause"}},
    {"--log", {"debug"}, {{"log_level", "debug"}}, {"pause"}}};

const OptionRow kCommandRows[] = {
    {"--motion", {"a.bvh"}, {{"feed.motion", "a.bvh"}}, {}, "feed"},
    {"--wind", {"a.csv"}, {{"feed.wind", "a.csv"}}, {}, "feed"},
    {"--unit", {"0.5"}, {{"feed.motion_file.unit_m", "0.5"}}, {}, "feed"},
    {"--up", {"z"}, {{"feed.motion_file.up", "z"}}, {}, "feed"},
    {"--joint", {"Skull"}, {{"feed.motion_file.joint", "Skull"}}, {}, "feed"},
    {"--body-joint", {"Hip", "Knee"}, {{"feed.motion_file.body_joints", "Hip Knee"}}, {}, "feed"},
    {"--filter-glitches", {}, {{"feed.motion_file.is_filtering_glitches", "true"}}, {}, "feed"},
    {"--keep-first-frames", {}, {{"feed.motion_file.is_keeping_first_frames", "true"}}, {}, "feed"},
    {"--check", {}, {{"feed.is_checking", "true"}}, {}, "feed"},
    {"--keep-facing", {}, {{"feed.is_keeping_facing", "true"}}, {}, "feed"},
    {"--loop", {}, {{"feed.is_looped", "true"}}, {}, "feed"},
    {"--live", {}, {{"feed.is_live", "true"}}, {}, "feed"},
    {"--speed", {"2"}, {{"feed.speed", "2"}}, {}, "feed"},
    {"--seconds", {"2.5"}, {{"feed.seconds", "2.5"}}, {}, "feed"},
    {"--rate", {"25/2"}, {{"feed.rate_hz", "12.5"}}, {}, "feed"},
    {"--timecode", {"01:00:00:00"}, {{"feed.timecode", "01:00:00:00"}}, {}, "feed"},
    {"--fps", {"25"}, {{"feed.fps", "25"}}, {}, "feed"},
    {"--ltc", {"a.wav"}, {{"feed.ltc", "a.wav"}}, {}, "feed"},
    {"--wind-mean", {"3", "4", "5"}, {{"feed.wind_mps", "3 4 5"}}, {}, "feed"},
    {"--gust-intensity", {"1.25"}, {{"feed.gust_intensity", "1.25"}}, {}, "feed"},
    {"--seed", {"7"}, {{"feed.seed", "7"}}, {}, "feed"},
    {"--as", {"vmc"}, {{"feed.as", "vmc"}}, {}, "feed"},
    {"--to", {"other"}, {{"feed.to", "other"}}, {"--as", "vmc"}, "feed"},
    {"--seconds", {"2.5"}, {{"monitor_s", "2.5"}}, {}, "monitor"},
    {"count", {"7"}, {{"step_count", "7"}}, {}, "step"},
    {"view", {"left"}, {{"camera.view", "left"}}, {}, "camera"},
    {"--session", {"7"}, {{"camera.session", "7"}}, {}, "camera"},
    {"--yaw-deg", {"7"}, {{"camera.yaw_deg", "7"}}, {}, "camera"},
    {"--pitch-deg", {"7"}, {{"camera.pitch_deg", "7"}}, {}, "camera"},
    {"--distance-m", {"7"}, {{"camera.distance_m", "7"}}, {}, "camera"},
    {"--target-m", {"1", "2", "3"}, {{"camera.target_m", "1 2 3"}}, {}, "camera"},
    {"--fov-deg", {"7"}, {{"camera.fov_deg", "7"}}, {}, "camera"},
    {"name", {"Zoe"}, {{"subject", "Zoe"}}, {}, "mocap subject"},
    {"name", {"take"}, {{"recording_name", "take"}}, {}, "record start"},
    {"--slate", {"12A"}, {{"slate", "12A"}}, {}, "record start"},
    {"--take", {"3"}, {{"take", "3"}}, {}, "record start"},
    {"prefix", {"look"}, {{"params.prefix", "look"}}, {}, "params"},
    {"--watch", {}, {{"params.is_watching", "true"}}, {}, "params"},
    {"--live", {}, {{"params.is_live_only", "true"}}, {}, "params"},
    {"--fps", {"24"}, {{"exported.fps", "24"}}, kOut, "export"},
    {"--units", {"m"}, {{"exported.unit", "m"}}, kOut, "export"},
    {"--up", {"z"}, {{"exported.up", "z"}}, kOut, "export"},
    {"--space", {"world"}, {{"exported.space", "world"}}, kOut, "export"},
    {"--guides", {}, {{"exported.is_guides", "true"}}, kOut, "export"},
    {"--groom", {"a.ply", "--groom", "b.ply"}, {{"exported.grooms", "a.ply b.ply"}}, kOut, "export"},
    {"--followers", {}, {{"exported.has_followers", "true"}}, kOut, "export"},
    {"--drawn", {}, {{"exported.is_drawn", "true"}}, kOut, "export"},
    {"--head", {}, {{"exported.has_head", "true"}}, kOut, "export"},
    {"--from", {"2"}, {{"exported.from", "2"}}, kOut, "export"},
    {"--to", {"2"}, {{"exported.to", "2"}}, kOut, "export"},
    {"--seconds", {"2"}, {{"exported.seconds", "2"}}, kOut, "export"},
    {"--at", {"2"}, {{"exported.at_s", "2"}}, kOut, "export"},
    {"--motion", {"a.bvh"}, {{"bake.feed.motion", "a.bvh"}}, kOut, "bake"},
    {"--wind", {"a.csv"}, {{"bake.feed.wind", "a.csv"}}, kOut, "bake"},
    {"--motion-fps", {"29.97"}, {{"bake.feed.fps", "29.97"}}, kOut, "bake"},
    {"--motion-unit", {"0.5"}, {{"bake.feed.motion_file.unit_m", "0.5"}}, kOut, "bake"},
    {"--motion-up", {"z"}, {{"bake.feed.motion_file.up", "z"}}, kOut, "bake"},
    {"--joint", {"Skull"}, {{"bake.feed.motion_file.joint", "Skull"}}, kOut, "bake"},
    {"--body-joint", {"Hip"}, {{"bake.feed.motion_file.body_joints", "Hip"}}, kOut, "bake"},
    {"--filter-glitches", {}, {{"bake.feed.motion_file.is_filtering_glitches", "true"}}, kOut, "bake"},
    {"--keep-first-frames", {}, {{"bake.feed.motion_file.is_keeping_first_frames", "true"}}, kOut, "bake"},
    {"--lead", {"2"}, {{"bake.lead_s", "2"}}, kOut, "bake"},
    {"--replace", {}, {{"bake.is_replacing", "true"}}, kOut, "bake"},
    {"--scene", {"s"}, {{"bake.scene", "s"}}, kOut, "bake"},
    {"--set", {"a=1"}, {{"bake.overrides", "a=1"}}, kOut, "bake"},
    {"--server", {"s"}, {{"bake.server", "s"}}, kOut, "bake"},
    {"--fps", {"24"}, {{"bake.exported.fps", "24"}}, kOut, "bake"},
    {"--units", {"m"}, {{"bake.exported.unit", "m"}}, kOut, "bake"},
    {"--up", {"z"}, {{"bake.exported.up", "z"}}, kOut, "bake"},
    {"--space", {"world"}, {{"bake.exported.space", "world"}}, kOut, "bake"},
    {"--guides", {}, {{"bake.exported.is_guides", "true"}}, kOut, "bake"},
    {"--followers", {}, {{"bake.exported.has_followers", "true"}}, kOut, "bake"},
    {"--drawn", {}, {{"bake.exported.is_drawn", "true"}}, kOut, "bake"},
    {"--head", {}, {{"bake.exported.has_head", "true"}}, kOut, "bake"},
    {"--from", {"2"}, {{"bake.exported.from", "2"}}, kOut, "bake"},
    {"--to", {"2"}, {{"bake.exported.to", "2"}}, kOut, "bake"},
    {"--seconds", {"2"}, {{"bake.exported.seconds", "2"}}, kOut, "bake"},
    {"--at", {"2"}, {{"bake.exported.at_s", "2"}}, kOut, "bake"},
    {"recording", {"a.mcap"}, {{"recording", "a.mcap"}}, {}, "check"},
    {"--seconds", {"2"}, {{"bundle.seconds", "2"}}, kBundle, "bundle"},
    {"--all-solvers", {}, {{"bundle.has_all_solvers", "true"}}, kBundle, "bundle"},
    {"--motion", {"a.bvh"}, {{"bundle.scene.motion", "a.bvh"}}, kBundle, "bundle"},
    {"--wind", {"a.csv"}, {{"bundle.scene.wind", "a.csv"}}, kBundle, "bundle"},
    {"--set", {"a=1", "--set", "b=2"}, {{"bundle.scene.overrides", "a=1 b=2"}}, kBundle, "bundle"},
    {"--server", {"s"}, {{"bundle.scene.server", "s"}}, kBundle, "bundle"},
    {"--frames", {"7"}, {{"check_frames", "7"}}, {}, "check"},
    {"--timeout", {"7"}, {{"check_timeout_s", "7"}}, {}, "check"},
    {"--ban", {"60"}, {{"ban_s", "60"}}, {"7"}, "kick"},
    {"out", {"b.mcap"}, {{"other_recording", "b.mcap"}}, {"a.mcap"}, "recover"},
    {"--seconds", {"2"}, {{"latency.seconds", "2"}}, {}, "latency"},
    {"--mode", {"frames"}, {{"latency.mode", "frames"}}, {}, "latency"},
    {"--out", {"o"}, {{"latency.out", "o"}}, {}, "latency"},
    {"--junit", {"j"}, {{"test.junit", "j"}}, kScenario, "test"},
    {"--out", {"o"}, {{"test.out", "o"}}, kScenario, "test"},
    {"--server", {"s"}, {{"test.server", "s"}}, kScenario, "test"},
    {"--renew", {}, {{"test.renews_goldens", "true"}}, kScenario, "test"},
    {"--jobs", {"3"}, {{"test.jobs", "3"}}, kScenario, "test"},
    {"--watch", {}, {{"test.is_watching", "true"}}, kScenario, "test"}};

/// What a command cannot be without: its fields are those beside the first ones of any command.
const OptionRow kRequiredRows[] = {
    {"assignment", {"look.ambient=1"}, {{"assignment", "look.ambient=1"}}, {}, "set"},
    {"file", {"s.textproto"}, {{"scene_path", "s.textproto"}}, {}, "save"},
    {"paths", {"a.mcap", "o.usda"}, {{"exported.paths", "a.mcap o.usda"}}, {}, "export"},
    {"paths", kBundle, {{"bundle.paths", "a.mcap o.html"}}, {}, "bundle"},
    {"paths", {"a.ply", "b.ply", "o.abc"}, {{"bake.exported.paths", "a.ply b.ply o.abc"}}, {}, "bake"},
    {"session", {"7"}, {{"session", "7"}}, {}, "kick"},
    {"recording", {"a.mcap"}, {{"recording", "a.mcap"}}, {}, "info"},
    {"recording", {"a.mcap"}, {{"recording", "a.mcap"}}, {}, "recover"},
    {"recording",
     {"a.mcap", "b.mcap"},
     {{"recording", "a.mcap"}, {"other_recording", "b.mcap"}},
     {},
     "compare"},
    {"other", {"a.mcap", "b.mcap"}, {{"recording", "a.mcap"}, {"other_recording", "b.mcap"}}, {}, "compare"},
    {"--scenario", {"a", "--scenario", "b"}, {{"test.scenarios", "a b"}}, {}, "test"}};

std::string help_of(const std::string& command) {
  Arguments arguments = test::words_of(command);
  arguments.push_back("--help");
  testing::internal::CaptureStdout();
  EXPECT_EQ(parse(arguments).exit_code, kDoneExit);
  return testing::internal::GetCapturedStdout();
}

TEST(CtlOptionTable, EveryOptionOfEveryCommandChangesItsFieldAndNoOther) {
  std::vector<OptionRow> rows(std::begin(kTargetRows), std::end(kTargetRows));
  rows.insert(rows.end(), std::begin(kCommandRows), std::end(kCommandRows));
  test::expect_changes(rows, fields_of);
  const auto first = fields_of({"pause"});
  ASSERT_TRUE(first);
  for (const OptionRow& row : kRequiredRows) {
    SCOPED_TRACE(row.command + " " + row.option);
    Arguments arguments = test::words_of(row.command);
    if (row.option.starts_with('-')) arguments.push_back(row.option);
    arguments.insert(arguments.end(), row.values.begin(), row.values.end());
    const auto fields = fields_of(arguments);
    ASSERT_TRUE(fields);
    EXPECT_EQ(test::difference_of(*first, *fields), row.changed);
    rows.push_back(row);
  }
  test::expect_all_options(rows, help_of({}));
  for (const CtlCommand& command : ctl_commands())
    if (const std::string name = command.name; name != "fleet" && name != "grid")  // theirs are scripts'
      test::expect_all_options(rows, help_of(name), name);
}

TEST(CtlOptionTable, NumbersEndWhereTheyAreSaidTo) {
  const test::OptionRange kRanges[] = {
      {"--unit", "-0.1", "0", "1000", "1001", {"feed"}},
      {"--speed", "0.0009", "0.001", "100", "101", {"feed"}},
      {"--seconds", "-1", "0", "1000000", "1000001", {"feed"}},
      {"--rate", "0.9", "1", "1000", "1001", {"feed"}},
      {"--gust-intensity", "-0.1", "0", "2", "2.1", {"feed"}},
      {"--seconds", "-1", "0", "1000000", "1000001", {"monitor"}},
      {"--take", "0", "1", "9999", "10000", {"record", "start"}},
      {"--yaw-deg", "-361", "-360", "360", "361", {"camera"}},
      {"--pitch-deg", "-86", "-85", "85", "86", {"camera"}},
      {"--distance-m", "0.009", "0.01", "100", "101", {"camera"}},
      {"--fov-deg", "1.9", "2", "160", "161", {"camera"}},
      {"--from", "-1", "0", "86400", "86401", {"export", "o.usda"}},
      {"--to", "-1", "0", "86400", "86401", {"export", "o.usda"}},
      {"--seconds", "-1", "0", "86400", "86401", {"export", "o.usda"}},
      {"--at", "-1", "0", "86400", "86401", {"export", "o.usda"}},
      {"--lead", "-1", "0", "60", "61", {"bake", "o.usda"}},
      {"--motion-unit", "-0.1", "0", "1000", "1001", {"bake", "o.usda"}},
      {"--seconds", "-1", "0", "3600", "3601", {"bundle", "a.mcap", "o.html"}},
      {"--frames", "1", "2", "1000000", "1000001", {"check"}},
      {"--timeout", "0.09", "0.1", "1000000", "1000001", {"check"}},
      {"--ban", "-1", "0", "604800", "604801", {"kick", "7"}},
      {"--seconds", "0.09", "0.1", "1000000", "1000001", {"latency"}}};
  testing::internal::CaptureStderr();
  test::expect_ranges(kRanges,
                      [](const Arguments& arguments) { return parse(arguments).command != nullptr; });
  for (const auto& [count, is_taken] :
       {std::pair{"0", false}, {"1", true}, {"100000", true}, {"100001", false}})
    EXPECT_EQ(parse({"step", count}).command != nullptr, is_taken) << count;
  (void)testing::internal::GetCapturedStderr();
}

TEST(CtlOptionTable, WhatStandsBehindAScriptIsItsOwn) {
  for (const char* script : {"fleet", "grid"})
    EXPECT_EQ(parse({script, "start", "a", "--head", "b", "--", "--help"}).line.script_words,
              (Arguments{"start", "a", "--head", "b", "--", "--help"}))
        << script;
}

TEST(CtlOptionTable, ACommandThatOnlySendsAMessageSaysAllOfIt) {
  const std::pair<Arguments, ClientMessage> kSent[] = {
      {{"pause"}, ControlCommand{Command::Pause, 0}},
      {{"resume"}, ControlCommand{Command::Resume, 0}},
      {{"reset"}, ControlCommand{Command::Reset, 0}},
      {{"set", "look.ambient=1"}, SetParameter{"look.ambient=1"}},
      {{"mocap", "subject", "Zoe"}, LiveCommand{LiveAction::ChooseSubject, "Zoe"}},
      {{"mocap", "calibrate"}, LiveCommand{LiveAction::Calibrate, ""}},
      {{"mocap", "reset"}, LiveCommand{LiveAction::Reset, ""}},
      {{"record", "start", "take", "--slate", "12A", "--take", "3"}, RecordCommand{true, "take", "12A", 3}},
      {{"record", "stop"}, RecordCommand{false, ""}},
      {{"sessions"}, AdminCommand{AdminAction::ListSessions, 0, 0.0}},
      {{"kick", "7", "--ban", "60"}, AdminCommand{AdminAction::Kick, 7, 60.0}},
      {{"shutdown"}, AdminCommand{AdminAction::ShutDown, 0, 0.0}}};
  size_t sent_count = 0;
  for (const CtlCommand& command : ctl_commands()) sent_count += command.message != nullptr ? 1 : 0;
  EXPECT_EQ(std::size(kSent), sent_count) << "a command is missing here";
  for (const auto& [arguments, message] : kSent) {
    const CtlChoice choice = parse(arguments);
    ASSERT_TRUE(choice.command != nullptr && choice.command->message != nullptr) << arguments[0];
    EXPECT_EQ(choice.command->message(choice.line), message) << arguments[0];
  }
}

TEST(CtlCommandLine, WhatIsStoppedBeforeItIsDoneEndsAsShellsExpect) {
  const CtlChoice choice = parse({"bundle", "hair.txt"});
  ASSERT_NE(choice.command, nullptr);
  EXPECT_EQ(carry_out(*choice.command, choice.line, false), kBadInputExit);
  EXPECT_EQ(carry_out(*choice.command, choice.line, true), 130);
}

/// Wind of 1 m/s, then of 3 m/s for the rest of a second.
class FedWind : public testing::Test {
 protected:
  double x_mps_at(double time_s, bool is_looped) {
    const TemporaryFolder folder;
    FeedOptions options;
    options.wind = (folder.path() / "wind.csv").string();
    std::ofstream(options.wind) << kText;
    options.motion = "none";
    options.is_looped = is_looped;
    const auto plan = make_feed_plan(options);
    EXPECT_TRUE(plan) << plan.error().to_string();
    return plan ? static_cast<double>(plan->wind(time_s).x) : 0.0;
  }
  static constexpr const char* kText = "t_s,x_mps,y_mps,z_mps\n0,1,0,0\n0.5,3,0,0\n1,3,0,0\n";
};

TEST_F(FedWind, BeginsAnewAtItsEndWhereItIsLooped) {
  EXPECT_DOUBLE_EQ(x_mps_at(0.25, true), 2.0) << "between its lines";
  EXPECT_DOUBLE_EQ(x_mps_at(1.25, true), 2.0);
  EXPECT_DOUBLE_EQ(x_mps_at(1.25, false), 3.0) << "else it stays at its last line";
}

}  // namespace
}  // namespace strandcast::ctl_options_test
