// Several heads on one server: each has inputs, states and viewers of its own, and nothing of the others.
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <mutex>

#include "client/app/views.h"
#include "common/base/file.h"
#include "common/pictures/image_codec.h"
#include "common/record/recording_check.h"
#include "common/record/recording_reader.h"
#include "common/scene/scene_file.h"
#include "server/app/head_files.h"
#include "server/record/replay.h"
#include "tests/support/live_packets.h"
#include "tests/support/made_abc.h"
#include "tests/support/metrics_text.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/udp_socket.h"

namespace strandcast::heads_test {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kToken = "0123456789abcdef";
constexpr glm::dvec3 kAnnasPlace(-0.5, 0.0, 0.0);
constexpr glm::dvec3 kBensPlace(0.5, 0.0, 0.0);

SceneDesc two_heads() {
  SceneDesc scene = test::bald_scene();
  scene.name = "anna";
  scene.place_m = kAnnasPlace;
  SceneDesc ben = scene;
  ben.name = "ben";
  ben.place_m = kBensPlace;
  ben.look.hair_color = "blond";
  scene.heads = {ben};
  return scene;
}

/// What one head published.
struct Published {
  std::map<uint64_t, uint64_t> hash_of_tick;
  Pose head;
};

class Heads : public test::ServerFixture {
 protected:
  [[nodiscard]] bool begin(SceneDesc scene = two_heads(), bool is_lockstep = false) {
    ServerConfig config = files_;
    config.scene = std::move(scene);
    config.sim_device = "lanes";
    config.is_lockstep = is_lockstep;
    if (is_lockstep) config.net.tokens = {{kToken, Grant::Admin}};
    config.make_source = [this](const ServerConfig& of_head, InputHub& inputs) {
      ServerConfig observed = of_head;
      observed.on_publish = [this, name = of_head.scene.name](const auto& state) {
        const std::lock_guard lock(mutex_);
        published_[name].hash_of_tick[state->tick] = state_hash(*state);
        published_[name].head = state->world_from_head;
      };
      return simulation_source(observed, inputs);
    };
    published_.clear();
    return start(std::move(config));
  }
  Published published(const std::string& head) {
    const std::lock_guard lock(mutex_);
    return published_[head];
  }
  bool is_head_at(const std::string& head, const glm::dvec3& place_m) {
    return glm::distance(published(head).head.position_m, place_m) < 1e-3;
  }
  ClientConfig config_for(const std::string& head, Role role = Role::Viewer) const {
    ClientConfig config = client_config(StreamMode::Strands, role);
    config.hello.head = head;
    config.hello.token = kToken;
    return config;
  }
  CtlTarget target_of(const std::string& head) const {
    CtlTarget target = ctl_target();
    target.head = head;
    target.token = kToken;
    return target;
  }

  ServerConfig files_;  // recordings and traces of a server that begins

 private:
  std::mutex mutex_;
  std::map<std::string, Published> published_;
};

/// A source that says over and over where the head is, while it is there.
class Feeder {
 public:
  explicit Feeder(const ClientConfig& config) {
    auto made = ViewerClient::connect(config);
    if (!made) ADD_FAILURE() << made.error().to_string();
    if (made) client_ = std::move(made).value();
  }
  void send(const glm::dvec3& place_m) {
    ASSERT_NE(client_, nullptr);
    (void)client_->send(MotionSamples{{{now_ns(), {place_m, {1.0, 0.0, 0.0, 0.0}}}}});
  }

