// Recordings that who controls begins and ends while a server runs.
#include <gmock/gmock.h>

#include <atomic>
#include <fstream>
#include <map>

#include "client/app/recording_commands.h"
#include "client/app/recording_player.h"
#include "common/base/units.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "common/record/strand_frames.h"
#include "server/record/replay.h"
#include "tests/support/live_packets.h"
#include "tests/support/live_poses.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/udp_socket.h"

namespace strandcast::record_command_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::IsEmpty;

class RecordCommands : public test::ServerFixture {
 protected:
  ServerConfig config() const {
    ServerConfig config;
    config.scene = test::bald_scene(40, 8);
    config.scene.stream.codec = "delta";  // which rounds nothing
    config.scene.stream.has_codec = true;
    config.sim_device = "lanes";
    config.record_folder = RecordFolder{folder_.path(), [this](const auto&) { return free_bytes_.load(); }};
    return config;
  }
  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }
  size_t file_count() const {
    return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(folder_.path()), {}));
  }

  /// What a controller is told.
  Notice ask(const ClientMessage& message) {
    ClientConfig config = client_config(StreamMode::Strands, Role::Controller);
    config.hello.gets_no_stream = true;
    if (port_ != server_->port()) {
      auto controller = ViewerClient::connect(config);
      EXPECT_TRUE(controller);
      if (!controller) return {true, "no connection"};
      controller_ = std::move(controller).value();
      port_ = server_->port();
    }
    EXPECT_TRUE(controller_->send(message));
    Notice answer{true, "no answer"};
    EXPECT_TRUE(eventually([&] {
      for (const ClientEvent& event : controller_->wait(milliseconds(5)))
        if (const auto* notice = std::get_if<Notice>(&event)) return answer = *notice, true;
      return false;
    }));
    return answer;
  }
  Notice start_recording(const std::string& name = {}) { return ask(RecordCommand{true, name}); }
  Notice stop_recording() { return ask(RecordCommand{false, {}}); }

  uint64_t tick() const { return server_->counters().sim.tick; }
  void run_to(uint64_t until) {
    EXPECT_TRUE(eventually([&] { return tick() >= until; }));
  }
  /// Until so many states more are in the recording.
  void record_states(uint64_t count) {
    const auto states = [&] { return server_->counters().record.value_or(RecordCounters{}).states; };
    const uint64_t until = states() + count;
    EXPECT_TRUE(eventually([&] { return states() >= until; }));
  }
  static RecordingCheck check(const std::filesystem::path& path) {
    const auto check = check_recording(path);
    EXPECT_TRUE(check) << check.error().to_string();
    if (!check) return {};
    EXPECT_TRUE(check->is_sound()) << testing::PrintToString(check->problems);
    EXPECT_TRUE(check->is_whole);
    EXPECT_EQ(check->decoded_frames, check->frames);
    return *check;
  }
  static std::string replayed(const std::filesystem::path& path) {
    ReplayConfig config;
    config.recording = path;
    const auto result = replay_recording(config);
    if (!result) return result.error().to_string();
    return result->is_equal() ? "equal" : to_sentence(*result);
  }

  TemporaryFolder folder_;
  std::atomic<uint64_t> free_bytes_{2 * kMinFreeRecordBytes};
  std::unique_ptr<ViewerClient> controller_;
  uint16_t port_ = 0;  // that it is connected to
};

