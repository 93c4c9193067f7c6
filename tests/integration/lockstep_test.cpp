// A server whose simulated time goes on by commands only: when steps are answered, and that what comes over
// the network leads to the same bits however it comes.
#include <gmock/gmock.h>

#include <atomic>
#include <thread>

#include "common/client/viewer_client.h"
#include "tests/support/server_fixture.h"

namespace strandcast::lockstep_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef";

class Lockstep : public test::ServerFixture {
 protected:
  [[nodiscard]] bool begin(bool is_lockstep = true) {
    ServerConfig config;
    config.scene = test::small_scene();
    config.is_lockstep = is_lockstep;
    config.net.tokens = {{kToken, Grant::Admin}};
    config.on_publish = [this](const auto& state) { published_tick_ = state->tick; };
    return start(std::move(config));
  }

  std::unique_ptr<ViewerClient> connect() {
    ClientConfig config = client_config(StreamMode::Strands, Role::Admin);
    config.hello.token = kToken;
    config.hello.gets_no_stream = true;
    auto client = ViewerClient::connect(config);
    if (client) return std::move(client).value();
    ADD_FAILURE() << client.error().to_string();
    return nullptr;
  }

  /// The next notice; an error when none comes.
  static Notice next_notice(ViewerClient& client) {
    std::optional<Notice> notice;
    EXPECT_TRUE(eventually([&] {
      while (const auto event = client.next(milliseconds(5)))
        if (const auto* found = std::get_if<Notice>(&*event)) return notice = *found, true;
      return false;
    }));
    return notice.value_or(Notice{true, "no notice came"});
  }
  static Notice ask(ViewerClient& client, const ClientMessage& message) {
    EXPECT_TRUE(client.send(message));
    return next_notice(client);
  }
  static ControlCommand steps(uint32_t count) { return {Command::StepOnce, count}; }