 private:
  std::unique_ptr<ViewerClient> client_;
};

TEST_F(Heads, EachHearsItsOwnSourceAndNoOther) {
  constexpr uint32_t kSteps = 40;
  MotionSamples swing;
  for (int64_t tick = 0; tick <= kSteps; ++tick)
    swing.samples.push_back({tick * 1'000'000'000 / 60,
                             {{0.05 * std::sin(0.2 * static_cast<double>(tick)), 0.0, 0.0}, {1, 0, 0, 0}}});
  // The hair of both after some steps, where nobody says anything (no name) or one of them swings.
  const auto states = [&](const std::string& swinging) {
    std::map<std::string, std::map<uint64_t, uint64_t>> all;
    if (!begin(two_heads(), true)) return all;
    for (const char* head : {"anna", "ben"}) {
      ClientConfig config = config_for(head, Role::Admin);
      config.hello.gets_no_stream = true;
      const auto client = ViewerClient::connect(config);
      EXPECT_TRUE(client) << client.error().to_string();
      if (!client) return all;
      // One behind the other on one connection.
      if (head == swinging) {
        EXPECT_TRUE((*client)->send(swing));
      }
      EXPECT_TRUE((*client)->send(ControlCommand{Command::StepOnce, kSteps}));
      EXPECT_TRUE(eventually([&] { return published(head).hash_of_tick.contains(kSteps); }));
      all[head] = published(head).hash_of_tick;
    }
    server_->stop();
    server_.reset();
    return all;
  };
  auto still = states("");
  auto fed = states("ben");
  EXPECT_EQ(fed["anna"], still["anna"]) << "the same bits as if nobody fed the other";
  EXPECT_NE(fed["ben"], still["ben"]);
}

TEST_F(Heads, ASessionIsAboutTheHeadThatItNames) {
  if (!begin()) return;
  const auto first = open(config_for(""));
  const auto ben = open(config_for("ben"));
  ASSERT_TRUE(first && ben);
  EXPECT_THAT(first->welcome().heads, ElementsAre("anna", "ben"));
  EXPECT_EQ(first->welcome().scene_name, "anna");
  EXPECT_EQ(ben->welcome().scene_name, "ben");
  EXPECT_EQ(ben->welcome().look.hair_color, "blond");
  ASSERT_TRUE(
      pump_until({first.get(), ben.get()}, [&] { return first->has_picture() && ben->has_picture(); }));
  EXPECT_EQ(first->replay().newest()->world_from_head.position_m, kAnnasPlace) << "nothing moves it";
  EXPECT_EQ(ben->replay().newest()->world_from_head.position_m, kBensPlace);
  // Commands, too.
  EXPECT_EQ(run_command(target_of("ben"), ControlCommand{Command::Pause}), kDoneExit);
  EXPECT_EQ(run_command(target_of("ben"), SetParameter{"look.hair_color=red"}), kDoneExit);
  ASSERT_TRUE(pump_until({first.get(), ben.get()}, [&] {
    return ben->status().is_paused && ben->look().look.hair_color == "red" && first->has_status();
  }));
  EXPECT_FALSE(server_->counters(0).sim.is_paused);
  EXPECT_NE(first->look().look.hair_color, "red");
}

TEST_F(Heads, WhoNamesNoneStopsAndStepsAllOfThem) {
  if (!begin()) return;
  const auto sim = [this](size_t head) { return server_->counters(head).sim; };
  EXPECT_EQ(run_command(target_of(""), ControlCommand{Command::Pause}), kDoneExit);
  EXPECT_TRUE(sim(0).is_paused && sim(1).is_paused);
  const uint64_t first = sim(0).tick, other = sim(1).tick;
  EXPECT_EQ(run_command(target_of(""), ControlCommand{Command::StepOnce, 5}), kDoneExit);
  EXPECT_EQ(sim(0).tick, first + 5);
  EXPECT_EQ(sim(1).tick, other + 5);
  EXPECT_EQ(run_command(target_of("ben"), ControlCommand{Command::StepOnce, 2}), kDoneExit);
  EXPECT_EQ(sim(0).tick, first + 5);
  EXPECT_EQ(sim(1).tick, other + 7) << "the one that was named";
}

TEST_F(Heads, AnUnknownNameIsAnsweredWithThoseThereAre) {
  if (!begin()) return;
  const auto wrong = ViewerClient::connect(config_for("carl"));
  ASSERT_FALSE(wrong);
  EXPECT_THAT(wrong.error().to_string(),
              HasSubstr("There is no head called 'carl' here (there are: anna, ben)."));
}

TEST_F(Heads, AServerOfOneHeadSaysNothingOfHeads) {
  SceneDesc scene = test::bald_scene();
  scene.name = "anna";
  if (!begin(scene)) return;
  const auto session = open(config_for("anna"));
  ASSERT_NE(session, nullptr);
  EXPECT_THAT(session->welcome().heads, IsEmpty());
  EXPECT_EQ(test::http_get(server_->port(), "/metrics").find("head="), std::string::npos);
  EXPECT_FALSE(ViewerClient::connect(config_for("ben")));
}

TEST_F(Heads, OneThatNobodyMovesAnyMoreIsStaleAndTheOtherIsNot) {
  if (!begin()) return;
  const auto anna = open(config_for("anna"));
  const auto ben = open(config_for("ben"));
  ASSERT_TRUE(anna && ben);
  Feeder annas(config_for("anna", Role::Source));
  auto bens = std::make_unique<Feeder>(config_for("ben", Role::Source));
  ASSERT_TRUE(pump_until({anna.get(), ben.get()}, [&] {
    annas.send({0.0, 0.25, 0.0});
    bens->send({0.0, 0.125, 0.0});
    return is_head_at("anna", kAnnasPlace + glm::dvec3(0.0, 0.25, 0.0)) &&
           is_head_at("ben", kBensPlace + glm::dvec3(0.0, 0.125, 0.0)) && anna->has_status() &&
           ben->has_status() && !anna->status().is_motion_stale && !ben->status().is_motion_stale;
  }));
  bens.reset();
  ASSERT_TRUE(pump_until({anna.get(), ben.get()}, [&] {
    annas.send({0.0, 0.25, 0.0});
    return ben->status().is_motion_stale;
  }));
  EXPECT_FALSE(server_->counters(0).sim.is_motion_stale);
  EXPECT_FALSE(anna->status().is_motion_stale);
  EXPECT_TRUE(is_head_at("ben", kBensPlace + glm::dvec3(0.0, 0.125, 0.0))) << "it rests where it was";
}

TEST_F(Heads, AFeedThatNamesNoneMovesAllOfThem) {
  if (!begin()) return;
  const std::atomic<bool> stop = false;
  FeedOptions options;
  options.wind = "none";
  options.seconds = 0.5;
  // The built-in motion is that of a head as high as a person's.
  const auto is_high = [&](const std::string& head) { return published(head).head.position_m.y > 1.0; };
  ASSERT_EQ(run_feed(target_of("anna"), options, stop), kDoneExit);
  EXPECT_TRUE(eventually([&] { return is_high("anna"); }));
  EXPECT_TRUE(is_head_at("ben", kBensPlace)) << "who was not named";
  ASSERT_EQ(run_feed(target_of(""), options, stop), kDoneExit);
  EXPECT_TRUE(eventually([&] { return is_high("anna") && is_high("ben"); }));
}

// A groom in centimetres that another program has put on a head, which leans aside and goes on by 0.1 m.
TEST_F(Heads, CurvesThatMoveAsOneMoveTheHeadUnderTheServersHair) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "moving.abc";
  const glm::dvec3 head_in_file(0.0, 150.0, 0.0);
  const glm::dquat lean = glm::angleAxis(0.1, glm::dvec3(0, 0, 1));
  test::MadeCurves moving;
  moving.counts.assign(9, 2);
  for (int sample = 0; sample < 2; ++sample) {
    std::vector<glm::vec3>& points = moving.sample.emplace_back();
    for (int i = 0; i < 18; ++i) {
      const glm::dvec3 point(i / 2 % 3 * 5, 160 - i % 2 * 10, i / 6 * 4);
      points.emplace_back(sample == 0 ? point : lean * point + glm::dvec3(10, 0, 0));
    }
  }
  test::MadeAbc made(path);
  made.finish({made.curves(moving)});
  SceneDesc scene = two_heads();
  FileGroomDesc file;
  file.path = path;
  file.unit_m = 0.01f;
  file.has_up_axis = file.has_yaw = file.has_origin = true;
  file.origin = glm::vec3(head_in_file);
  scene.groom = file;
  if (!begin(scene)) return;
  const std::atomic<bool> stop = false;
  FeedOptions options;
  options.wind = "none";
  options.motion = path.string();
  EXPECT_EQ(run_feed(target_of("ben"), options, stop), kBadInputExit) << "this hair is of no file";
  ASSERT_EQ(run_feed(target_of("anna"), options, stop), kDoneExit);
  const glm::dvec3 moved_m = 0.01 * (lean * head_in_file - head_in_file) + glm::dvec3(0.1, 0.0, 0.0);
  EXPECT_TRUE(eventually([&] {
    return is_head_at("anna", kAnnasPlace + moved_m) &&
           angle_between_rad(published("anna").head.rotation, lean) < 1e-4;
  }));
}

