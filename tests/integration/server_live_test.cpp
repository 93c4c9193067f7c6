// A whole server in this process against raw clients: late join, lost and stalled clients, commands, live
// changes, sources and frame viewers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <map>
#include <optional>
#include <thread>

#include "common/pictures/image_codec.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"

namespace strandcast::server_live_test {
namespace {

using test::RawClient;
using testing::HasSubstr;

constexpr uint32_t kStrands = 150;
constexpr uint32_t kVertices = 8;

/// A client that decodes strands like a viewer.
class StrandClient {
 public:
  StrandClient(uint16_t port, Role role, int receive_buffer_bytes = 0, uint32_t asset_layout = 0)
      : raw(port, receive_buffer_bytes) {
    EXPECT_TRUE(raw.handshake());
    Hello hello;
    hello.role = role;
    hello.name = "test";
    hello.asset_layout = asset_layout;
    raw.send(hello);
    const auto answer = raw.read_control<Welcome>();
    EXPECT_TRUE(answer.has_value());
    if (answer) welcome = *answer;
    auto made = make_strand_decoder(welcome.codec, {welcome.strand_count, welcome.vertex_count});
    EXPECT_TRUE(made.ok());
    if (made.ok()) decoder_ = std::move(*made);
  }

  /// The next state; null at the end of the connection.
  std::shared_ptr<const Snapshot> next() {
    while (states_.empty())
      if (!receive()) return nullptr;
    auto state = states_.front();
    states_.pop_front();
    return state;
  }

  /// The state of exactly this step.
  std::shared_ptr<const Snapshot> state_at(uint64_t tick) {
    auto snapshot = next();
    while (snapshot != nullptr && snapshot->tick < tick) snapshot = next();
    return snapshot;
  }

  /// Sends a command or a change and returns its answer; states on the way are kept for next().
  Notice ask(const ClientMessage& message) {
    raw.send(message);
    return next_notice();
  }
  Notice next_notice() {
    while (notices_.empty())
      if (!receive()) return {true, "no answer"};
    Notice notice = notices_.front();
    notices_.pop_front();
    return notice;
  }

  RawClient raw;
  Welcome welcome;
  std::optional<SceneAsset> asset;  // once it has come

 private:
  bool receive() {
    const test::Received received = raw.read();
    if (received.is_end) return false;
    if (received.opcode() == Opcode::Control) {
      const auto message = decode_server_message(received.bytes);
      EXPECT_TRUE(message.ok()) << message.error().to_string();
      if (message.ok() && std::holds_alternative<Notice>(*message))
        notices_.push_back(std::get<Notice>(*message));
    }
    if (received.opcode() == Opcode::Asset) {
      auto decoded = decode_scene_asset(std::span(received.bytes).subspan(kFrameHeaderBytes));
      EXPECT_TRUE(decoded.ok()) << decoded.error().to_string();
      if (!decoded.ok()) return false;
      asset = std::move(decoded).value();
      decoder_->set_rest_shape(asset->rest_position_m);
    }
    if (received.opcode() != Opcode::StrandKeyframe && received.opcode() != Opcode::StrandDelta) return true;
    auto snapshot = decoder_->decode(received.bytes);
    EXPECT_TRUE(snapshot.ok()) << snapshot.error().to_string();
    if (snapshot.ok()) states_.push_back(*snapshot);
    return snapshot.ok();
  }