TEST_F(RecordCommands, BeginAndEndRecordingsOfAServerThatRuns) {
  if (!start(config())) return;
  std::map<uint64_t, uint64_t> seen;  // hashes by step, of what a viewer decoded
  const auto viewer = open(client_config());
  ASSERT_TRUE(viewer);
  viewer->set_snapshot_listener([&](const auto& state) { seen[state->tick] = state_hash(*state); });
  const std::vector<ViewerSession*> viewers = {viewer.get()};
  ASSERT_TRUE(pump_until(viewers, [&] { return seen.size() > 10; }));
  EXPECT_TRUE(viewer->status().recording.empty());

  const Notice begun = start_recording("take 5");
  EXPECT_FALSE(begun.is_error) << begun.text;
  EXPECT_THAT(begun.text, HasSubstr(file("take 5.mcap").string()));
  ASSERT_THAT(begun.text, HasSubstr("from step "));
  const uint64_t begin_tick = std::stoull(begun.text.substr(begun.text.find("from step ") + 10));
  ASSERT_TRUE(pump_until(viewers, [&] {
    return viewer->status().recording.starts_with("take 5.mcap: ") && seen.rbegin()->first > begin_tick + 30;
  }));
  EXPECT_EQ(run_command(ctl_target(), SetParameter{"look.hair_color=red"}), kDoneExit);
  // What is written so far can be looked at.
  ASSERT_TRUE(pump_until(viewers, [&] { return server_->counters().record->written_bytes > 0; }));
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_recording_check(file("take 5.mcap")), kRefusedExit);
  EXPECT_THAT(testing::internal::GetCapturedStdout(),
              HasSubstr("sound so far: cut off, or still being written"));
  const Notice second = start_recording("take 6");
  EXPECT_TRUE(second.is_error);
  EXPECT_THAT(second.text, HasSubstr("take 5.mcap is being recorded already"));
  const uint64_t told_tick = tick();
  ASSERT_TRUE(pump_until(viewers, [&] { return seen.rbegin()->first > told_tick + 10; }));
  const Notice ended = stop_recording();
  EXPECT_FALSE(ended.is_error) << ended.text;
  EXPECT_THAT(ended.text,
              testing::AllOf(HasSubstr("take 5.mcap: "), HasSubstr("states"), HasSubstr("nothing lost")));
  ASSERT_TRUE(pump_until(viewers, [&] { return viewer->status().recording.empty(); }));
  EXPECT_FALSE(server_->counters().record);
  EXPECT_EQ(file_count(), 1u);

  const RecordingCheck checked = check(file("take 5.mcap"));
  EXPECT_GT(checked.states, 30u);
  EXPECT_EQ(checked.equal_states, checked.frames) << "strands are what was published, bit for bit";
  // And what a viewer saw.
  const auto reader = RecordingReader::open(file("take 5.mcap"));
  ASSERT_TRUE(reader) << reader.error().to_string();
  auto frames = StrandFrames::begin(**reader);
  ASSERT_TRUE(frames);
  size_t compared = 0;
  for (auto state = frames->next(); state && *state; state = frames->next()) {
    const auto found = seen.find((*state)->tick);
    if (found == seen.end()) continue;
    EXPECT_EQ(state_hash(**state), found->second) << (*state)->tick;
    ++compared;
  }
  EXPECT_GT(compared, 20u);

  // It plays, with the look of each moment, and says why it cannot be simulated again.
  auto player = RecordingPlayer::open(file("take 5.mcap"));
  ASSERT_TRUE(player) << player.error().to_string();
  EXPECT_GT((*player)->length_s(), 0.4);
  ASSERT_TRUE((*player)->strands_at(0.0));
  EXPECT_NE((*player)->look().look.hair_color, "red");
  ASSERT_TRUE((*player)->strands_at((*player)->length_s()));
  EXPECT_EQ((*player)->look().look.hair_color, "red");
  const auto first = first_recorded_tick(file("take 5.mcap"));
  ASSERT_TRUE(first);
  EXPECT_GT(*first, 10u);
  EXPECT_LE(*first, begin_tick + 1);
  EXPECT_THAT(replayed(file("take 5.mcap")),
              HasSubstr(fmt::format("it began while the simulation ran, at step {}", *first)));
}

