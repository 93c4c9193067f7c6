// The simulation's loop in this process, without a network: commands and changes that come in floods, steps
// that a session asks for, and quality by how long a step takes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <mutex>
#include <optional>
#include <thread>

#include "common/groom/groom_asset.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "common/strands/shared_strands.h"
#include "common/strands/strand_codec.h"
#include "server/source/simulation_source.h"
#include "tests/support/server_fixture.h"

namespace strandcast::sim_loop_test {
namespace {

using testing::HasSubstr;

constexpr uint32_t kStrands = 150;
constexpr uint32_t kVertices = 8;

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
  std::string reason;
  const auto running = [&](const std::vector<std::string>& overrides, bool is_lockstep) {
    SimLoopConfig config;
    config.scene = with_overrides(test::small_scene(400, 16), overrides).value();
    config.is_lockstep = is_lockstep;
    SceneDesc started;
    config.on_scene = [&](const SceneDesc& scene, const std::string&) { started = scene; };
    const Loop loop(std::move(config));
    EXPECT_TRUE(loop) << loop.trouble();
    if (loop) reason = loop->stats().quality_reason;
    return started;
  };
  const SceneDesc quick = running({"quality=auto", "step_rate_hz=10"}, false);
  EXPECT_THAT(reason, testing::AllOf(testing::StartsWith("a step of full takes "),
                                     testing::EndsWith(" ms of the 100.0 ms there are")));
  EXPECT_EQ(quick.solver.name, "direct_rod");
  EXPECT_TRUE(quick.volume.air.acts);
  const std::vector<std::string> slow = {"quality=auto", "step_rate_hz=1000", "substeps=64"};
  const SceneDesc lowered = running(slow, false);
  EXPECT_EQ(lowered.solver.name, "dftl");
  EXPECT_FALSE(lowered.volume.acts());
  EXPECT_EQ(lowered.quality, kAutoQuality);
  EXPECT_THAT(reason, testing::StartsWith("a step of full takes "));
  EXPECT_EQ(running(slow, true).solver.name, "direct_rod") << "simulated time waits: nothing is measured";
  EXPECT_EQ(reason, "");
}

/// Largest way of a vertex between two states, m.
double largest_way_m(const Snapshot& from, const Snapshot& to) {
  double largest_m = 0.0;
  const size_t size = from.plane_size();
  for (size_t i = 0; i < size; ++i) {
    glm::dvec3 way_m;
    for (int axis = 0; axis < 3; ++axis)
      way_m[axis] = static_cast<double>(to.quantum_m) * to.lattice[axis * size + i] -
                    static_cast<double>(from.quantum_m) * from.lattice[axis * size + i];
    largest_m = std::max(largest_m, glm::length(way_m));
  }
  return largest_m;
}

// Hair that is blown goes on from where it is by another model, no faster than it went. To begin anew, as a
// reset does, is a jump.
TEST(SimLoopQuality, SteppingDownIsNoJump) {
  std::mutex mutex;
  std::shared_ptr<const Snapshot> newest;
  SimLoopConfig config;
  config.scene =
      with_overrides(test::small_scene(60, 16), {"quality=auto", "wind.mean_mps={ x: 4 z: 2 }"}).value();
  config.is_lockstep = true;
  config.on_publish = [&](const std::shared_ptr<const Snapshot>& state) {
    const std::lock_guard lock(mutex);
    newest = state;
  };
  const Loop loop(std::move(config));
  ASSERT_TRUE(loop) << loop.trouble();
  const auto after = [&](const ControlCommand& command) {
    std::promise<void> done;
    loop->post(command, [&](const Notice&) { done.set_value(); });
    done.get_future().wait();
    const std::lock_guard lock(mutex);
    return newest;
  };
  const auto blown = after({Command::StepOnce, 30});
  const auto next = after({Command::StepOnce, 1});
  const double usual_m = largest_way_m(*blown, *next);
  EXPECT_GT(usual_m, 2e-4) << "it moves";
  ASSERT_FALSE(loop.ask("quality=fast").is_error);
  const auto lowered = after({Command::StepOnce, 1});
  EXPECT_EQ(lowered->tick, next->tick + 1);
  EXPECT_LT(largest_way_m(*next, *lowered), 2.0 * usual_m);
  const auto reset = after({Command::Reset});
  EXPECT_GT(largest_way_m(*lowered, *reset), 10.0 * usual_m) << "that is a jump";
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

/// A simulation of a small scene without a network; null after a skip or a failure.
class Simulation {
 public:
  explicit Simulation(SimulationConfig config) {
    const StreamDesc stream = config.scene.stream;
    auto made = make_simulation(std::move(config), hub_);
    Status status = made.ok() ? (*made)->start(sink_, stream) : Status(made.error());
    if (status.ok())
      source_ = std::move(*made);
    else
      error_ = status.error();
  }
  explicit operator bool() const { return source_ != nullptr; }
  StateSource* operator->() const { return source_.get(); }
  std::string trouble() const { return error_.to_string(); }
  LoopSink& sink() { return sink_; }
  Notice ask(const std::string& assignment) const {
    auto answer = std::make_shared<std::promise<Notice>>();
    source_->post(SetParameter{assignment}, [answer](Notice notice) { answer->set_value(std::move(notice)); },
                  {});
    return answer->get_future().get();
  }

 private:
  InputHub hub_;
  LoopSink sink_;
  Error error_;
  std::unique_ptr<StateSource> source_;
};

TEST(LiveLooks, AFloodIsToldTenTimesASecondAndTheLastOneCounts) {
  SimulationConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  const LookDesc first = config.scene.look;
  Simulation simulation(std::move(config));
  if (!simulation && test::lacks_gl(simulation.trouble()))
    GTEST_SKIP() << "needs OpenGL 4.5: " << simulation.trouble();
  ASSERT_TRUE(simulation) << simulation.trouble();
  EXPECT_TRUE(simulation.sink().looks().empty()) << "nothing has changed";
  const int64_t begin_ns = now_ns();
  constexpr int kChanges = 300;
  for (int i = 1; i <= kChanges; ++i)
    ASSERT_FALSE(simulation.ask(fmt::format("look.ambient={}", 1e-3 * i)).is_error);
  const auto is_told = [&](auto&& is_it) {
    return eventually([&] {
      const auto looks = simulation.sink().looks();
      return !looks.empty() && is_it(looks.back());
    });
  };
  ASSERT_TRUE(is_told([](const LookChange& look) { return look.look.ambient == 0.3f; }));
  EXPECT_LE(simulation.sink().looks().size(), static_cast<size_t>((now_ns() - begin_ns) / kLookChangeNs) + 1);
  LookDesc expected = first;
  expected.ambient = 0.3f;
  EXPECT_EQ(simulation.sink().looks().back().look, expected) << "all else stays";
  EXPECT_EQ(simulation->scene()->look, expected);
  // While nothing is simulated, too, with what came too soon after the one before.
  simulation->post(ControlCommand{Command::Pause}, {}, {});
  for (const char* color : {"red", "black", "grey"})
    ASSERT_FALSE(simulation.ask(fmt::format("look.hair_color={}", color)).is_error);
  ASSERT_TRUE(is_told([](const LookChange& look) { return look.look.hair_color == "grey"; }));
  EXPECT_TRUE(simulation.sink().streams().empty()) << "the stream does not change with it";
}

TEST(LiveLooks, NeedNoTurnOfTheSimulation) {
  std::promise<void> held, go;
  auto let_go = go.get_future().share();
  std::atomic<int> published = 0;
  SimulationConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.on_publish = [&](const std::shared_ptr<const Snapshot>&) {
    if (++published != 2) return;
    held.set_value();
    let_go.wait();
  };
  Simulation simulation(std::move(config));
  if (!simulation && test::lacks_gl(simulation.trouble()))
    GTEST_SKIP() << "needs OpenGL 4.5: " << simulation.trouble();
  ASSERT_TRUE(simulation) << simulation.trouble();
  held.get_future().wait();  // the simulation's thread stands still
  std::promise<Notice> answered;
  auto answer = answered.get_future();
  simulation->post(SetParameter{"look.hair_color=red"},
                   [&](Notice notice) { answered.set_value(std::move(notice)); }, {});
  const bool is_answered = answer.wait_for(std::chrono::seconds(5)) == std::future_status::ready;
  EXPECT_TRUE(is_answered);
  EXPECT_EQ(simulation.sink().looks().size(), 1u);
  EXPECT_EQ(simulation->scene()->look.hair_color, "red");
  // What moves hair waits for its turn, and takes no other look back.
  simulation->post(SetParameter{"look.shading.wetness=0.5"}, {}, {});
  simulation->post(SetParameter{"look.shading.wetness=0"}, {}, {});
  simulation->post(SetParameter{"look.ambient=0.125"}, {}, {});
  EXPECT_NE(simulation->scene()->look.ambient, 0.125f) << "it came after one that waits";
  go.set_value();
  EXPECT_FALSE(simulation.ask("look.exposure=1.25").is_error);
  const LookDesc look = simulation->scene()->look;
  EXPECT_EQ(look.hair_color, "red");
  EXPECT_EQ(look.shading.wetness, 0.0f) << "the newer one counts";
  EXPECT_EQ(look.ambient, 0.125f);
  EXPECT_EQ(look.exposure, 1.25f);
  EXPECT_TRUE(simulation.ask("look.exposure=bright").is_error);
  EXPECT_EQ(simulation->scene()->look, look);
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

/// Encodes every state, and tells the simulation what viewers have.
class EncodingSink final : public LoopSink {
 public:
  EncodingSink(SharedSlot& slot, const Groom& groom) : slot_(slot) {
    encoder_ = make_strand_encoder("step").value();
    encoder_->set_rest_shape(make_scene_asset(groom, {}).rest_position_m);
  }
  void put(std::shared_ptr<const Snapshot> snapshot) override {
    encoder_->set_state(slot_.take_state(snapshot->tick));
    encoder_->encode(*snapshot);
    if (const auto update = encoder_->take_shared(slot_.wanted())) slot_.put(*update);
    shared_ = snapshot->trail == nullptr ? 0 : snapshot->trail->shared;
    if (shared_ == 0) ++alone_count_;
    if (shared_ != 0 && shared_ == known_ && encoder_->step_count() == steps_) ++handed_count_;
    known_ = shared_;
    steps_ = encoder_->step_count();
  }
  uint64_t shared() const { return shared_; }
  int alone_count() const { return alone_count_; }    // states of strands that are not shared
  int handed_count() const { return handed_count_; }  // that the encoder did not step to

 private:
  SharedSlot& slot_;
  std::unique_ptr<StrandEncoder> encoder_;
  std::atomic<uint64_t> shared_ = 0;
  std::atomic<int> alone_count_ = 0, handed_count_ = 0;
  uint64_t known_ = 0, steps_ = 0;
};

// With an observer too: what is seen here is what is served.
TEST(SimLoopShared, StrandsGoOnFromThoseOfViewersAlsoIfSomebodyObserves) {
  SharedSlot slot;
  SimLoopConfig config;
  config.scene = test::small_scene(kStrands, kVertices);
  config.device.sim_device = "lanes";
  config.shared = &slot;
  config.on_publish = [](const auto&) {};
  auto content = load_scene_content(config.scene);
  ASSERT_TRUE(content.ok());
  config.content = std::make_shared<const SceneContent>(std::move(*content));
  EncodingSink sink(slot, config.content->groom);
  InputHub hub;
  auto loop = SimLoop::start(std::move(config), hub, sink);
  ASSERT_TRUE(loop.ok()) << loop.error().to_string();
  SourceDemand demand;
  demand.facts.strand_viewers = 1;
  (*loop)->set_demand(demand);
  const auto wait_for = [&](const auto& holds) {
    for (int i = 0; i < 2000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return holds();
  };
  ASSERT_TRUE(wait_for([&] { return sink.shared() != 0; }));
  ASSERT_TRUE(wait_for([&] { return sink.handed_count() > 5; }));
  const int before = sink.alone_count();
  const uint64_t number = sink.shared();
  (*loop)->post(ControlCommand{Command::Reset}, [](const Notice&) {});
  EXPECT_TRUE(wait_for([&] { return sink.shared() > number; })) << "shared again after the reset";
  EXPECT_GT(sink.alone_count(), before) << "the reset hair is the solver's";
}

}  // namespace
}  // namespace strandcast::sim_loop_test
