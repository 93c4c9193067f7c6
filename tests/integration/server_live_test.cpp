// A whole server in this process against raw clients: late join, lost and stalled clients, commands, live
// changes, sources and frame viewers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <thread>

#include "common/pictures/image_codec.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_codec.h"
#include "server/source/sim_loop.h"
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
  StrandClient(uint16_t port, Role role, int receive_buffer_bytes = 0) : raw(port, receive_buffer_bytes) {
    EXPECT_TRUE(raw.handshake());
    Hello hello;
    hello.role = role;
    hello.name = "test";
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

/// Takes what a loop makes, and keeps how stream and look were changed.
class LoopSink : public StateSink {
 public:
  void put(std::shared_ptr<const Snapshot>) override {}
  void change_stream(const StreamDesc& stream) override {
    const std::lock_guard lock(mutex_);
    streams_.push_back(stream);
  }
  void change_look(const LookChange& look) override {
    const std::lock_guard lock(mutex_);
    looks_.push_back(look);
  }
  void change_shape(std::shared_ptr<const SceneAsset>) override {}
  std::vector<StreamDesc> streams() const {
    const std::lock_guard lock(mutex_);
    return streams_;
  }
  std::vector<LookChange> looks() const {
    const std::lock_guard lock(mutex_);
    return looks_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<StreamDesc> streams_;
  std::vector<LookChange> looks_;
};

TEST(SimLoopJobs, CommandsBeyondTheLimitAreRefusedAtOnce) {
  // The first state published after the start holds the simulation thread until the test lets it go.
  std::promise<void> held, go;
  auto let_go = go.get_future().share();
  std::atomic<int> published = 0;
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  auto content = load_scene_content(config.scene);
  ASSERT_TRUE(content.ok());
  config.content = std::make_shared<const SceneContent>(std::move(*content));
  config.on_publish = [&](const std::shared_ptr<const Snapshot>&) {
    if (++published != 2) return;
    held.set_value();
    let_go.wait();
  };
  InputHub hub;
  LoopSink sink;
  auto loop = SimLoop::start(std::move(config), hub, sink);
  if (!loop.ok() && test::lacks_gl(loop.error().message))
    GTEST_SKIP() << "needs OpenGL 4.5: " << loop.error().to_string();
  ASSERT_TRUE(loop.ok()) << loop.error().to_string();
  held.get_future().wait();
  std::atomic<size_t> refused = 0, answered = 0;
  for (size_t i = 0; i < kMaxPendingJobs + 3; ++i)
    (*loop)->post(ControlCommand{Command::Pause},
                  [&](const Notice& notice) { notice.is_error ? ++refused : ++answered; });
  EXPECT_EQ(refused, 3u);
  go.set_value();
  for (int i = 0; i < 1000 && answered < kMaxPendingJobs; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(answered, kMaxPendingJobs) << "what was accepted is carried out";
  (*loop)->stop();
}

/// A loop over a small scene without a network; null after a skip or a failure.
class Loop {
 public:
  explicit Loop(SimLoopConfig config) {
    auto content = load_scene_content(config.scene);
    if (!content.ok()) return;
    config.content = std::make_shared<const SceneContent>(std::move(*content));
    auto started = SimLoop::start(std::move(config), hub_, sink_);
    if (started.ok())
      loop_ = std::move(*started);
    else
      error_ = started.error();
  }
  explicit operator bool() const { return loop_ != nullptr; }
  SimLoop* operator->() const { return loop_.get(); }
  std::string trouble() const { return error_.to_string(); }
  std::vector<StreamDesc> streams() const { return sink_.streams(); }
  std::vector<LookChange> looks() const { return sink_.looks(); }
  /// Posts the change and waits for its answer.
  Notice ask(const std::string& assignment) const {
    auto answer = std::make_shared<std::promise<Notice>>();
    loop_->post(SetParameter{assignment}, [answer](Notice notice) { answer->set_value(std::move(notice)); });
    return answer->get_future().get();
  }

 private:
  InputHub hub_;
  LoopSink sink_;
  Error error_;
  std::unique_ptr<SimLoop> loop_;
};

// What a step takes is a hundredth of the time there is in the one scene, and many times as much in the
// other.
TEST(SimLoopQuality, AutoIsFullWhereStepsAreQuickAndElseFast) {
  const auto running = [](const std::vector<std::string>& overrides, bool is_lockstep) {
    SimLoopConfig config;
    config.scene = with_overrides(test::small_scene(400, 16), overrides).value();
    config.is_lockstep = is_lockstep;
    const Loop loop(std::move(config));
    EXPECT_TRUE(loop) << loop.trouble();
    return loop ? loop->scene() : SceneDesc();
  };
  const SceneDesc quick = running({"quality=auto", "step_rate_hz=10"}, false);
  EXPECT_EQ(quick.solver.name, "direct_rod");
  EXPECT_TRUE(quick.volume.air.acts);
  const std::vector<std::string> slow = {"quality=auto", "step_rate_hz=1000", "substeps=64"};
  const SceneDesc lowered = running(slow, false);
  EXPECT_EQ(lowered.solver.name, "dftl");
  EXPECT_FALSE(lowered.volume.acts());
  EXPECT_EQ(lowered.quality, kAutoQuality);
  EXPECT_EQ(running(slow, true).solver.name, "direct_rod") << "simulated time waits: nothing is measured";
}

TEST(SimLoopJobs, AFloodOfChangesOfTheStreamIsPublishedTwiceASecondAndTheLastOneCounts) {
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  const int64_t begin_ns = now_ns();
  constexpr int kChanges = 300;
  for (int i = 0; i < kChanges; ++i) {
    const Notice notice = loop.ask(fmt::format("stream.bound_m={}", i % 2 == 0 ? "0.0002" : "0.0003"));
    ASSERT_FALSE(notice.is_error) << notice.text;
  }
  const Notice last = loop.ask("stream.bound_m=0.0004");
  EXPECT_FALSE(last.is_error);
  ASSERT_TRUE(eventually([&] {
    const auto streams = loop.streams();
    return !streams.empty() && streams.back().bound_m == 0.0004f;
  }));
  EXPECT_LE(loop.streams().size(), static_cast<size_t>((now_ns() - begin_ns) / kStreamChangeNs) + 1);
}

TEST(SimLoopJobs, AFloodOfLooksIsToldTenTimesASecondAndTheLastOneCounts) {
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  const LookDesc first = config.scene.look;
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  EXPECT_TRUE(loop.looks().empty()) << "nothing has changed";
  const int64_t begin_ns = now_ns();
  constexpr int kChanges = 300;
  for (int i = 1; i <= kChanges; ++i)
    ASSERT_FALSE(loop.ask(fmt::format("look.ambient={}", 1e-3 * i)).is_error);
  const auto is_told = [&](auto&& is_it) {
    return eventually([&] {
      const auto looks = loop.looks();
      return !looks.empty() && is_it(looks.back());
    });
  };
  ASSERT_TRUE(is_told([](const LookChange& look) { return look.look.ambient == 0.3f; }));
  EXPECT_LE(loop.looks().size(), static_cast<size_t>((now_ns() - begin_ns) / kLookChangeNs) + 1);
  LookDesc expected = first;
  expected.ambient = 0.3f;
  EXPECT_EQ(loop.looks().back().look, expected) << "all else stays";
  EXPECT_EQ(loop->scene().look, expected);
  // While nothing is simulated, too, with what came too soon after the one before.
  loop->post(ControlCommand{Command::Pause}, {});
  for (const char* color : {"red", "black", "grey"})
    ASSERT_FALSE(loop.ask(fmt::format("look.hair_color={}", color)).is_error);
  ASSERT_TRUE(is_told([](const LookChange& look) { return look.look.hair_color == "grey"; }));
  EXPECT_TRUE(loop.streams().empty()) << "the stream does not change with it";
}

TEST(SimLoopJobs, NewSolversLeaveTimeForStepsBetweenThem) {
  std::promise<void> held, go;
  auto let_go = go.get_future().share();
  std::atomic<int> published = 0;
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.on_publish = [&](const std::shared_ptr<const Snapshot>&) {
    if (++published != 2) return;
    held.set_value();
    let_go.wait();
  };
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  held.get_future().wait();
  std::mutex mutex;
  std::vector<std::string> answers;
  constexpr size_t kJobs = 30;
  static_assert(kJobs <= kMaxPendingJobs);
  for (size_t i = 0; i < kJobs; ++i)
    loop->post(SetParameter{i % 2 == 0 ? "solver.name=pbd" : "solver.name=dftl"}, [&](const Notice& notice) {
      const std::lock_guard lock(mutex);
      answers.push_back(notice.text);
    });
  go.set_value();
  ASSERT_TRUE(eventually([&] {
    const std::lock_guard lock(mutex);
    return answers.size() == kJobs;
  }));
  const auto step_of = [](const std::string& text) {
    return std::stoul(text.substr(text.find("step ") + 5));
  };
  EXPECT_GT(step_of(answers.back()), step_of(answers.front())) << answers.front() << " " << answers.back();
}

/// Answers, as they come, behind a word of whose they are.
class Answers {
 public:
  SimLoop::Reply of(const std::string& who) {
    return [this, who](const Notice& notice) {
      const std::lock_guard lock(mutex_);
      all_.emplace_back(who, notice);
    };
  }
  std::vector<std::pair<std::string, Notice>> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }
  /// The first of these; waits for it.
  Notice first_of(const std::string& who) const {
    std::optional<Notice> found;
    EXPECT_TRUE(eventually([&] {
      for (const auto& [whose, notice] : all())
        if (whose == who && !found) found = notice;
      return found.has_value();
    })) << who;
    return found.value_or(Notice{});
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::pair<std::string, Notice>> all_;
};

constexpr uint32_t kManySteps = kMaxStepCount;
const ControlCommand kStepMany{Command::StepOnce, kManySteps};

SimLoopConfig stepped_config() {
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.is_lockstep = true;
  return config;
}

// A controller asks for hours of steps, and goes.
TEST(SimLoopJobs, StepsEndWithTheSessionThatAskedForThem) {
  Answers answers;
  const Loop loop(stepped_config());
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  loop->post(kStepMany, answers.of("steps"), "gone");
  loop->post(kStepMany, answers.of("more"), "gone");
  ASSERT_TRUE(eventually([&] { return loop->stats().tick > 0; }));
  loop->leave("somebody else");
  give_time_to_misbehave();
  EXPECT_TRUE(answers.all().empty());
  loop->leave("gone");
  const Notice end = answers.first_of("steps");
  EXPECT_TRUE(end.is_error);
  EXPECT_THAT(end.text, HasSubstr("has ended"));
  loop->post(ControlCommand{Command::Pause}, answers.of("pause"), "other");
  answers.first_of("pause");
  const uint64_t tick = loop->stats().tick;
  EXPECT_LT(tick, kManySteps);
  give_time_to_misbehave();
  EXPECT_EQ(loop->stats().tick, tick) << "those that waited are left out, too";
  EXPECT_EQ(answers.all().size(), 2u);
}

TEST(SimLoopJobs, StepsYieldToOthersAndKeepTheOrderOfTheirOwn) {
  for (const Command command : {Command::Pause, Command::Reset}) {
    Answers answers;
    const Loop loop(stepped_config());
    if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
    ASSERT_TRUE(loop) << loop.trouble();
    loop->post(kStepMany, answers.of("steps"), "one");
    loop->post(SetParameter{"gravity_mps2={ x: 1 y: 0 }"}, answers.of("own"), "one");
    ASSERT_TRUE(eventually([&] { return loop->stats().tick > 0; }));
    loop->post(SetParameter{"gravity_mps2={ x: 2 y: 0 }"}, answers.of("set"), "other");
    EXPECT_FALSE(answers.first_of("set").is_error) << "between two steps";
    EXPECT_EQ(answers.all().size(), 1u) << "the steps go on, and what follows them waits";
    loop->post(ControlCommand{command}, answers.of("command"), "other");
    EXPECT_FALSE(answers.first_of("command").is_error);
    EXPECT_THAT(answers.first_of("steps").text, HasSubstr("somebody else"));
    EXPECT_FALSE(answers.first_of("own").is_error);
    EXPECT_LT(loop->stats().tick, kManySteps);
  }
}

TEST(SimLoopJobs, StepsOfOneCommandHaveABoundInTime) {
  Answers answers;
  SimLoopConfig config = stepped_config();
  config.longest_steps_ns = 1;
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  loop->post(kStepMany, answers.of("steps"), "one");
  const Notice end = answers.first_of("steps");
  EXPECT_TRUE(end.is_error);
  EXPECT_THAT(end.text, HasSubstr(fmt::format("of {} steps done", kManySteps)));
  EXPECT_LT(loop->stats().tick, 10u);
}

// Three controllers at their allowed rate, and an honest one.
TEST(SimLoopJobs, SessionsHaveTheirTurnsOneAfterTheOther) {
  std::promise<void> go, held;
  const std::shared_future<void> let_go = go.get_future().share();
  std::atomic<int> published = 0;
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.on_publish = [&](const std::shared_ptr<const Snapshot>&) {
    if (++published != 2) return;
    held.set_value();
    let_go.wait();
  };
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  held.get_future().wait();
  Answers answers;
  const std::vector<std::string> greedy = {"a", "b", "c"};
  for (size_t i = 0; i < 4 * kMaxPendingJobs; ++i)
    loop->post(SetParameter{"solver.name=pbd"}, answers.of(greedy[i % 3]), greedy[i % 3]);
  loop->post(ControlCommand{Command::Pause}, answers.of("honest"), "honest");
  size_t refused = 0;
  for (const auto& [who, notice] : answers.all()) {
    EXPECT_NE(who, "honest");
    refused += notice.is_error ? 1 : 0;
  }
  EXPECT_EQ(refused, 3 * kMaxPendingJobs + 1) << "one gave its place";
  go.set_value();
  EXPECT_FALSE(answers.first_of("honest").is_error);
  size_t before = 0;
  for (const auto& [who, notice] : answers.all()) {
    if (who == "honest") break;
    before += notice.is_error ? 0 : 1;
  }
  EXPECT_LE(before, 4u) << "one of each before it, and the one under way";
}

// One step of it takes seconds, and whoever ends the server waits for none of them.
TEST(SimLoopJobs, StopDoesNotWaitForTheRestOfTheSubsteps) {
  SimLoopConfig config;
  config.scene = test::small_scene(3'000, 16);
  config.scene.solver.name = "super_helix";
  config.scene.solver.parameters.clear();
  config.scene.substeps = 64;
  const Loop loop(std::move(config));
  if (!loop && test::lacks_gl(loop.trouble())) GTEST_SKIP() << "needs OpenGL 4.5: " << loop.trouble();
  ASSERT_TRUE(loop) << loop.trouble();
  give_time_to_misbehave();
  loop->stop();
  EXPECT_EQ(loop->stats().last_step_ns, 0) << "the first step was finished";
}

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

TEST_F(LiveServer, AssetMatchesTheWelcome) {
  if (!start()) return;
  StrandClient viewer = join();
  const auto message = viewer.raw.read_media(Opcode::Asset);
  ASSERT_TRUE(message.has_value());
  const auto asset = decode_scene_asset(std::span(*message).subspan(kFrameHeaderBytes));
  ASSERT_TRUE(asset.ok()) << asset.error().to_string();
  EXPECT_EQ(asset->strand_count, kStrands);
  EXPECT_EQ(asset->vertex_count, kVertices);
  EXPECT_FALSE(asset->head.triangle.empty());
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