TEST_F(Heads, OnePortTellsOfSeveralSubjectsAndEachHeadFollowsItsOwn) {
  const uint16_t port = test::free_udp_port();
  SceneDesc scene = two_heads();
  scene.live = {{.protocol = "freed", .port = port, .subject = "1"}};
  scene.heads[0].live = {{.protocol = "freed", .port = port, .subject = "2"}};
  if (!begin(scene)) return;
  test::UdpSocket tracker;
  const auto send = [&](uint8_t number, double height_mm) {
    test::FreedPacket packet;
    packet.camera = number;
    packet.position_mm = {0, 0, height_mm};
    tracker.send(test::freed(packet), port);
  };
  const glm::dvec3 high(0.0, 1.75, 0.0), low(0.0, 1.25, 0.0);
  EXPECT_TRUE(eventually([&] {
    send(1, 1'750);
    send(2, 1'250);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at("anna", kAnnasPlace + high) && is_head_at("ben", kBensPlace + low);
  }));
  // Whom one follows is nothing to the other.
  EXPECT_EQ(run_command(target_of("ben"), LiveCommand{LiveAction::ChooseSubject, "1"}), kDoneExit);
  EXPECT_TRUE(eventually([&] {
    send(1, 1'750);
    send(2, 1'250);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at("ben", kBensPlace + high);
  }));
  EXPECT_TRUE(is_head_at("anna", kAnnasPlace + high));
  ASSERT_EQ(server_->counters(1).live_inputs.size(), 1u);
  EXPECT_EQ(server_->counters(1).live_inputs[0].subject, "1");
}

TEST_F(Heads, MetricsTellThemApart) {
  if (!begin()) return;
  const std::string text = test::http_get(server_->port(), "/metrics");
  std::vector<std::string> faults;
  auto metrics = test::read_metrics(text.substr(text.find("\r\n\r\n") + 4), faults);
  test::check_metrics(metrics, faults);
  EXPECT_THAT(faults, IsEmpty());
  const auto names = [&](const std::string& family) {
    std::vector<std::string> all;
    for (const auto& [name, value] : metrics[family].samples) all.push_back(name);
    return all;
  };
  EXPECT_THAT(names("strandcast_sim_steps_total"), ElementsAre("strandcast_sim_steps_total{head=\"anna\"}",
                                                               "strandcast_sim_steps_total{head=\"ben\"}"));
  EXPECT_THAT(names("strandcast_build_info"), testing::SizeIs(1)) << "of the process";
  EXPECT_THAT(names("strandcast_viewers_strands_of_codec"),
              testing::Contains(HasSubstr("{head=\"ben\",codec=")));
}

TEST_F(Heads, TheSceneIsSavedWithAllOfThem) {
  if (!begin()) return;
  EXPECT_EQ(run_command(target_of("ben"), SetParameter{"look.hair_color=red"}), kDoneExit);
  const TemporaryFolder folder;
  EXPECT_EQ(run_save(ctl_target(), folder.path() / "saved.textproto"), kDoneExit);
  const auto saved = load_scene(folder.path() / "saved.textproto", {});
  ASSERT_TRUE(saved) << saved.error().to_string();
  SceneDesc expected = two_heads();
  expected.heads[0].look.hair_color = "red";
  EXPECT_EQ(*saved, expected);
}

TEST(HeadFiles, AreCalledAsTheHeadsAreAndStayInTheirFolder) {
  EXPECT_THAT(head_file_endings({"anna", "ben"}), ElementsAre("", "-ben"));
  EXPECT_EQ(with_file_ending("takes.d/run.mcap", "-ben"), "takes.d/run-ben.mcap");
  EXPECT_EQ(with_file_ending("takes.d/run", "-ben"), "takes.d/run-ben");
  EXPECT_EQ(with_file_ending("run.1.csv", ""), "run.1.csv");
  // Whatever a head is called, and where two of them would be called alike.
  const std::vector<std::string> endings = head_file_endings(
      {"../x", "../../etc/passwd", "Ben", "ben", "\xc3\xa4", "\xc3\xb6", "ben-4", "a b\\c"});
  EXPECT_THAT(endings,
              ElementsAre("", "-______etc_passwd", "-Ben", "-ben-4", "-__", "-__-6", "-ben-4-7", "-a_b_c"));
  for (const std::string& ending : endings)
    EXPECT_EQ(with_file_ending("takes/run.mcap", ending).parent_path(), "takes");
  EXPECT_LT(head_file_endings({"anna", std::string(64, 'x')}).back().size(), 40u);
}

/// What a file holds of one head.
void expect_recorded(const std::filesystem::path& path, const SceneDesc& scene, const Published& published) {
  const auto check = check_recording(path);
  ASSERT_TRUE(check) << check.error().to_string();
  EXPECT_TRUE(check->is_sound()) << testing::PrintToString(check->problems);
  const auto reader = RecordingReader::open(path, RecordedPart::Messages);
  ASSERT_TRUE(reader) << reader.error().to_string();
  const auto recorded = parse_scene((*reader)->start().scene_text, "test", {});
  ASSERT_TRUE(recorded) << recorded.error().to_string();
  EXPECT_EQ(recorded->name, scene.name);
  EXPECT_THAT(recorded->heads, IsEmpty());
  EXPECT_EQ(recorded->place_m, scene.place_m);
  EXPECT_EQ(recorded->solver.name, scene.solver.name);
  std::map<uint64_t, uint64_t> hash_of_tick;
  for (auto item = (*reader)->next(); item && *item; item = (*reader)->next())
    if (const auto* state = std::get_if<RecordedState>(&std::get<RecordedMessage>((*item)->what)))
      hash_of_tick[state->tick] = state->state_hash;
  EXPECT_EQ(hash_of_tick, published.hash_of_tick);
  // From the file alone.
  ReplayConfig config;
  config.recording = path;
  const auto replayed = replay_recording(config);
  ASSERT_TRUE(replayed) << replayed.error().to_string();
  EXPECT_TRUE(replayed->is_equal()) << to_sentence(*replayed);
  EXPECT_EQ(replayed->compared, published.hash_of_tick.size());
}

std::vector<std::string> lines_of(const std::filesystem::path& path) {
  const auto text = load_file(path, 1u << 20);
  EXPECT_TRUE(text) << text.error().to_string();
  std::vector<std::string> lines(1);
  if (!text) return lines;
  for (const std::byte byte : *text)
    if (const char character = static_cast<char>(byte); character == '\n')
      lines.emplace_back();
    else
      lines.back() += character;
  lines.pop_back();
  return lines;
}

TEST_F(Heads, EachIsRecordedAndTracedInAFileOfItsOwn) {
  constexpr uint32_t kSteps = 30;
  const TemporaryFolder folder;
  const auto file = [&](const char* name) { return folder.path() / name; };
  files_.record = RecordConfig{file("run.mcap"), IfPresent::Refuse};
  files_.trace_path = file("states.csv");
  SceneDesc scene = two_heads();
  std::get<ProceduralGroomDesc>(scene.heads[0].groom).strand_count = 60;
  scene.heads[0].solver.name = "pbd";
  if (!begin(scene, true)) return;
  for (const char* head : {"anna", "ben"}) {
    ClientConfig config = config_for(head, Role::Admin);
    config.hello.gets_no_stream = true;
    const auto client = ViewerClient::connect(config);
    ASSERT_TRUE(client) << client.error().to_string();
    MotionSamples swing;
    for (int64_t tick = 0; tick <= kSteps; ++tick)
      swing.samples.push_back(
          {tick * 1'000'000'000 / 60,
           {{0.05 * std::sin(0.2 * static_cast<double>(tick)), head[0] == 'b' ? 0.1 : 0.0, 0.0},
            {1, 0, 0, 0}}});
    EXPECT_TRUE((*client)->send(swing));
    EXPECT_TRUE((*client)->send(SetParameter{"substeps=2"}));
    EXPECT_TRUE((*client)->send(ControlCommand{Command::StepOnce, kSteps}));
    EXPECT_TRUE(eventually([&] { return published(head).hash_of_tick.contains(kSteps); }));
  }
  EXPECT_NE(server_->counters(0).record, std::nullopt);
  EXPECT_NE(server_->counters(1).record, std::nullopt);
  server_->stop();
  server_.reset();
  expect_recorded(file("run.mcap"), scene, published("anna"));
  expect_recorded(file("run-ben.mcap"), scene.heads[0], published("ben"));
  // They are two runs: no state of one is of the other.
  EXPECT_NE(published("anna").hash_of_tick, published("ben").hash_of_tick);
  for (const char* name : {"states.csv", "states-ben.csv"}) {
    const auto lines = lines_of(file(name));
    ASSERT_EQ(lines.size(), 1 + published("ben").hash_of_tick.size()) << name;
    EXPECT_THAT(lines[0], testing::StartsWith("tick,sim_time_ns,"));
    EXPECT_THAT(lines.back(), testing::StartsWith(std::to_string(kSteps) + ",")) << name;
  }
  // No file is written over, whichever head's it is, and none is begun then.
  std::filesystem::remove(file("run.mcap"));
  files_.scene = scene;
  files_.net.port = 0;
  const auto refused = Server::start(files_);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().to_string(), HasSubstr("run-ben.mcap: the file is there already"));
  EXPECT_FALSE(std::filesystem::exists(file("run.mcap")));
}

/// Recordings by command.
class HeadRecords : public Heads {
 protected:
  HeadRecords() {
    files_.record_folder = RecordFolder{folder_.path(), [](const auto&) { return kMuchSpace; }};
  }
  /// What a controller is told who names this head, or none.
  Notice ask(const std::string& head, const RecordCommand& command) {
    ClientConfig config = config_for(head, Role::Controller);
    config.hello.gets_no_stream = true;
    auto client = ViewerClient::connect(config);
    Notice answer{true, "no answer"};
    EXPECT_TRUE(client && (*client)->send(command));
    if (!client) return answer;
    EXPECT_TRUE(eventually([&] {
      for (const ClientEvent& event : (*client)->wait(std::chrono::milliseconds(5)))
        if (const auto* notice = std::get_if<Notice>(&event)) return answer = *notice, true;
      return false;
    }));
    return answer;
  }
  void record_states(size_t head, uint64_t count) {
    EXPECT_TRUE(eventually(
        [&] { return server_->counters(head).record.value_or(RecordCounters{}).states >= count; }));
  }
  bool is_sound(const char* name) const {
    const auto check = check_recording(folder_.path() / name);
    return check && check->is_sound() && check->is_whole && check->states > 0;
  }

  static constexpr auto kMuchSpace = std::optional<uint64_t>(4 * kMinFreeRecordBytes);
  TemporaryFolder folder_;
};

TEST_F(HeadRecords, WhoSeesAllRecordsAllAndWhoNamesOneThatOne) {
  if (!begin()) return;
  const auto whole = open(config_for(""));
  const auto anna = open(config_for("anna"));
  const auto ben = open(config_for("ben"));
  ASSERT_TRUE(whole && anna && ben);
  const std::vector<ViewerSession*> viewers = {whole.get(), anna.get(), ben.get()};
  // The recordings that the three of them hear of.
  const auto told = [&](const auto& of_whole, const auto& of_anna, const auto& of_ben) {
    return pump_until(viewers, [&] {
      return whole->has_status() && testing::Matches(of_whole)(whole->status().recording) &&
             testing::Matches(of_anna)(anna->status().recording) &&
             testing::Matches(of_ben)(ben->status().recording);
    });
  };
  const auto is_of = [](const char* file) { return testing::StartsWith(std::string(file) + ": "); };
  EXPECT_THAT(ask("", {false, {}}).text, HasSubstr("Nothing is being recorded"));

  const Notice begun = ask("", {true, "take"});
  EXPECT_FALSE(begun.is_error) << begun.text;
  EXPECT_THAT(begun.text, AllOf(HasSubstr("/take.mcap from step"), HasSubstr("/take-ben.mcap from step")));
  EXPECT_TRUE(told(AllOf(is_of("take.mcap"), HasSubstr(" | take-ben.mcap: ")),
                   AllOf(is_of("take.mcap"), testing::Not(HasSubstr("ben"))), is_of("take-ben.mcap")));
  record_states(0, 5);
  record_states(1, 5);
  // One of them, which the others notice.
  const Notice ended = ask("ben", {false, {}});
  EXPECT_FALSE(ended.is_error) << ended.text;
  EXPECT_THAT(ended.text, AllOf(HasSubstr("take-ben.mcap: "), testing::Not(HasSubstr("take.mcap"))));
  EXPECT_TRUE(told(testing::EndsWith(" | not of ben"), is_of("take.mcap"), IsEmpty()));
  EXPECT_FALSE(server_->counters(1).record);
  EXPECT_THAT(ask("ben", {true, "take"}).text, HasSubstr("take-ben.mcap is there already"));
  // All, of whom one is recorded: the other begins.
  const Notice mixed = ask("", {true, "more"});
  EXPECT_TRUE(mixed.is_error);
  EXPECT_THAT(mixed.text, AllOf(testing::StartsWith("anna: take.mcap is being recorded already"),
                                HasSubstr("/more-ben.mcap from step")));
  record_states(1, 5);
  const Notice all_ended = ask("", {false, {}});
  EXPECT_FALSE(all_ended.is_error) << all_ended.text;
  EXPECT_THAT(all_ended.text, AllOf(HasSubstr("take.mcap: "), HasSubstr("more-ben.mcap: "),
                                    testing::EndsWith("nothing lost.")));
  EXPECT_TRUE(told(IsEmpty(), IsEmpty(), IsEmpty()));
  for (const char* name : {"take.mcap", "take-ben.mcap", "more-ben.mcap"})
    EXPECT_TRUE(is_sound(name)) << name;
  // Without a name each has its head's, and what all say alike is said once.
  EXPECT_THAT(ask("", {true, "../x"}).text,
              AllOf(testing::StartsWith("A recording cannot be called so"), testing::Not(HasSubstr("ben"))));
  EXPECT_THAT(ask("", {true, {}}).text,
              testing::ContainsRegex("/anna-[0-9TZ]+\\.mcap from step .*/ben-[0-9TZ]+\\.mcap from step"));
  EXPECT_FALSE(ask("", {false, {}}).is_error);
}

TEST_F(HeadRecords, KeepTheLimitsOfTheFolderTogether) {
  for (size_t i = 1; i < kMaxRecordings; ++i) folder_.write(fmt::format("{}.mcap", i), "");
  if (!begin()) return;
  const Notice begun = ask("", {true, "take"});
  EXPECT_TRUE(begun.is_error);
  EXPECT_THAT(begun.text, AllOf(HasSubstr(" from step "),
                                HasSubstr(fmt::format("{} recordings are there", kMaxRecordings))));
  EXPECT_NE(std::filesystem::exists(folder_.path() / "take.mcap"),
            std::filesystem::exists(folder_.path() / "take-ben.mcap"));
}

/// The picture of a server that a viewer without a window leaves.
class HeadPictures : public Heads {
 protected:
  static constexpr RenderSize kSize{320, 120};
  static constexpr double kSomeHair = 0.004;  // of bald heads: a few thin strands

  Image picture(StreamMode mode, const std::string& head = {}) {
    ViewOptions options;
    options.address = {"127.0.0.1", server_->port()};
    options.is_headless = true;
    options.mode = mode;
    options.head = head;
    options.size = kSize;
    options.after_frames = 3;
    options.drawing.renderer = "tiles";
    options.screenshot = folder_.path() / "seen.png";
    const std::atomic<bool> stop{false};
    const auto report = run_headless(options, stop);
    EXPECT_TRUE(report) << report.error().to_string();
    const auto image = load_png(options.screenshot);
    EXPECT_TRUE(image) << image.error().to_string();
    return image ? *image : Image{};
  }
  /// Share of a part of the picture, between two columns, that is not as its first column.
  static double drawn_share(const Image& image, uint32_t begin, uint32_t end) {
    uint32_t drawn = 0;
    for (uint32_t y = 0; y < image.height; ++y)
      for (uint32_t x = begin; x < end; ++x) {
        const uint8_t* const pixel = &image.rgba[4 * (size_t{y} * image.width + x)];
        const uint8_t* const edge = &image.rgba[4 * size_t{y} * image.width];
        int apart = 0;
        for (int c = 0; c < 3; ++c) apart = std::max(apart, std::abs(pixel[c] - edge[c]));
        drawn += apart > 24 ? 1 : 0;
      }
    return static_cast<double>(drawn) / ((end - begin) * image.height);
  }

  TemporaryFolder folder_;
};

SceneDesc seen_from_afar() {
  SceneDesc scene = two_heads();
  scene.stream.frame_width = 320;
  scene.stream.frame_height = 120;
  scene.camera.offset_m = {0.0f, 0.0f, 2.0f};
  scene.heads[0].camera = scene.camera;
  return scene;
}

TEST_F(HeadPictures, AViewerShowsAllOfThemOrTheOneThatItNames) {
  if (!begin(seen_from_afar())) return;
  for (const StreamMode mode : {StreamMode::Strands, StreamMode::Frames}) {
    const Image both = picture(mode);
    ASSERT_EQ(both.width, kSize.width);
    // The camera looks at the middle between them, where nobody is.
    EXPECT_GT(drawn_share(both, 60, 140), kSomeHair) << to_string(mode);
    EXPECT_GT(drawn_share(both, 180, 260), kSomeHair) << to_string(mode);
    EXPECT_EQ(drawn_share(both, 150, 170), 0.0) << to_string(mode);
  }
  const Image ben = picture(StreamMode::Strands, "ben");
  EXPECT_GT(drawn_share(ben, 120, 200), kSomeHair);
  EXPECT_EQ(drawn_share(ben, 20, 80), 0.0);
}

}  // namespace
}  // namespace strandcast::heads_test