  std::unique_ptr<StrandDecoder> decoder_;
  std::deque<std::shared_ptr<const Snapshot>> states_;
  std::deque<Notice> notices_;
};

class LiveServer : public test::ServerFixture {
 protected:
  [[nodiscard]] bool start(const SceneDesc& scene = test::small_scene(kStrands, kVertices)) {
    return ServerFixture::start(scene);
  }
  StrandClient join(Role role = Role::Viewer) { return StrandClient(server_->port(), role); }
};

TEST_F(LiveServer, AControllerThatFloodsIsRefusedInOneSentence) {
  if (!start()) return;
  StrandClient controller = join(Role::Controller);
  constexpr int kCommands = 300;
  for (int i = 0; i < kCommands; ++i)
    controller.raw.send(SetParameter{fmt::format("wind.mean_mps.x={}", 1 + i % 5)});
  int refused = 0;
  for (int i = 0; i < kCommands; ++i)
    refused += controller.next_notice().text.find("commands a second") != std::string::npos ? 1 : 0;
  EXPECT_GT(refused, 0);
  StrandClient other = join(Role::Controller);
  EXPECT_FALSE(other.ask(SetParameter{"gravity_mps2={ x: 2 y: 0 }"}).is_error)
      << "the budget of another is its own";
}

TEST_F(LiveServer, LateJoinerHasTheSameStatesBitForBit) {
  if (!start()) return;
  StrandClient early = join();
  EXPECT_EQ(early.welcome.strand_count, kStrands);
  EXPECT_EQ(early.welcome.vertex_count, kVertices);
  for (int i = 0; i < 20; ++i) ASSERT_NE(early.next(), nullptr);
  StrandClient late = join();
  // Either may be ahead of the other.
  std::map<uint64_t, uint64_t> early_hash;
  std::map<uint64_t, uint64_t> late_hash;
  uint32_t shared_count = 0;
  const auto remember = [&](StrandClient& client, std::map<uint64_t, uint64_t>& own,
                            const std::map<uint64_t, uint64_t>& others) {
    const auto snapshot = client.next();
    ASSERT_NE(snapshot, nullptr);
    own[snapshot->tick] = state_hash(*snapshot);
    const auto same = others.find(snapshot->tick);
    if (same == others.end()) return;
    EXPECT_EQ(same->second, state_hash(*snapshot)) << "step " << snapshot->tick;
    ++shared_count;
  };
  for (int i = 0; i < 400 && shared_count < 20; ++i) {
    ASSERT_NO_FATAL_FAILURE(remember(early, early_hash, late_hash));
    ASSERT_NO_FATAL_FAILURE(remember(late, late_hash, early_hash));
  }
  EXPECT_EQ(shared_count, 20u);
}

TEST_F(LiveServer, AssetMatchesTheWelcomeInEveryLayoutThatAViewerTakes) {
  if (!start()) return;
  std::vector<SceneAsset> assets;
  for (const uint32_t newest : {0u, 1u, 2u, 3u}) {  // 0: a viewer of before there was a second layout
    StrandClient viewer(server_->port(), Role::Viewer, 0, newest);
    const auto message = viewer.raw.read_media(Opcode::Asset);
    ASSERT_TRUE(message.has_value());
    const auto payload = std::span(*message).subspan(kFrameHeaderBytes);
    EXPECT_EQ(static_cast<uint32_t>(payload[0]), std::max(newest, 1u));
    auto asset = decode_scene_asset(payload);
    ASSERT_TRUE(asset.ok()) << asset.error().to_string();
    EXPECT_EQ(asset->strand_count, kStrands);
    EXPECT_EQ(asset->vertex_count, kVertices);
    EXPECT_FALSE(asset->head.triangle.empty());
    assets.push_back(std::move(*asset));
  }
  for (const SceneAsset& asset : assets) {
    EXPECT_EQ(asset.rest_position_m, assets[0].rest_position_m);
    EXPECT_EQ(asset.head.position_m, assets[0].head.position_m);
    EXPECT_EQ(asset.head.normal, assets[0].head.normal);
    EXPECT_EQ(asset.head.triangle, assets[0].head.triangle);
  }
}

TEST_F(LiveServer, KilledAndStalledClientsDisturbNobody) {
  if (!start()) return;
  StrandClient healthy = join();
  {
    StrandClient killed = join();
    ASSERT_NE(killed.next(), nullptr);
    killed.raw.reset();
  }
  StrandClient stalled(server_->port(), Role::Viewer, 4'096);  // never reads again
  ASSERT_NE(stalled.next(), nullptr);
  const auto first = healthy.next();
  ASSERT_NE(first, nullptr);
  uint64_t last_tick = first->tick;
  for (int i = 0; i < 120; ++i) {
    const auto snapshot = healthy.next();
    ASSERT_NE(snapshot, nullptr);
    EXPECT_GT(snapshot->tick, last_tick);
    last_tick = snapshot->tick;
  }
  // On a slow machine the stalled one may have been dropped too.
  EXPECT_TRUE(eventually([&] { return server_->counters().strand_viewers <= 2; })) << "the killed one left";
  // Every step was published, whoever was watching (the first ones only on occasion: nobody watched yet).
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.published >= last_tick - first->tick; }));
}

