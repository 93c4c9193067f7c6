// How much a whole server simulates: nothing once nobody reads, less where the hair is small on every screen,
// and all of it, without a jolt, as soon as somebody looks again.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <thread>

#include "common/strands/snapshot.h"
#include "server/source/sim_loop.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"

namespace strandcast::server_detail_test {
namespace {

using test::RawClient;

constexpr double kSoonS = 0.2;

SceneDesc small_detail_scene() {
  SceneDesc scene = test::small_scene(150, 8);
  scene.detail.idle_after_s = kSoonS;
  scene.detail.settle_s = kSoonS;
  return scene;
}

/// Keeps what a loop puts.
class StateSinkOfTest : public StateSink {
 public:
  void put(std::shared_ptr<const Snapshot> state) override {
    const std::lock_guard lock(mutex_);
    states_.push_back(std::move(state));
  }
  void change_stream(const StreamDesc&) override {}
  void change_look(const LookChange&) override {}
  void change_shape(std::shared_ptr<const SceneAsset>) override {}
  std::vector<std::shared_ptr<const Snapshot>> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(states_, {});
  }
  size_t count() const {
    const std::lock_guard lock(mutex_);
    return states_.size();
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::shared_ptr<const Snapshot>> states_;
};

/// A head that flies on at this speed, told some 200 times a second.
class FlyingHead {
 public:
  FlyingHead(InputHub& hub, double speed_mps, double turn_radps)
      : thread_([&hub, speed_mps, turn_radps, this] {
          const int64_t begin_ns = now_ns();
          while (!is_over_) {
            const int64_t time_ns = now_ns();
            const double s = 1e-9 * static_cast<double>(time_ns - begin_ns);
            Pose pose;
            pose.position_m = {speed_mps * s, 0.0, 0.0};
            pose.rotation = glm::angleAxis(turn_radps * s, glm::dvec3(0.0, 1.0, 0.0));
            MotionSamples samples;
            samples.samples = {{time_ns, pose}};
            hub.push(1, samples, time_ns);
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
          }
        }) {}
  ~FlyingHead() {
    is_over_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

/// Farthest that a vertex comes from one state to the next, seen from the head, per step between the two.
double largest_move_m(const Snapshot& a, const Snapshot& b) {
  const std::vector<glm::vec3> from = positions_in_head(a), to = positions_in_head(b);
  double largest = 0.0;
  for (size_t i = 0; i < from.size(); ++i) largest = std::max(largest, double{glm::distance(from[i], to[i])});
  return largest / static_cast<double>(std::max<uint64_t>(1, b.tick - a.tick));
}

double largest_move_m(const std::vector<std::shared_ptr<const Snapshot>>& states) {
  double largest = 0.0;
  for (size_t i = 1; i < states.size(); ++i)
    largest = std::max(largest, largest_move_m(*states[i - 1], *states[i]));
  return largest;
}

SourceDemand one_viewer(double hair_px = std::numeric_limits<double>::infinity()) {
  SourceDemand demand;
  demand.facts.strand_viewers = 1;
  demand.hair_px = hair_px;
  return demand;
}

class DetailLoop : public testing::Test {
 protected:
  [[nodiscard]] bool start(const SceneDesc& scene) {
    SimLoopConfig config;
    config.scene = scene;
    config.device.sim_device = "lanes";
    auto content = load_scene_content(scene);
    EXPECT_TRUE(content.ok());
    if (!content.ok()) return false;
    config.content = std::make_shared<const SceneContent>(std::move(*content));
    auto loop = SimLoop::start(std::move(config), hub_, sink_);
    EXPECT_TRUE(loop.ok());
    if (loop.ok()) loop_ = std::move(*loop);
    return loop_ != nullptr;
  }
  bool comes_to(DetailLevel level) {
    return eventually([&] { return loop_->stats().detail == level; });
  }
  /// So many states.
  std::vector<std::shared_ptr<const Snapshot>> watch(size_t count) {
    (void)sink_.take();
    EXPECT_TRUE(eventually([&] { return sink_.count() >= count; }));
    return sink_.take();
  }
  void TearDown() override {
    if (loop_ != nullptr) loop_->stop();
  }

  InputHub hub_;
  StateSinkOfTest sink_;
  std::unique_ptr<SimLoop> loop_;
};

// Hair that lies in the airstream of a steady flight stays there, asleep and awake. With the speeds that it
// had when it fell asleep, or none, the head would fly out from under it: 2 m/s are 33 mm a step.
TEST_F(DetailLoop, HairWakesWhereTheHeadHasCarriedIt) {
  SceneDesc scene = small_detail_scene();
  scene.wind = {};
  constexpr double kSpeedMps = 2.0;
  if (!start(scene)) return;
  const FlyingHead head(hub_, kSpeedMps, 0.0);
  loop_->set_demand(one_viewer());
  (void)watch(150);  // has settled into the flight
  const double awake_m = largest_move_m(watch(60));
  loop_->set_demand({});
  ASSERT_TRUE(comes_to(DetailLevel::FollowHead));
  const SimStats asleep = loop_->stats();
  ASSERT_TRUE(eventually([&] { return loop_->stats().tick > asleep.tick + 60; })) << "time goes on";
  EXPECT_EQ(loop_->stats().step_times.sum_ms(), asleep.step_times.sum_ms()) << "and nothing is simulated";
  EXPECT_EQ(loop_->stats().published, asleep.published);
  EXPECT_GT(loop_->stats().last_step_ns, asleep.last_step_ns) << "it is ready for whoever comes";
  EXPECT_EQ(loop_->stats().simulated_strands, 0u);
  EXPECT_NEAR(loop_->stats().realtime_factor, 1.0, 0.2) << "that is no slow motion";
  (void)sink_.take();
  loop_->set_demand(one_viewer());
  ASSERT_TRUE(comes_to(DetailLevel::Full));
  const auto states = watch(20);
  const double step_m = kSpeedMps / scene.step_rate_hz;
  EXPECT_LT(largest_move_m(states), awake_m + 2.0 * step_m);
  EXPECT_GT(glm::length(states.back()->world_from_head.position_m), kSpeedMps) << "the head has gone on";
}

// From all strands to some that the others follow, and back: nothing leaps.
TEST_F(DetailLoop, LevelsChangeWithoutALeap) {
  SceneDesc scene = small_detail_scene();
  scene.detail.mode = kDetailAuto;
  // Shoulders that stay as the head turns on and on would comb the hair: a skull alone.
  scene.colliders = {{glm::vec3(0.0f), 0.09f}};
  if (!start(scene)) return;
  const FlyingHead head(hub_, 0.0, 3.0);
  loop_->set_demand(one_viewer(2.0 * scene.detail.full_at_px));
  (void)watch(60);
  const double moving_m = largest_move_m(watch(60));
  for (const double share : {0.9, 0.3, 0.15, 0.1}) {
    // Below the level's size, with its hysteresis.
    loop_->set_demand(one_viewer(share * (1.0 - scene.detail.hysteresis) * scene.detail.full_at_px));
    (void)sink_.take();
    const DetailLevel wanted = level_for(scene.detail, share * scene.detail.full_at_px);
    ASSERT_TRUE(comes_to(wanted)) << share;
    const auto down = watch(30);
    for (const auto& state : down) EXPECT_EQ(state->strand_count, 150u);
    loop_->set_demand(one_viewer());
    ASSERT_TRUE(comes_to(DetailLevel::Full));
    // The first steps of all strands, from where those that followed were.
    EXPECT_LT(largest_move_m(watch(20)), 2.0 * moving_m) << to_string(wanted);
  }
}

TEST_F(DetailLoop, HalfTheRateIsHalfTheStatesAndGoesOn) {
  SceneDesc scene = small_detail_scene();
  scene.detail.mode = kDetailAuto;
  if (!start(scene)) return;
  loop_->set_demand(one_viewer(0.08 * scene.detail.full_at_px));
  ASSERT_TRUE(comes_to(DetailLevel::HalfRate));
  (void)sink_.take();
  const auto states = watch(20);
  for (size_t i = 1; i < states.size(); ++i) EXPECT_EQ((states[i]->tick - states[i - 1]->tick) % 2, 0u);
  EXPECT_LT(loop_->stats().simulated_strands, 150u);
  EXPECT_GT(largest_move_m(states), 0.0) << "wind";
}

// From afar hair goes along with the head as it is, in states of their own that hash to what they are.
TEST_F(DetailLoop, HairThatIsAPointGoesWithTheHead) {
  SceneDesc scene = small_detail_scene();
  scene.detail.mode = kDetailAuto;
  if (!start(scene)) return;
  const FlyingHead head(hub_, 1.0, 1.0);
  loop_->set_demand(one_viewer(1.0));
  ASSERT_TRUE(comes_to(DetailLevel::FollowHead));
  const auto states = watch(20);
  std::set<uint64_t> hashes;
  for (size_t i = 1; i < states.size(); ++i) {
    EXPECT_EQ(states[i]->lattice, states[i - 1]->lattice);
    EXPECT_GT(states[i]->tick, states[i - 1]->tick);
    EXPECT_NE(states[i]->world_from_head.position_m, states[i - 1]->world_from_head.position_m);
    hashes.insert(state_hash(*states[i]));
  }
  EXPECT_EQ(hashes.size(), states.size() - 1);
}

TEST_F(DetailLoop, APauseIsNoIdleness) {
  if (!start(small_detail_scene())) return;
  std::atomic<bool> is_paused = false;
  loop_->post(ControlCommand{Command::Pause}, [&](const Notice&) { is_paused = true; });
  ASSERT_TRUE(eventually([&] { return is_paused.load(); }));
  std::this_thread::sleep_for(std::chrono::duration<double>(2.0 * kSoonS));
  const uint64_t tick = loop_->stats().tick;
  std::atomic<bool> has_stepped = false;
  loop_->post(ControlCommand{Command::StepOnce}, [&](const Notice&) { has_stepped = true; });
  ASSERT_TRUE(eventually([&] { return loop_->stats().tick == tick + 1; }));
  EXPECT_EQ(loop_->stats().detail, DetailLevel::Full);
}

class DetailServer : public test::ServerFixture {
 protected:
  bool comes_to(DetailLevel level) {
    return eventually([&] { return server_->counters().sim.detail == level; });
  }
  /// Pumps until so many more states are there.
  static bool gets(ViewerSession& viewer, uint64_t count) {
    const uint64_t before = viewer.replay().stats().decoded_frames;
    return eventually([&] {
      EXPECT_TRUE(viewer.pump(std::chrono::milliseconds(20)).ok());
      return viewer.replay().stats().decoded_frames >= before + count;
    });
  }
};

TEST_F(DetailServer, AServerThatEverybodyLeftSimulatesNothingAndTheNextViewerSeesMovingHair) {
  if (!start(small_detail_scene())) return;
  {
    const auto viewer = open(client_config());
    ASSERT_NE(viewer, nullptr);
    ASSERT_TRUE(gets(*viewer, 30));
    EXPECT_EQ(server_->counters().sim.detail, DetailLevel::Full);
  }
  ASSERT_TRUE(comes_to(DetailLevel::FollowHead));
  EXPECT_FALSE(server_->counters().sim.detail_reason.empty());
  for (const gl::PassReport& pass : server_->passes())
    EXPECT_EQ(pass.name == "sim/step" && pass.fate == gl::PassFate::Kept, false) << pass.reason;
  const std::string metrics = test::http_get(server_->port(), "/metrics");
  EXPECT_NE(metrics.find("strandcast_sim_detail_level 5"), std::string::npos);
  EXPECT_NE(metrics.find("level=\"follow the head\""), std::string::npos);

  const auto viewer = open(client_config());
  ASSERT_NE(viewer, nullptr);
  ASSERT_TRUE(gets(*viewer, 5));
  const auto before = viewer->replay().newest();
  ASSERT_TRUE(gets(*viewer, 30));
  const auto after = viewer->replay().newest();
  EXPECT_EQ(viewer->replay().stats().rejected_frames, 0u);
  ASSERT_TRUE(before != nullptr && after != nullptr);
  EXPECT_GT(largest_move_m(*before, *after), 0.0);
  EXPECT_EQ(server_->counters().sim.detail, DetailLevel::Full);
}

TEST_F(DetailServer, AFarCameraOfPicturesGetsFewerStrandsAndANearOneAll) {
  SceneDesc scene = small_detail_scene();
  scene.detail.mode = kDetailAuto;
  scene.detail.full_at_px = 30.0;  // of pictures 48 high
  if (!start(scene)) return;
  RawClient viewer(server_->port());
  ASSERT_TRUE(viewer.handshake());
  Hello hello;
  hello.mode = StreamMode::Frames;
  viewer.send(hello);
  ASSERT_TRUE(viewer.read_media(Opcode::JpegFrame).has_value());
  EXPECT_EQ(server_->counters().sim.detail, DetailLevel::Full);
  EXPECT_EQ(server_->counters().sim.simulated_strands, 150u);
  CameraDesc far = scene.camera;
  far.offset_m = 17.0f * glm::normalize(far.offset_m);
  viewer.send(CameraChange{far});
  ASSERT_TRUE(comes_to(DetailLevel::HalfRate));
  EXPECT_LT(server_->counters().sim.simulated_strands, 150u);
  // Somebody else looks closely, by strands, and says how closely.
  const auto strands = open(client_config());
  ASSERT_NE(strands, nullptr);
  ASSERT_TRUE(comes_to(DetailLevel::Full)) << "who says nothing may look closely";
  ViewerReport report;
  report.hair_px = 0.4 * scene.detail.full_at_px * (1.0 - scene.detail.hysteresis);
  ASSERT_TRUE(strands->client().send(report).ok());
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(strands->pump(std::chrono::milliseconds(20)).ok());
    return server_->counters().sim.detail == DetailLevel::FewerStrands;
  }));
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(strands->pump(std::chrono::milliseconds(20)).ok());
    return !strands->status().detail.empty();
  })) << "viewers are told";
  viewer.send(CameraChange{scene.camera});
  EXPECT_TRUE(comes_to(DetailLevel::Full));
  ASSERT_TRUE(gets(*strands, 10));
  EXPECT_EQ(strands->replay().stats().rejected_frames, 0u);
}

}  // namespace
}  // namespace strandcast::server_detail_test