// Who follows the head hears of wind, timecode and take, too.
TEST_F(RecordCommands, WhoFollowsTheHeadIsTold) {
  const test::UdpSocket vmc, tracks;
  ServerConfig config = this->config();
  config.scene.wind = {};  // without gusts
  config.scene.wind.mean_mps = {1.0f, -0.5f, 2.0f};
  config.timecode = Timecode{{25, 1}};
  config.clock = StageClock::open("utc").value();
  config.sends = {{"vmc", {"127.0.0.1", vmc.port()}}, {"opentrackio", {"127.0.0.1", tracks.port()}}};
  if (!start(std::move(config))) return;
  const auto of_vmc = test::live_parser_of("vmc");
  EXPECT_TRUE(eventually([&] {
    const auto packet = of_vmc->parse(vmc.take(), 0);
    return packet && packet->wind_mps && glm::distance(*packet->wind_mps, glm::dvec3(1.0, -0.5, 2.0)) < 1e-5;
  }));
  const auto of_tracks = test::live_parser_of("opentrackio");
  // The clock is read twice a second.
  std::optional<Timecode> timecode;
  double sent_s = 0.0;
  ASSERT_TRUE(eventually([&] {
    const auto packet = of_tracks->parse(tracks.take(), 0);
    if (!packet || packet->poses.empty()) return false;
    timecode = packet->poses[0].timecode;
    sent_s = static_cast<double>(packet->poses[0].source_time_ns.value_or(0)) * 1e-9;
    return timecode.has_value();
  }));
  const StageClock utc = StageClock::open("utc").value();
  EXPECT_LT(std::abs(frames_between(*timecode, utc.timecode({{25, 1}}))), 50.0) << timecode_text(*timecode);
  EXPECT_LT(std::abs(sent_s - static_cast<double>(utc.time_ns()) * 1e-9), 2.0);
  const auto take = [&](bool is_wanted) {
    std::optional<LiveTake> found;
    EXPECT_TRUE(eventually([&] {
      const auto packet = of_tracks->parse(tracks.take(), 0);
      if (packet) found = packet->take;
      return packet && found && found->is_wanted == is_wanted;
    })) << is_wanted;
    return found.value_or(LiveTake{});
  };
  EXPECT_FALSE(ask(RecordCommand{true, "", "12A", 3}).is_error);
  EXPECT_EQ(take(true).slate, "12A-T03");
  EXPECT_FALSE(ask(RecordCommand{false}).is_error);
  (void)take(false);
}

// A take on a stage: its file has slate, take and timecode, of each state and of the replay.
TEST_F(RecordCommands, SaySlateTakeAndTheTimecodeOfStates) {
  if (!start(config())) return;
  const auto viewer = open(client_config());
  ASSERT_TRUE(viewer);
  ClientConfig source_config = client_config(StreamMode::Strands, Role::Source);
  source_config.hello.gets_no_stream = true;
  const auto source = ViewerClient::connect(source_config);
  ASSERT_TRUE(source);
  const Timecode hour = *parse_timecode("01:00:00:00", {24, 1});
  const int64_t begin_ns = now_ns();
  const auto feed_one = [&] {
    const int64_t time_ns = now_ns();
    MotionSamples samples{{{time_ns, Pose{}}}};
    samples.timecode = advanced(hour, static_cast<double>(time_ns - begin_ns) * 1e-9 * 24.0);
    EXPECT_TRUE((*source)->send(samples));
  };
  const std::vector<ViewerSession*> viewers = {viewer.get()};
  ASSERT_TRUE(pump_until(viewers, [&] {
    feed_one();
    return viewer->status().timecode.has_value();
  }));
  const Notice begun = ask(RecordCommand{true, "", "12A", 3});
  EXPECT_THAT(begun.text, HasSubstr("12A-T03.mcap"));
  ASSERT_TRUE(pump_until(viewers, [&] {
    feed_one();
    return viewer->status().recording.ends_with(", slate 12A, take 3") &&
           server_->counters().record->states > 20;
  }));
  EXPECT_FALSE(stop_recording().is_error);
  const auto reader = RecordingReader::open(file("12A-T03.mcap"), RecordedPart::Messages);
  ASSERT_TRUE(reader);
  EXPECT_EQ((*reader)->start().slate, "12A");
  EXPECT_EQ((*reader)->start().take, 3u);
  std::map<uint64_t, std::optional<Timecode>> steps, states;
  while (true) {
    const auto item = (*reader)->next();
    ASSERT_TRUE(item) << item.error().to_string();
    if (!*item) break;
    const auto* message = std::get_if<RecordedMessage>(&(*item)->what);
    if (message == nullptr) continue;
    if (const auto* step = std::get_if<RecordedStep>(message)) steps[step->tick] = step->timecode;
    if (const auto* state = std::get_if<RecordedState>(message)) states[state->tick] = state->timecode;
  }
  ASSERT_GT(states.size(), 20u);
  std::optional<Timecode> before;
  for (const auto& [tick, timecode] : states) {
    ASSERT_TRUE(timecode) << tick;
    EXPECT_EQ(fields_of(*timecode).hours, 1u);
    if (steps.contains(tick)) {
      EXPECT_EQ(timecode, steps[tick]) << "as the step took it";
    }
    if (before) {
      EXPECT_GE(frames_between(*before, *timecode), 0.0);
    }
    before = timecode;
  }
  check(file("12A-T03.mcap"));
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_recording_info(file("12A-T03.mcap")), kDoneExit);
  EXPECT_THAT(testing::internal::GetCapturedStdout(), HasSubstr("slate 12A, take 3"));
}

