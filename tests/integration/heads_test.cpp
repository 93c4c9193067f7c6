// Several heads on one server: each has inputs, states and viewers of its own, and nothing of the others.
#include <gmock/gmock.h>

#include <cmath>
#include <map>
#include <mutex>

#include "client/app/headless_view.h"
#include "common/pictures/image_codec.h"
#include "common/scene/scene_file.h"
#include "tests/support/live_packets.h"
#include "tests/support/metrics_text.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/udp_socket.h"

namespace strandcast {
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
    ServerConfig config;
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

TEST_F(Heads, WhatTakesOneHeadSaysSo) {
  ServerConfig config;
  config.scene = two_heads();
  config.net.port = 0;
  const TemporaryFolder folder;
  config.record = RecordConfig{folder.path() / "run.mcap", IfPresent::Refuse};
  const auto server = Server::start(config);
  ASSERT_FALSE(server);
  EXPECT_THAT(server.error().to_string(),
              HasSubstr("--record, --record-dir and --trace take scenes of one head"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "run.mcap"));
  config.record.reset();
  config.record_folder = RecordFolder{folder.path()};
  const auto other = Server::start(config);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().to_string(), HasSubstr("--record-dir"));
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
}  // namespace strandcast
