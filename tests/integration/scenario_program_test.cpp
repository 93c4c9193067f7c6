// strandcast-ctl test as a person meets it: exit codes, what it prints, what it leaves, and that no server is
// left behind.
#include <gmock/gmock.h>

#include <csignal>
#include <fstream>
#include <sstream>

#include "tests/support/child_process.h"
#include "tests/support/temporary_folder.h"

namespace strandcast::scenario_program_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ScenarioProgram : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    const std::filesystem::path path = folder_.path() / name;
    std::ofstream(path) << text;
    return path;
  }
  /// Its exit code.
  int run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "test");
    arguments.insert(arguments.end(),
                     {"--server", STRANDCAST_SERVER_PROGRAM, "--out", (folder_.path() / "out").string(),
                      "--junit", (folder_.path() / "results.xml").string()});
    return test::ChildProcess(STRANDCAST_CTL_PROGRAM, arguments, folder_.path() / "said").wait();
  }
  std::string text_of(const std::string& name) const {
    std::ifstream file(folder_.path() / name);
    std::ostringstream text;
    text << file.rdbuf();
    return text.str();
  }

  TemporaryFolder folder_;
};

constexpr const char* kStart = "do { start { set: \"groom.procedural.strand_count=20\" lockstep: true } }\n";

TEST_F(ScenarioProgram, SaysWhatHoldsAndLeavesXml) {
  const auto path =
      write("good.textproto", std::string("name: \"good\" about: \"it <works>\" repeat: 2\n") + kStart +
                                  "do { feed { motion: \"shake\" } }\n"
                                  "do { view { name: \"a\" } }\n"
                                  "do { step: 12 }\n"
                                  "do { remember: \"here\" }\n"
                                  "do { expect { same_as: \"here\" no_quarantine: true } }\n"
                                  "do { expect { stretch_below: 0.5 hz_above: 1 } }\n"
                                  "do { refuse { set: \"substeps=0\" says: \"must be within\" } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 0) << text_of("said");
  EXPECT_THAT(text_of("said"),
              AllOf(HasSubstr("good: it <works>"), HasSubstr("ok    line 7"), HasSubstr("stretch of a"),
                    HasSubstr("states of run 2: wanted those of the first run"), Not(HasSubstr("FAIL"))));
  EXPECT_THAT(text_of("results.xml"), AllOf(HasSubstr("<testsuites tests=\"13\" failures=\"0\">"),
                                            HasSubstr("<testsuite name=\"good\" tests=\"13\"")));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out")) << "nothing failed";
}

TEST_F(ScenarioProgram, RunsAFolderAtTheSameTimeWithTheLinesOfEachTogether) {
  const std::string begin = std::string("name: \"%\"\n") + kStart + "do { step: 3 }\n";
  const auto named = [&](const std::string& name) {
    std::string text = begin;
    return text.replace(text.find('%'), 1, name);
  };
  write("b.textproto", named("b") + "do { expect { no_quarantine: true } }\n");
  write("a.textproto", named("a") + "do { expect { hash: \"1\" } }\n");
  write("c.textproto", named("c") + "do { expect { no_quarantine: true } }\n");
  write("notes.txt", "no scenario");
  EXPECT_EQ(run({"--scenario", folder_.path().string(), "--jobs", "3"}), 1) << text_of("said");
  EXPECT_THAT(text_of("said"), AllOf(HasSubstr("2 of 3 scenarios hold"), HasSubstr("a: 0 of 1 checks hold")));
  // no_quarantine looks at two figures.
  for (const std::string name : {"b", "c"})
    EXPECT_THAT("\n" + text_of("said"), testing::ContainsRegex("\n" + name + "\n  ok [^\n]*\n  ok [^\n]*\n" +
                                                               name + ": 2 of 2 checks"));
  const std::string xml = text_of("results.xml");
  EXPECT_LT(xml.find("name=\"a\""), xml.find("name=\"b\"")) << "in the order of the files";
  const auto empty = folder_.path() / "empty";
  std::filesystem::create_directory(empty);
  EXPECT_EQ(run({"--scenario", empty.string()}), 2);
  EXPECT_THAT(text_of("said"), HasSubstr("no .textproto"));
  EXPECT_EQ(run({"--scenario", folder_.path().string(), "--jobs", "2", "--connect", "127.0.0.1:1"}), 2);
  EXPECT_THAT(text_of("said"), HasSubstr("one scenario at a time"));
}

TEST_F(ScenarioProgram, WatchesWhatItReadsAndTheServersProgram) {
  const auto server = write("server", "#!/bin/sh\nexec " STRANDCAST_SERVER_PROGRAM " \"$@\"\n");
  std::filesystem::permissions(server, std::filesystem::perms::owner_all);
  const auto path = write("mine.textproto", std::string("name: \"mine\"\n") + kStart +
                                                "do { step: 3 }\ndo { expect { hash: \"1\" } }\n");
  test::ChildProcess program(STRANDCAST_CTL_PROGRAM,
                             {"test", "--scenario", path.string(), "--watch", "--server", server.string(),
                              "--out", (folder_.path() / "out").string()},
                             folder_.path() / "said");
  const auto says = [&](const char* what) { return text_of("said").find(what) != std::string::npos; };
  ASSERT_TRUE(eventually([&] { return says("waiting for a change"); })) << text_of("said");
  EXPECT_TRUE(says("mine: 0 of 1 checks hold"));
  write("scene.textproto", "groom { procedural { strand_count: 20 } }\n");
  write("mine.textproto",
        "name: \"mine\"\ndo { start { scene: \"scene.textproto\" lockstep: true } }\n"
        "do { step: 3 }\ndo { expect { no_quarantine: true } }\n");
  EXPECT_TRUE(eventually([&] { return says("mine: 2 of 2 checks hold"); })) << text_of("said");
  const auto rounds = [&] {
    const std::string said = text_of("said"), end = "waiting for a change";
    size_t count = 0;
    for (size_t at = said.find(end); at != std::string::npos; at = said.find(end, at + 1)) ++count;
    return count;
  };
  ASSERT_TRUE(eventually([&] { return rounds() == 2; })) << text_of("said");
  std::filesystem::last_write_time(server, std::filesystem::file_time_type::clock::now());
  EXPECT_TRUE(eventually([&] { return rounds() == 3; })) << text_of("said");
  write("scene.textproto", "groom { procedural { strand_count: 30 } }\n");
  EXPECT_TRUE(eventually([&] { return rounds() == 4; })) << text_of("said");
  program.send_signal(SIGTERM);
  EXPECT_EQ(program.wait(), 0) << "the last round holds";
}

TEST_F(ScenarioProgram, AnExpectationThatFailsIsExitCodeOneWithEvidence) {
  const auto path = write(
      "bad.textproto", std::string("name: \"bad\"\n") + kStart +
                           "do { view { name: \"a\" width: 64 height: 48 } }\n"
                           "do { step: 6 }\n"
                           "do { expect { hash: \"1\" hz_above: 1e6 } }\n"
                           "do { expect { metric { name: \"no_such\" above: 0 } } }\n"
                           "do { refuse { set: \"substeps=2\" } }\n"
                           "do { expect { metric { name: \"strandcast_sim_steps_total\" equals: 6 } } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 1) << text_of("said");
  EXPECT_THAT(
      text_of("said"),
      AllOf(HasSubstr("FAIL  line 5    state at step 6: is "), HasSubstr(", wanted 0000000000000001\n"),
            HasSubstr("FAIL  line 5    frames per second of a: measured "),
            HasSubstr(", wanted above 1e+06, it sees strands ("), HasSubstr("FAIL  line 6    no_such"),
            HasSubstr("FAIL  line 7    set substeps=2"), HasSubstr("ok    line 8"),
            HasSubstr("bad: 1 of 5 checks hold")));
  EXPECT_THAT(text_of("results.xml"), HasSubstr("failures=\"4\""));
  EXPECT_THAT(text_of("out/bad_plot.svg"),
              AllOf(HasSubstr("largest stretch"), HasSubstr("wanted above 1e+06")));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out/bad_a.png"));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "out/bad_server.log"));
}

// What was measured comes first, then what was wanted, where, and what helps.
TEST_F(ScenarioProgram, AStretchThatFailsSaysWhereAndWhatHelps) {
  const auto path = write("soft.textproto",
                          "name: \"soft\"\n"
                          "do { start { set: \"groom.procedural.strand_count=20\" set: \"solver.name=xpbd\" "
                          "set: \"solver.parameters.stretch_compliance_m_per_n=1\" lockstep: true } }\n"
                          "do { view { name: \"a\" } }\n"
                          "do { feed { motion: \"shake\" } }\n"
                          "do { step: 60 }\n"
                          "do { expect { stretch_below: 0.1 } }\n"
                          "do { expect { stretch_below: 0.002 } }\n"
                          "do { expect { stretch_below: 1e-6 } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 1) << text_of("said");
  const std::string where = ", at strand [0-9]+, from vertex [0-9]+ to [0-9]+, [0-9.]+ s .state [0-9]+.: ";
  EXPECT_THAT(text_of("said"),
              testing::ContainsRegex("FAIL  line 6    stretch of a: measured [0-9.]+ .seen within [0-9.]+., "
                                     "wanted below 0.1" +
                                     where + "more substeps, or quality=full"));
  EXPECT_THAT(text_of("said"),
              testing::ContainsRegex("wanted below 0.002" + where +
                                     "more substeps.*less; set: .stream.bound_m=0.0000[0-9]+. shows so"));
  EXPECT_THAT(text_of("said"),
              testing::ContainsRegex(
                  "wanted below 1e-06" + where +
                  "more substeps.*less; no stream.bound_m shows so little: the finest, 0.000001, "));
  EXPECT_THAT(text_of("results.xml"), testing::ContainsRegex("<failure message=\"measured [0-9.]+ .seen"));
}

// Each of these is seen to hold, and to fail where more is asked for than there is.
TEST_F(ScenarioProgram, OrderCoherenceAndProcessorShareAreMeasured) {
  const auto path =
      write("hair.textproto",
            "name: \"hair\"\n"
            "do { start { set: \"groom.procedural.strand_count=300\" set: \"quality=full\" set: "
            "\"stream.bound_m=0.00001\" lockstep: true } }\n"
            "do { view { name: \"a\" } }\n"
            "do { feed { motion: \"shake\" } }\n"
            "do { step: 120 }\n"
            "do { expect { order_above: 0.2 incoherent_below: 0.9 cpu_share_below: 64 } }\n"
            "do { expect { order_above: 1 incoherent_below: 1e-6 cpu_share_below: 1e-6 } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 1) << text_of("said");
  const std::string said = text_of("said");
  EXPECT_THAT(said, AllOf(HasSubstr("3 of 6"), Not(HasSubstr("FAIL  line 6")))) << said;
  for (const char* what :
       {"order of hair seen by a: measured 0.[0-9]+ over 20 moments, 0.[0-9]+ at [0-2].[0-9]+ s the worst "
        ".hair moves at [0-9.]+ m/s., wanted above 1",
        "incoherent motion of hair seen by a: measured 0.[0-9]+ over 20 moments, [01].[0-9]+ at "
        "[0-2].[0-9]+ s the worst .hair moves at [0-9.]+ m/s., wanted below 1e-06",
        "processor share of the server: measured [0-9.]+, wanted below 1e-06 of one processor"})
    EXPECT_THAT(said, testing::ContainsRegex(std::string("FAIL  line 7    ") + what));
}

TEST_F(ScenarioProgram, TheExampleForReleasesSeesOtherHair) {
  std::ifstream file(std::filesystem::path(STRANDCAST_SOURCE_DIR) /
                     "examples/ci/same_as_last_release.textproto");
  std::ostringstream text;
  text << file.rdbuf();
  const std::string example = text.str(), hair = "strand_count=200";
  const auto path = write("release.textproto", example).string();
  EXPECT_EQ(run({"--scenario", path, "--renew"}), 0) << text_of("said");
  EXPECT_EQ(run({"--scenario", path}), 0) << text_of("said");
  ASSERT_NE(example.find(hair), std::string::npos);
  write("release.textproto",
        std::string(example).replace(example.find(hair), hair.size(), "strand_count=201"));
  EXPECT_EQ(run({"--scenario", path}), 1) << text_of("said");
}

TEST_F(ScenarioProgram, AStateIsComparedWithAKeptOne) {
  const std::string begin = std::string("name: \"kept\"\n") + kStart +
                            "do { feed { motion: \"builtin\" } }\ndo { step: 6 }\n"
                            "do { expect { hash_file: \"kept/hash.txt\" } }\n";
  std::filesystem::create_directories(folder_.path() / "kept");
  const auto path = write("kept.textproto", begin);
  EXPECT_EQ(run({"--scenario", path.string(), "--renew"}), 0) << text_of("said");
  write("kept/other.txt", "0123456789abcdef\n");
  write("kept.textproto", begin +
                              "do { expect { hash_file: \"kept/other.txt\" } }\n"
                              "do { expect { hash_file: \"kept/none.txt\" } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 1);
  EXPECT_THAT(text_of("said"),
              AllOf(testing::ContainsRegex("ok    line 5    .*: wanted [0-9a-f]+ of hash.txt, is [0-9a-f]+"),
                    testing::ContainsRegex(
                        "FAIL  line 6    .*: is [0-9a-f]+, wanted 0123456789abcdef of other.txt, solver"),
                    testing::ContainsRegex("FAIL  line 7    .*none.txt.*--renew writes it")));
}

// It takes the states that one of the scenario's own took: samples come with the steps, not with the clock.
TEST_F(ScenarioProgram, ARunningServerInLockstepIsFedStepByStep) {
  const auto path = write("same.textproto", std::string("name: \"same\"\n") + kStart +
                                                "do { feed { motion: \"shake\" } }\ndo { step: 12 }\n"
                                                "do { expect { hash_file: \"hash.txt\" } }\n");
  EXPECT_EQ(run({"--scenario", path.string(), "--renew"}), 0) << text_of("said");
  const std::string token = (folder_.path() / "token").string();
  const test::ChildProcess server(
      STRANDCAST_SERVER_PROGRAM,
      {"--lockstep", "--port", "0", "--port-file", (folder_.path() / "port").string(), "--set",
       "groom.procedural.strand_count=20", "--token-file", token},
      folder_.path() / "server.log");
  ASSERT_TRUE(eventually([&] { return !text_of("port").empty(); })) << text_of("server.log");
  EXPECT_EQ(run({"--scenario", path.string(), "--connect",
                 "127.0.0.1:" + std::to_string(std::stoi(text_of("port"))), "--token-file", token}),
            0)
      << text_of("said");
}

// Nothing comes through a line that stalls; it comes when the line is whole again.
TEST_F(ScenarioProgram, WhatIsWrongWithALineIsSeen) {
  const auto path = write("line.textproto", std::string("name: \"line\"\n") + kStart +
                                                "do { view { name: \"a\" } }\n"
                                                "do { step: 6 }\n"
                                                "do { expect { back_within_s: 1 } }\n"
                                                "do { link { fault: STALL } }\n"
                                                "do { run_s: 0.2 }\n"
                                                "do { expect { hz_above: 0 } }\n"
                                                "do { link {} } do { step: 6 }\n"
                                                "do { expect { back_within_s: 5 } }\n"
                                                "do { command: RESTART_RELAY }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 2) << text_of("said");
  EXPECT_THAT(
      text_of("said"),
      AllOf(HasSubstr("FAIL  line 5    a comes back: neither its server was restarted nor its link changed"),
            HasSubstr(
                "FAIL  line 8    frames per second of a: measured 0.0, wanted above 0, it sees strands ("),
            HasSubstr("; each state is meant for it, and 0 came in 0.2 s (0 kbit/s)"),
            HasSubstr("ok    line 10   a comes back: wanted within 5 s, was back after"),
            HasSubstr("FAIL  line 11   command: there is no relay to be killed: start { relay: true }\n")));
}

// The time is that of coming back, not of the question. Nobody connects again before 0.18 s.
TEST_F(ScenarioProgram, ComingBackLateFailsHoweverLateItIsAskedFor) {
  const auto path = write("late.textproto",
                          "name: \"late\"\n"
                          "do { start { set: \"groom.procedural.strand_count=20\" } }\n"
                          "do { view { name: \"a\" } }\n"
                          "do { link { fault: CUT } }\n"
                          "do { expect { back_within_s: 60 } }\n"
                          "do { expect { back_within_s: 0.1 } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 1) << text_of("said");
  const std::string said = text_of("said");
  EXPECT_THAT(said,
              testing::ContainsRegex("ok    line 5    a comes back: wanted within 60 s, was back after"));
  EXPECT_THAT(said, testing::ContainsRegex("FAIL  line 6    a comes back: was back after [0-9.]+ s, wanted "
                                           "within 0.1 s"));
}

// In lockstep nothing goes by itself: what is then asked about states would be told wrongly.
TEST_F(ScenarioProgram, WaitingInLockstepMeasuresNoStates) {
  const std::string begin = std::string("name: \"waits\"\n") + kStart +
                            "do { view { name: \"a\" } } do { step: 6 } do { run_s: 0.2 }\n";
  const auto wrong = write("wrong.textproto", begin + "do { expect { realtime_below: 0.5 } }\n");
  EXPECT_EQ(run({"--scenario", wrong.string()}), 2) << text_of("said");
  EXPECT_THAT(text_of("said"), HasSubstr("in lockstep run_s only waits, and step goes on"));
  const auto away =
      write("away.textproto",
            begin +
                "do { link {} } do { expect { back_within_s: 0.3 } }\n"
                "do { expect { metric { name: \"strandcast_viewers_strands_of_codec\" above: 0 } } }\n");
  EXPECT_EQ(run({"--scenario", away.string()}), 1) << text_of("said");
  EXPECT_THAT(
      text_of("said"),
      AllOf(
          HasSubstr("no frame has come since: in lockstep, a step brings one"),
          HasSubstr("no such line in /metrics, but 'strandcast_viewers_strands_of_codec{codec=\"step\"}'")));
  const auto right = write("right.textproto", begin + "do { expect { cpu_share_below: 9 } }\n");
  EXPECT_EQ(run({"--scenario", right.string()}), 0) << text_of("said");
}

// What is needed for the rest is not there: the rest is not done, and the limit ends what would take for
// ever.
TEST_F(ScenarioProgram, TroubleEndsAScenarioAndIsAFailure) {
  const auto refused = write("refused.textproto", std::string("name: \"refused\"\n") + kStart +
                                                      "do { set: \"substeps=0\" }\ndo { step: 1 }\n");
  EXPECT_EQ(run({"--scenario", refused.string()}), 2);
  EXPECT_THAT(text_of("said"), AllOf(HasSubstr("FAIL  line 3    set: the server refused substeps=0"),
                                     HasSubstr("refused: 0 of 1 checks hold")));
  const auto endless = write("endless.textproto",
                             std::string("name: \"endless\" limit_s: 3\n") + kStart + "do { run_s: 3000 }\n");
  EXPECT_EQ(run({"--scenario", endless.string()}), 1);
  EXPECT_THAT(text_of("said"), testing::ContainsRegex(
                                   "run_s: the scenario's limit of 3 s is over\n|did not serve within 3 s"));
  const auto broken =
      write("broken.textproto",
            "name: \"broken\"\ndo { start { set: \"solver.name=spaghetti\" } }\ndo { step: 1 }\n");
  EXPECT_EQ(run({"--scenario", broken.string()}), 2);
  EXPECT_THAT(text_of("said"), AllOf(HasSubstr("the server did not start"), HasSubstr("known: dftl")));
}

// Whoever misspelt something has no server to look into.
TEST_F(ScenarioProgram, WhatIsWrongInTheFileIsExitCodeTwo) {
  const std::string begin = std::string("name: \"wrong\"\n") + kStart;
  const std::string end = "do { expect { no_quarantine: true } }\n";
  const std::pair<std::string, const char*> kWrong[] = {
      {begin + "do { view { name: \"a\" } } do { expect { viewer: \"bob\" mode: \"strands\" } }\n",
       "expect: there is no viewer 'bob'\n"},
      {begin + "do { step: 1 }\ndo { expect { same_as: \"here\" } }\n",
       "expect: no state was remembered as 'here': remember comes first\n"},
      {begin + "do { feed { motion: \"none.bvh\" } }\n" + end, "none.bvh"},
      {"name: \"wrong\"\ndo { start { set: \"groom.procedural.strand_count=20\" } }\ndo { step: 1 }\n" + end,
       "step: steps need start { lockstep: true }, or command: PAUSE before them; the server says: Single"},
      {begin + "do { expect {} }\n", "wrong: nothing is expected in it"},
      {"name: \"wrong\"\ndo { step: 1 }\n" + end, "step: there is no server yet: begin with start"},
      {"name: \"wrong\"\ndo { start { scene: \"none.textproto\" } }\n" + end, "none.textproto"},
      {"name: \"wrong\"\ndo { start { set: \"qualty=fast\" } }\n" + end, "qualty"}};
  for (const auto& [text, sentence] : kWrong) {
    EXPECT_EQ(run({"--scenario", write("wrong.textproto", text).string()}), 2) << text << text_of("said");
    EXPECT_THAT(text_of("said"), HasSubstr(sentence));
  }
}

// Whoever copies what the page shows, with a clip beside it, has a test that holds.
TEST_F(ScenarioProgram, TheDocumentedOneHolds) {
  const std::filesystem::path source = STRANDCAST_SOURCE_DIR;
  std::ifstream page(source / "docs/use/test-a-server.md");
  std::string text, line;
  while (std::getline(page, line) && line != "```") {
  }
  while (std::getline(page, line) && line != "```") text += line + "\n";
  for (const char* folder : {"scenes", "scenarios"})
    std::filesystem::create_directory(folder_.path() / folder);
  std::filesystem::copy_file(source / "deploy/scenes/default.textproto",
                             folder_.path() / "scenes/default.textproto");
  std::filesystem::copy_file(source / "examples/files/walk.bvh", folder_.path() / "scenarios/walk.bvh");
  const std::string path = write("scenarios/mine.textproto", text).string();
  EXPECT_EQ(run({"--scenario", path, "--renew"}), 0) << text_of("said");
}

TEST_F(ScenarioProgram, PicturesAreRenewedBelowItsFolderOnly) {
  std::filesystem::create_directories(folder_.path() / "mine");
  std::filesystem::create_directory_symlink(folder_.path(), folder_.path() / "mine/link");
  const auto path = write("mine/look.textproto",
                          std::string("name: \"look\"\n") + kStart +
                              "do { view { name: \"a\" width: 64 height: 48 } }\n"
                              "do { step: 6 }\n"
                              "do { expect { viewer: \"a\" picture { golden: \"golden/in.png\" } } }\n"
                              "do { expect { viewer: \"a\" picture { golden: \"../out.png\" } } }\n"
                              "do { expect { viewer: \"a\" picture { golden: \"link/out.png\" } } }\n");
  EXPECT_EQ(run({"--scenario", path.string(), "--renew"}), 1) << text_of("said");
  EXPECT_THAT(text_of("said"),
              AllOf(HasSubstr("ok    line 5"), HasSubstr("FAIL  line 6"), HasSubstr("FAIL  line 7"),
                    HasSubstr("does not lie below the scenario's folder")));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() / "mine/golden/in.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out.png"));
}

// What the server draws in lockstep is sent finely once more, and that is stored: every run has its bytes.
TEST_F(ScenarioProgram, PicturesOfTheServerAreTheSameInEveryRunInLockstep) {
  const auto path =
      write("frames.textproto", std::string("name: \"frames\"\n") + kStart +
                                    "do { view { name: \"a\" mode: \"frames\" width: 96 height: 64 } }\n"
                                    "do { feed { motion: \"builtin\" from_s: 2 } }\n"
                                    "do { step: 30 }\n"
                                    "do { expect { picture { golden: \"seen.png\" db_above: 98 } } }\n");
  EXPECT_EQ(run({"--scenario", path.string(), "--renew"}), 0) << text_of("said");
  const std::string first = text_of("seen.png");
  EXPECT_EQ(run({"--scenario", path.string(), "--renew"}), 0) << text_of("said");
  EXPECT_EQ(text_of("seen.png"), first);
  EXPECT_EQ(run({"--scenario", path.string()}), 0) << text_of("said");
  EXPECT_THAT(text_of("said"), HasSubstr("measured 99.0 dB")) << "no difference at all";
}

TEST_F(ScenarioProgram, HeadsOfALockstepAreFedAndSteppedTogether) {
  const std::string scene = std::string(STRANDCAST_SOURCE_DIR) + "/deploy/scenes/two_heads.textproto";
  const auto path = write("two.textproto", "name: \"two\"\ndo { start { scene: \"" + scene +
                                               "\" lockstep: true } }\n"
                                               "do { feed { motion: \"shake\" } }\n"
                                               "do { step: 20 }\n"
                                               "do { expect { metric { name: \"strandcast_sim_steps_total\" "
                                               "equals: 20 } } }\n"
                                               "do { expect { metric { name: \"strandcast_input_accepted_"
                                               "total\" above: 19 } } }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 0) << text_of("said");
}

TEST_F(ScenarioProgram, AWrongFileIsExitCodeTwoAndOneSentence) {
  const auto path = write("typo.textproto", "name: \"typo\"\ndo { stepp: 1 }\n");
  EXPECT_EQ(run({"--scenario", path.string()}), 2);
  EXPECT_THAT(text_of("said"),
              AllOf(HasSubstr("typo.textproto:2:11"), HasSubstr("known: start, feed, step")));
  EXPECT_EQ(run({"--scenario", "/no/such/file"}), 2);
  EXPECT_THAT(text_of("said"), HasSubstr("/no/such/file"));
}

// What ships for people to begin with, as they run it.
class ShippedScenario : public ScenarioProgram, public testing::WithParamInterface<const char*> {};

TEST_P(ShippedScenario, Holds) {
  const std::filesystem::path path = std::filesystem::path(STRANDCAST_SOURCE_DIR) / "deploy/scenarios" /
                                     (std::string(GetParam()) + ".textproto");
  EXPECT_EQ(run({"--scenario", path.string()}), 0) << text_of("said");
}

INSTANTIATE_TEST_SUITE_P(All, ShippedScenario,
                         testing::Values("auto_mode", "bad_input", "broken_line", "calm_stream", "full_disk",
                                         "hostile", "look", "lossy_line", "pace", "relay_dies", "rest",
                                         "restart", "same_bits", "shake", "slow_motion", "thin_line"),
                         [](const auto& one) { return std::string(one.param); });

}  // namespace
}  // namespace strandcast::scenario_program_test