  /// A head that swings, one sample for each of these steps, in messages of so many.
  static void swing(ViewerClient& client, uint64_t first, uint64_t last, size_t per_message) {
    constexpr int64_t kClock = 77'000'000'000;  // where the source's happens to be
    MotionSamples message;
    const auto send = [&] {
      if (!message.samples.empty()) {
        EXPECT_TRUE(client.send(message));
      }
      message.samples.clear();
    };
    for (uint64_t tick = first; tick <= last; ++tick) {
      const auto time_ns = static_cast<int64_t>(tick) * 1'000'000'000 / 60;
      const double x = 0.05 * std::sin(0.2 * static_cast<double>(tick));
      message.samples.push_back({kClock + time_ns, {{x, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}});
      if (message.samples.size() == per_message) send();
    }
    send();
  }

  std::atomic<uint64_t> published_tick_{0};
};

TEST_F(Lockstep, TimeGoesOnByStepsAloneAndTheAnswerComesWhenTheyArePublished) {
  if (!begin()) return;
  const auto client = connect();
  ASSERT_NE(client, nullptr);
  ASSERT_TRUE(eventually([&] {  // a status, half a second after the start
    const auto event = client->next(milliseconds(50));
    return event && std::holds_alternative<ServerStatus>(*event);
  }));
  EXPECT_EQ(server_->counters().sim.tick, 0u) << "nobody asked for a step";
  const Notice done = ask(*client, steps(25));
  EXPECT_FALSE(done.is_error) << done.text;
  EXPECT_EQ(done.tick, 25u);
  EXPECT_NE(done.state_hash, 0u);
  EXPECT_EQ(published_tick_, 25u);
  EXPECT_EQ(server_->counters().sim.tick, 25u);
  const Notice resumed = ask(*client, ControlCommand{Command::Resume});
  EXPECT_TRUE(resumed.is_error);
  EXPECT_THAT(resumed.text, HasSubstr("lockstep"));
  EXPECT_EQ(server_->counters().sim.tick, 25u);
}

TEST_F(Lockstep, TheSameSamplesAndStepsLeadToTheSameBits) {
  const auto run = [this](size_t per_message, uint32_t steps_at_once, double swing_share) {
    uint64_t hash = 0;
    if (!begin()) return hash;
    const auto client = connect();
    if (client == nullptr) return hash;
    if (swing_share > 0.0) swing(*client, 0, 60, per_message);
    for (uint32_t done = 0; done < 60; done += steps_at_once) {
      const Notice notice = ask(*client, steps(steps_at_once));
      EXPECT_FALSE(notice.is_error) << notice.text;
      hash = notice.state_hash;
    }
    server_->stop();
    server_.reset();
    return hash;
  };
  const uint64_t hash = run(1, 60, 1.0);
  if (hash == 0) return;
  EXPECT_EQ(run(61, 60, 1.0), hash) << "other messages";
  EXPECT_EQ(run(7, 5, 1.0), hash) << "other commands";
  EXPECT_NE(run(7, 5, 0.0), hash) << "without the samples it is another state";
}

// Commands that come while steps are under way have their turn after them.
TEST_F(Lockstep, CommandsKeepTheirPlaceBetweenSteps) {
  const auto run = [this](bool waits) {
    uint64_t hash = 0;
    if (!begin()) return hash;
    const auto client = connect();
    if (client == nullptr) return hash;
    const std::vector<ClientMessage> messages = {steps(30), SetParameter{"gravity_mps2={ x: 9.8 y: 0 }"},
                                                 steps(30), SetParameter{"solver.name=dftl_parallel"},
                                                 steps(1)};
    std::vector<Notice> answers;
    for (const ClientMessage& message : messages) {
      EXPECT_TRUE(client->send(message));
      if (waits) answers.push_back(next_notice(*client));
    }
    while (answers.size() < messages.size()) answers.push_back(next_notice(*client));
    EXPECT_EQ(answers[0].tick, 30u) << answers[0].text;
    EXPECT_THAT(answers[1].text, HasSubstr("from step 31 on"));
    EXPECT_EQ(answers[2].tick, 60u) << answers[2].text;
    EXPECT_EQ(answers[4].tick, 61u) << answers[4].text;
    hash = answers[4].state_hash;
    server_->stop();
    server_.reset();
    return hash;
  };
  const uint64_t hash = run(true);
  if (hash == 0) return;
  EXPECT_EQ(run(false), hash);
}

TEST_F(Lockstep, AnyPausedServerCountsSteps) {
  if (!begin(false)) return;
  const auto client = connect();
  ASSERT_NE(client, nullptr);
  const Notice refused = ask(*client, steps(5));
  EXPECT_TRUE(refused.is_error);
  EXPECT_THAT(refused.text, HasSubstr("strandcast-ctl pause"));
  ASSERT_FALSE(ask(*client, ControlCommand{Command::Pause}).is_error);
  const uint64_t before = server_->counters().sim.tick;
  const Notice done = ask(*client, steps(5));
  EXPECT_EQ(done.tick, before + 5);
  EXPECT_FALSE(ask(*client, ControlCommand{Command::Resume}).is_error);
  EXPECT_TRUE(eventually([&] { return server_->counters().sim.tick > before + 5; }));
}

// What the heartbeat for a service manager goes by.
TEST_F(Lockstep, ATurnOfTheLoopThatDoesNotEndIsSeenAndOneThatWaitsIsNone) {
  constexpr int64_t kLongNs = 50'000'000;
  std::atomic<bool> is_held{false};
  ServerConfig config;
  config.scene = test::small_scene();
  config.on_publish = [&](const auto&) {
    while (is_held) std::this_thread::sleep_for(milliseconds(1));
  };
  if (!start(std::move(config))) return;
  const auto busy_ns = [&] { return server_->counters().sim.busy_ns; };
  is_held = true;
  EXPECT_TRUE(eventually([&] { return busy_ns() > kLongNs; }));
  is_held = false;
  EXPECT_TRUE(eventually([&] { return busy_ns() == 0; }));
  server_->stop();  // before what it calls is gone
}

}  // namespace
}  // namespace strandcast::lockstep_test