TEST_F(LiveServer, PauseAndStepAreExact) {
  if (!start()) return;
  StrandClient controller = join(Role::Controller);
  ASSERT_NE(controller.next(), nullptr);
  EXPECT_TRUE(controller.ask(ControlCommand{Command::StepOnce}).is_error) << "not paused yet";
  EXPECT_FALSE(controller.ask(ControlCommand{Command::Pause}).is_error);
  const uint64_t paused_tick = server_->counters().sim.tick;
  EXPECT_TRUE(server_->counters().sim.is_paused);
  for (uint64_t step = 1; step <= 3; ++step) {
    EXPECT_FALSE(controller.ask(ControlCommand{Command::StepOnce}).is_error);
    ASSERT_TRUE(eventually([&] { return server_->counters().sim.tick == paused_tick + step; }));
  }
  give_time_to_misbehave();
  EXPECT_EQ(server_->counters().sim.tick, paused_tick + 3) << "no step that was not asked for";

  // Somebody who joins now sees exactly this state, after older ones only when the encoder is behind.
  StrandClient late = join();
  const auto snapshot = late.state_at(paused_tick + 3);
  ASSERT_NE(snapshot, nullptr);
  EXPECT_EQ(snapshot->tick, paused_tick + 3);

  EXPECT_FALSE(controller.ask(ControlCommand{Command::Resume}).is_error);
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.tick > paused_tick + 10; }));
}

TEST_F(LiveServer, ResetPutsEveryStrandToRest) {
  if (!start()) return;
  StrandClient controller = join(Role::Controller);
  ASSERT_NE(controller.state_at(30), nullptr);
  EXPECT_FALSE(controller.ask(ControlCommand{Command::Pause}).is_error);
  EXPECT_FALSE(controller.ask(ControlCommand{Command::Reset}).is_error);
  StrandClient late(server_->port(), Role::Viewer);
  const auto snapshot = late.next();
  ASSERT_NE(snapshot, nullptr);
  ASSERT_TRUE(late.asset.has_value());
  const std::vector<glm::vec3> position_m = positions_in_head(*snapshot);
  ASSERT_EQ(position_m.size(), late.asset->rest_position_m.size());
  float largest_m = 0.0f;
  for (size_t i = 0; i < position_m.size(); ++i)
    largest_m = std::max(largest_m, glm::length(position_m[i] - late.asset->rest_position_m[i]));
  EXPECT_LE(largest_m, late.welcome.bound_m * 1.01f) << "within the announced bound";
}

TEST_F(LiveServer, SolverAndWindChangeWhileRunning) {
  if (!start()) return;
  StrandClient controller = join(Role::Controller);
  ASSERT_NE(controller.next(), nullptr);
  for (const SolverRow& row : solver_table()) {
    const Notice notice = controller.ask(SetParameter{"solver.name=" + row.name});
    EXPECT_FALSE(notice.is_error) << notice.text;
    EXPECT_TRUE(eventually([&] { return server_->counters().sim.solver_name == row.name; }));
    const uint64_t tick = server_->counters().sim.tick;
    const auto snapshot = controller.state_at(tick + 5);
    ASSERT_NE(snapshot, nullptr) << "states keep coming with " << row.name;
  }
  EXPECT_FALSE(controller.ask(SetParameter{"wind.mean_mps.x=3"}).is_error);
  const auto motion_bytes = [&] {
    for (const gl::PassReport& pass : server_->counters().sim.passes)
      if (pass.name == "scene/motion") return pass.size_bytes;
    return uint64_t{0};
  };
  const uint64_t before = motion_bytes() / server_->counters().sim.substeps;
  ASSERT_GT(before, 0u);
  EXPECT_FALSE(controller.ask(SetParameter{"substeps=5"}).is_error);
  EXPECT_EQ(motion_bytes(), 5 * before) << "what is printed is what runs";
  EXPECT_EQ(server_->counters().sim.quarantined, 0u);
}