TEST_F(RecordCommands, AnswerWhyNot) {
  if (!start(config())) return;
  EXPECT_THAT(stop_recording().text, HasSubstr("Nothing is being recorded"));
  for (const char* name : {"../take", "a/b", "/take", ".take", "a..b", "Szene\xc3\xa4", "take*", "-take",
                           " take", "take.", "take ", "take\\5", "..", ".", ".mcap", "take:5"}) {
    const Notice answer = start_recording(name);
    EXPECT_TRUE(answer.is_error) << name;
    EXPECT_THAT(answer.text, HasSubstr("cannot be called so")) << name;
  }
  EXPECT_TRUE(start_recording(std::string(kMaxRecordingNameChars + 1, 'x')).is_error);
  EXPECT_FALSE(recording_file_name("take\n5")) << "which is cleaned on its way";
  EXPECT_EQ(recording_file_name("take 5").value(), "take 5.mcap");
  EXPECT_EQ(recording_file_name("take 5.mcap").value(), "take 5.mcap");
  EXPECT_EQ(file_count(), 0u);
  // What is there stays, whatever it is.
  const std::filesystem::path there = folder_.write("there.mcap", "mine");
  std::filesystem::create_symlink(folder_.path() / "nowhere", file("link.mcap"));
  for (const char* name : {"there", "there.mcap", "link"}) {
    const Notice answer = start_recording(name);
    EXPECT_TRUE(answer.is_error) << name;
    EXPECT_THAT(answer.text, HasSubstr("is there already")) << name;
  }
  EXPECT_EQ(std::filesystem::file_size(there), 4u);
  EXPECT_FALSE(std::filesystem::exists(file("nowhere")));
  free_bytes_ = kMinFreeRecordBytes - 1;
  EXPECT_THAT(start_recording("take").text, HasSubstr("GB are free"));
  free_bytes_ = kMinFreeRecordBytes;
  EXPECT_EQ(file_count(), 2u);
  for (size_t i = 2; i < kMaxRecordings; ++i) folder_.write(fmt::format("{}.mcap", i), "");
  EXPECT_THAT(start_recording("take").text,
              HasSubstr(fmt::format("{} recordings are there", kMaxRecordings)));
  std::filesystem::remove(file("2.mcap"));
  // Without a name it has one of its own.
  const Notice begun = start_recording();
  EXPECT_FALSE(begun.is_error) << begun.text;
  EXPECT_THAT(begun.text, testing::ContainsRegex("/default-[0-9]{8}T[0-9]{6}Z\\.mcap"));
  EXPECT_FALSE(stop_recording().is_error);
}

TEST_F(RecordCommands, ASenderOfMotionBeginsAndEndsTakes) {
  ServerConfig on_stage = config();
  const uint16_t port = test::free_udp_port();
  on_stage.scene.live = {LiveDesc{.protocol = "vmc", .port = port}};
  if (!start(on_stage)) return;
  test::UdpSocket manager;
  const auto is_recorded = [&] { return server_->counters().record.has_value(); };
  const std::vector<test::OscValue> slate = {std::string("12A/x"), int32_t{3}};
  for (const char* const name : {"12A_x-T03.mcap", "12A_x-T03-2.mcap"}) {
    manager.send(test::osc("/strandcast/record/start", slate), port);
    ASSERT_TRUE(eventually(is_recorded)) << name;
    record_states(3);
    manager.send(test::osc("/strandcast/record/stop", {}), port);
    ASSERT_TRUE(eventually([&] { return !is_recorded(); }));
    const auto reader = RecordingReader::open(file(name));
    ASSERT_TRUE(reader) << reader.error().to_string();
    EXPECT_EQ((*reader)->start().slate, "12A/x");
    EXPECT_EQ((*reader)->start().take, 3u);
  }
}

TEST_F(RecordCommands, AreOfThoseWhoControl) {
  if (!start(config())) return;
  auto viewer = ViewerClient::connect(client_config(StreamMode::Strands, Role::Viewer));
  ASSERT_TRUE(viewer);
  ASSERT_TRUE((*viewer)->send(RecordCommand{true, "mine"}));
  std::string closed;
  EXPECT_TRUE(eventually([&] {
    for (const ClientEvent& event : (*viewer)->wait(milliseconds(5)))
      if (const auto* end = std::get_if<ClosedEvent>(&event)) closed = end->error.to_string();
    return !closed.empty();
  }));
  EXPECT_THAT(closed, HasSubstr("may not send RecordCommand"));
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(RecordCommands, NeedAFolder) {
  ServerConfig without = config();
  without.record_folder.reset();
  if (!start(without)) return;
  const Notice answer = start_recording("take");
  EXPECT_TRUE(answer.is_error);
  EXPECT_THAT(answer.text, HasSubstr("--record-dir"));
  server_->stop();
  // One that --record began is nobody's to end without it.
  without.record = RecordConfig{file("run.mcap"), IfPresent::Refuse};
  if (!start(without)) return;
  EXPECT_THAT(stop_recording().text, HasSubstr("--record-dir"));
  EXPECT_TRUE(server_->counters().record);
  ServerConfig nowhere = config();
  std::ofstream(file("in_the_way")) << "a file";
  nowhere.record_folder->path = file("in_the_way") / "takes";
  nowhere.net.port = 0;
  const auto refused = Server::start(nowhere);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), HasSubstr("no folder for recordings can be made here"));
}

TEST_F(RecordCommands, MakeAFolderThatIsMissing) {
  ServerConfig missing = config();
  missing.record_folder->path = file("deep") / "takes";
  if (!start(missing)) return;
  EXPECT_FALSE(start_recording("take").is_error);
  record_states(5);
  EXPECT_FALSE(stop_recording().is_error);
  EXPECT_GT(check(file("deep") / "takes" / "take.mcap").states, 4u);
}