// A rope a million times softer than hair hangs down for metres: put back to rest again and again, and
// reported.
TEST_F(LiveServer, StrandsThatStretchWithoutEndAreCountedApart) {
  SceneDesc scene = test::small_scene(kStrands, kVertices);
  scene.detail.idle = kIdleFull;            // it takes longer than this client reads
  scene.gravity_mps2 = {0.0, -981.0, 0.0};  // strands that weigh more are too long sooner
  if (!start(scene)) return;
  StrandClient controller = join(Role::Controller);
  for (const char* change : {"solver.name=xpbd", "solver.parameters.stretch_compliance_m_per_n=1e6",
                             "solver.parameters.style_stiffness_per_s2=0"}) {
    const Notice notice = controller.ask(SetParameter{change});
    EXPECT_FALSE(notice.is_error) << notice.text;
  }
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.overstretched >= kStrands; }));
  EXPECT_EQ(server_->counters().sim.quarantined, 0u);
  EXPECT_THAT(test::http_get(server_->port(), "/metrics"), HasSubstr("publish_overstretched_total"));
}

TEST_F(LiveServer, BadChangesAreRefusedInOneSentenceAndChangeNothing) {
  if (!start()) return;
  StrandClient controller = join(Role::Controller);
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"solver.name=spaghetti", "known: dftl"},
      {"solver.parameters.nonsense=1", "nonsense"},
      {"solver.parameters.s_damping=1e9", "s_damping"},
      {"groom.procedural.strand_count=5", "known: solver"},
      {"stream.bound_m=1", "bound_m"},
      {"stream.codec=raw", "stream.bound_m"},
      {"stream", "stream.bound_m"},
      {"substeps=100000", "substeps"},
      {"wind.mean_mps.x=nan", "wind"},
      {"look.hair_color=purple", "black, brown, blond"},
      {"look.exposure=nan", "look.exposure is nan"},
      {"look.light_direction={ x: 0 y: 0 z: 0 }", "point somewhere"},
      {"look={ followers: 65 }", "look.followers is 65"},
      {"camera.fov_y_rad=4", "camera.fov_y_rad is 4"},
      {"no assignment", "known: solver"}};
  for (const auto& [assignment, part] : cases) {
    const Notice notice = controller.ask(SetParameter{assignment});
    EXPECT_TRUE(notice.is_error) << assignment;
    EXPECT_THAT(notice.text, HasSubstr(part)) << assignment;
  }
  EXPECT_EQ(server_->counters().sim.solver_builds, 1u);
  EXPECT_NE(controller.next(), nullptr);
}