TEST_F(RecordCommands, EndWhereTheDiskGetsFull) {
  if (!start(config())) return;
  EXPECT_FALSE(start_recording("take").is_error);
  record_states(20);
  free_bytes_ = kMinFreeRecordBytes / 2 - 1;
  EXPECT_TRUE(eventually([&] { return !server_->counters().record; }));
  const uint64_t end_tick = tick();
  EXPECT_GT(check(file("take.mcap")).states, 20u);
  const auto viewer = open(client_config());
  ASSERT_TRUE(viewer);
  ASSERT_TRUE(pump_until({viewer.get()}, [&] {
    return viewer->status().recording.find("it ended by itself") != std::string::npos;
  }));
  run_to(end_tick + 10);
  // Told once to whoever asks, and then there is none.
  const Notice told = stop_recording();
  EXPECT_TRUE(told.is_error);
  EXPECT_THAT(told.text, testing::AllOf(HasSubstr("take.mcap"), HasSubstr("it ended by itself")));
  EXPECT_THAT(stop_recording().text, HasSubstr("Nothing is being recorded"));
}

// Anybody on this machine may send a stop.
TEST_F(RecordCommands, ASenderEndsNoRecordingThatBeganWithTheServer) {
  ServerConfig both = config();
  both.record = RecordConfig{file("run.mcap"), IfPresent::Refuse};
  const uint16_t port = test::free_udp_port();
  both.scene.live = {LiveDesc{.protocol = "vmc", .port = port}};
  if (!start(both)) return;
  test::UdpSocket manager;
  manager.send(test::osc("/strandcast/record/start", {std::string("12A")}), port);
  ASSERT_TRUE(eventually([&] { return file_count() == 2u; }));
  record_states(3);
  for (int i = 0; i < 2; ++i) {
    manager.send(test::osc("/strandcast/record/stop", {}), port);
    record_states(10);
  }
  EXPECT_TRUE(server_->counters().record.has_value());
  const auto reader = RecordingReader::open(file("12A.mcap"));
  ASSERT_TRUE(reader) << reader.error().to_string();
  EXPECT_FALSE(stop_recording().is_error) << "a person may end it";
}

TEST_F(RecordCommands, EndTheRecordingThatBeganWithTheServer) {
  ServerConfig both = config();
  both.record = RecordConfig{file("run.mcap"), IfPresent::Refuse};
  if (!start(both)) return;
  run_to(20);
  EXPECT_EQ(run_command(ctl_target(), SetParameter{"substeps=2"}), kDoneExit);
  run_to(30);
  EXPECT_FALSE(stop_recording().is_error);
  EXPECT_GT(check(file("run.mcap")).states, 30u);
  EXPECT_EQ(replayed(file("run.mcap")), "equal") << "it began with the simulation";
  EXPECT_FALSE(start_recording("take").is_error);
  record_states(20);
  // A server that ends leaves a sound file.
  server_->stop();
  EXPECT_GE(check(file("take.mcap")).states, 20u);
  const auto reader = RecordingReader::open(file("take.mcap"));
  ASSERT_TRUE(reader);
  EXPECT_THAT((*reader)->start().scene_text, HasSubstr("substeps: 2")) << "as it runs, not as it began";
  const auto compared = compare_recordings(file("run.mcap"), file("take.mcap"));
  ASSERT_TRUE(compared) << compared.error().to_string();
  EXPECT_THAT(compared->notes, testing::Contains(HasSubstr("the second one begins at step")));
  EXPECT_THAT(compared->notes, testing::Contains(HasSubstr("no step in common")));
  EXPECT_FALSE(compared->first_different_tick);
}

TEST_F(RecordCommands, TakeAPartOfTheRecordingThatBeganWithTheServer) {
  ServerConfig both = config();
  both.record = RecordConfig{file("run.mcap"), IfPresent::Refuse};
  if (!start(both)) return;
  run_to(20);
  EXPECT_FALSE(start_recording("take").is_error);
  EXPECT_THAT(start_recording("other").text, HasSubstr("take.mcap is being recorded already"));
  const uint64_t of_whole = server_->counters().record->states;
  EXPECT_GT(of_whole, 20u) << "those of the whole recording too";
  run_to(60);
  EXPECT_THAT(stop_recording().text, HasSubstr("take.mcap"));
  const uint64_t end_tick = tick();
  run_to(end_tick + 20);
  EXPECT_THAT(stop_recording().text, HasSubstr("run.mcap"));
  EXPECT_GT(check(file("take.mcap")).states, 20u);
  EXPECT_GT(check(file("run.mcap")).states, end_tick);
  EXPECT_EQ(replayed(file("run.mcap")), "equal") << "takes leave no gap in it";
  const auto compared = compare_recordings(file("run.mcap"), file("take.mcap"));
  ASSERT_TRUE(compared) << compared.error().to_string();
  EXPECT_FALSE(compared->first_different_tick);
  EXPECT_THAT(compared->notes, testing::Not(testing::Contains(HasSubstr("no step in common"))));
}