TEST_F(LiveServer, HeadFollowsTheSourceAndJumpsRigidly) {
  SceneDesc scene = test::small_scene(kStrands, kVertices);
  scene.wind.mean_mps = glm::vec3(0.0f);
  if (!start(scene)) return;
  StrandClient viewer = join();
  RawClient source(server_->port());
  ASSERT_TRUE(source.handshake());
  Hello hello;
  hello.role = Role::Source;
  source.send(hello);
  ASSERT_TRUE(source.read_control<Welcome>().has_value());
  Pose pose;
  pose.position_m = {100.0, 1.5, -20.0};
  pose.rotation = glm::angleAxis(1.0, glm::dvec3(0.0, 1.0, 0.0));
  source.send(MotionSamples{{MotionSamples::Sample{1'000, pose}}});
  bool has_arrived = false;
  for (int i = 0; i < 600 && !has_arrived; ++i) {
    const auto snapshot = viewer.next();
    ASSERT_NE(snapshot, nullptr);
    has_arrived = snapshot->motion_time_ns != 0;
    if (has_arrived) {
      EXPECT_LT(glm::length(snapshot->world_from_head.position_m - pose.position_m), 1e-6);
      EXPECT_LT(angle_between_rad(snapshot->world_from_head.rotation, pose.rotation), 1e-6);
    }
  }
  EXPECT_TRUE(has_arrived);
  EXPECT_EQ(server_->counters().strand_viewers, 1u) << "a source is no viewer";
  EXPECT_EQ(server_->counters().sim.quarantined, 0u);
}

TEST_F(LiveServer, FramesAreDrawnOnlyWhileSomebodyWatchesThem) {
  if (!start()) return;
  StrandClient strands = join();
  ASSERT_NE(strands.state_at(10), nullptr);
  EXPECT_EQ(server_->counters().frames.frames, 0u);
  {
    RawClient viewer(server_->port());
    ASSERT_TRUE(viewer.handshake());
    Hello hello;
    hello.mode = StreamMode::Frames;
    viewer.send(hello);
    const auto welcome = viewer.read_control<Welcome>();
    ASSERT_TRUE(welcome.has_value());
    EXPECT_EQ(welcome->mode, StreamMode::Frames);
    const auto message = viewer.read_media(Opcode::JpegFrame);
    ASSERT_TRUE(message.has_value());
    const auto image = decode_jpeg(std::span(*message).subspan(kFrameHeaderBytes));
    ASSERT_TRUE(image.ok()) << image.error().to_string();
    EXPECT_EQ(image->width, welcome->frame_width);
    EXPECT_EQ(image->height, welcome->frame_height);
    viewer.reset();
  }
  EXPECT_TRUE(eventually([&] { return server_->counters().frame_viewers == 0; }));
  EXPECT_NE(strands.next(), nullptr);
}

TEST_F(LiveServer, HostileCamerasEndTheirOwnSessionOnly) {
  if (!start()) return;
  const auto watch = [&](RenderSize size) {
    auto viewer = std::make_unique<RawClient>(server_->port());
    EXPECT_TRUE(viewer->handshake());
    Hello hello;
    hello.mode = StreamMode::Frames;
    hello.frame_width = size.width;
    hello.frame_height = size.height;
    viewer->send(hello);
    return viewer;
  };
  auto witness = watch({});
  ASSERT_TRUE(witness->read_media(Opcode::JpegFrame).has_value());
  const float nan = std::nanf("");
  const std::vector<std::pair<CameraDesc, std::string>> cameras = {
      {{{nan, 0.0f, 1.0f}, {}, 1.0f}, "camera.offset_m"},
      {{{0.0f, 0.0f, 0.0f}, {}, 1.0f}, "camera.offset_m"},
      {{{0.0f, 0.0f, 3e38f}, {}, 1.0f}, "camera.offset_m"},
      {{{0.0f, 0.0f, 1.0f}, {0.0f, INFINITY, 0.0f}, 1.0f}, "camera.target_m"},
      {{{0.0f, 0.0f, 1.0f}, {}, nan}, "camera.fov_y_rad"},
      {{{0.0f, 0.0f, 1.0f}, {}, 3.2f}, "camera.fov_y_rad"},
      {{{0.0f, 0.0f, 1.0f}, {}, -0.0f}, "camera.fov_y_rad"}};
  for (const auto& [camera, field] : cameras) {
    auto viewer = watch({});
    ASSERT_TRUE(viewer->read_control<Welcome>().has_value());
    viewer->send(CameraChange{camera});
    const RawClient::End end = viewer->read_end();
    EXPECT_EQ(end.close_code, static_cast<uint16_t>(CloseCode::BadData));
    EXPECT_THAT(end.reason, HasSubstr(field));
  }
  for (const RenderSize size : {RenderSize{1, 1}, {4'000'000'000u, 16}, {4096, 4096}, {16, 4096}})
    EXPECT_NE(watch(size)->read_end().close_code, 0) << size.width << " x " << size.height;
  // What is allowed is drawn, from right inside the head and from far away.
  for (const float distance_m : {1e-3f, 100.0f}) {
    witness->send(CameraChange{{{0.0f, 0.0f, distance_m}, {}, 2.8f}});
    ASSERT_TRUE(witness->read_media(Opcode::JpegFrame).has_value());
  }
  EXPECT_EQ(server_->counters().sim.quarantined, 0u);
}

TEST_F(LiveServer, NobodyWatchingMeansNothingIsEncodedOrDrawn) {
  if (!start()) return;
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.tick >= 60; }));
  const ServerCounters counters = server_->counters();
  EXPECT_EQ(counters.encode.encodes, 0u);
  EXPECT_EQ(counters.frames.frames, 0u);
  EXPECT_LE(counters.sim.published, counters.sim.tick / kIdlePublishSteps + 1);
}

TEST_F(LiveServer, SeveralServersLiveInOneProcessAndStopCleanly) {
  if (!start()) return;
  ServerConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.net.port = 0;
  auto other = Server::start(config);
  ASSERT_TRUE(other.ok()) << other.error().to_string();
  StrandClient first = join();
  StrandClient second((*other)->port(), Role::Viewer);
  EXPECT_NE(first.welcome.session_id, second.welcome.session_id);
  ASSERT_NE(second.next(), nullptr);
  RawClient::End end;
  std::thread reader([&] { end = second.raw.read_end(); });
  (*other)->stop();
  (*other)->wait();
  reader.join();
  EXPECT_EQ(end.close_code, static_cast<uint16_t>(CloseCode::GoingAway));
  EXPECT_FALSE(end.reason.empty());
  EXPECT_NE(first.next(), nullptr);

  config.net.port = server_->port();
  const auto taken = Server::start(config);
  ASSERT_FALSE(taken.ok());
  EXPECT_EQ(taken.error().code, ErrorCode::Unavailable);
  EXPECT_THAT(taken.error().message, HasSubstr(std::to_string(config.net.port)));
}

// A step that does not end: the server is alive, and says that it is not ready.
TEST_F(LiveServer, ReadyMeansStepping) {
  const auto is_stuck = std::make_shared<std::atomic<bool>>(false);
  ServerConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.on_publish = [is_stuck](const std::shared_ptr<const Snapshot>&) {
    EXPECT_TRUE(eventually([&] { return !*is_stuck; }));
  };
  if (!ServerFixture::start(std::move(config))) return;
  const auto is_ready = [&] {
    const std::string answer = test::http_get(server_->port(), "/readyz");
    EXPECT_TRUE(answer.find(" 200 ") != std::string::npos ||
                answer.find("has not stepped") != std::string::npos)
        << answer;
    return answer.find(" 200 ") != std::string::npos;
  };
  EXPECT_TRUE(eventually(is_ready));
  *is_stuck = true;
  EXPECT_TRUE(eventually([&] { return !is_ready(); }));
  EXPECT_THAT(test::http_get(server_->port(), "/healthz"), HasSubstr("200 OK"));
  *is_stuck = false;
  EXPECT_TRUE(eventually(is_ready));
  ASSERT_EQ(run_command(ctl_target(), ControlCommand{Command::Pause}), 0);
  const uint64_t tick = server_->counters().sim.tick;
  const int64_t pause_ns = now_ns();
  constexpr int64_t kLongPauseNs = 2'500'000'000;  // longer than a step may be ago
  EXPECT_TRUE(eventually([&] { return now_ns() - pause_ns > kLongPauseNs; }));
  EXPECT_TRUE(is_ready()) << "paused at step " << tick;
}

TEST_F(LiveServer, MetricsTellWhatRuns) {
  if (!start()) return;
  StrandClient viewer = join();
  ASSERT_NE(viewer.next(), nullptr);
  const std::string text = test::http_get(server_->port(), "/metrics");
  for (const char* name :
       {"strandcast_sim_steps_total", "strandcast_viewers_strands 1", "strandcast_encode_frames"})
    EXPECT_THAT(text, HasSubstr(name));
}

// Whoever asks for auto on a machine that is too slow for full gets fast, once it has been seen.
TEST_F(LiveServer, AutoIsLoweredToFastWhereFullIsTooSlow) {
  if (!start(with_overrides(test::small_scene(400, 16), {"step_rate_hz=1000", "substeps=64"}).value()))
    return;
  const auto solver = [this] { return server_->counters().sim.solver_name; };
  StrandClient controller(server_->port(), Role::Controller);
  const Notice taken = controller.ask(SetParameter{"quality=auto"});
  EXPECT_FALSE(taken.is_error) << taken.text;
  EXPECT_TRUE(eventually([&] { return solver() == "direct_rod"; }));
  EXPECT_TRUE(eventually([&] { return solver() == "dftl"; })) << "full goes on though it is too slow";
}

}  // namespace
}  // namespace strandcast::server_live_test