TEST_F(RecordCommands, BeginWhereTimeStandsStill) {
  ServerConfig stepped = config();
  stepped.is_lockstep = true;
  if (!start(stepped)) return;
  const ControlCommand steps{Command::StepOnce, 20};
  // Before the first step it is a recording of all of it.
  EXPECT_FALSE(start_recording("whole").is_error);
  EXPECT_FALSE(ask(steps).is_error);
  EXPECT_FALSE(stop_recording().is_error);
  EXPECT_EQ(check(file("whole.mcap")).states, 21u);
  EXPECT_EQ(replayed(file("whole.mcap")), "equal");
  // Of one that begins later the state of then is there at once.
  EXPECT_THAT(start_recording("later").text, HasSubstr("from step 20 on"));
  EXPECT_TRUE(eventually([&] { return server_->counters().record->states == 1; }));
  EXPECT_FALSE(ask(steps).is_error);
  EXPECT_FALSE(stop_recording().is_error);
  EXPECT_EQ(check(file("later.mcap")).states, 21u);
  EXPECT_EQ(first_recorded_tick(file("later.mcap")), std::optional<uint64_t>(20));
  // Strands of the last state that somebody read are none of the next take's.
  EXPECT_FALSE(ask(ControlCommand{Command::StepOnce, 120}).is_error);
  EXPECT_FALSE(start_recording("after idling").is_error);
  EXPECT_FALSE(ask(steps).is_error);
  EXPECT_FALSE(stop_recording().is_error);
  const auto reader = RecordingReader::open(file("after idling.mcap"));
  ASSERT_TRUE(reader) << reader.error().to_string();
  const RecordingInfo& info = (*reader)->info();
  const double length_s = static_cast<double>(info.last_sim_time_ns - info.first_sim_time_ns) / kNsPerS;
  EXPECT_NEAR(length_s, 20.0 / stepped.scene.step_rate_hz, 2.0 / stepped.scene.step_rate_hz);
}

TEST_F(RecordCommands, HaveKeyframesOftenerWhereStepsTakeLonger) {
  // A second of these steps takes a processor as long as it may take to show a moment; of one substep, none
  // of the seconds below.
  ServerConfig costly = config();
  costly.scene = test::bald_scene(500, 8);
  costly.scene.substeps = 64;
  costly.scene.stream.codec = "step";
  costly.scene.stream.has_codec = true;
  costly.is_lockstep = true;
  if (!start(costly)) return;
  const auto step = [&](uint32_t count) {
    EXPECT_FALSE(ask(ControlCommand{Command::StepOnce, count}).is_error);
  };
  EXPECT_FALSE(start_recording("take").is_error);
  step(60);
  // What steps take is told with the server's status.
  EXPECT_TRUE(eventually([&] {
    for (const ClientEvent& event : controller_->wait(milliseconds(5)))
      if (const auto* status = std::get_if<ServerStatus>(&event); status != nullptr && status->tick >= 60)
        return true;
    return false;
  }));
  const uint64_t before = server_->counters().encode.keyframes;
  step(70);
  step(5);
  EXPECT_TRUE(eventually([&] { return server_->counters().encode.keyframes > before; }));
  EXPECT_FALSE(stop_recording().is_error);
  EXPECT_GT(check(file("take.mcap")).states, 130u);
}

}  // namespace
}  // namespace strandcast::record_command_test
