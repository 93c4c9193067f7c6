// strandcast-ctl step N: waits as long as steps take, tells how far it is, and ends for a reason only.
#include "client/app/step_command.h"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>
#include <vector>

#include "tests/support/client_config.h"
#include "tests/support/fake_server.h"
#include "tests/support/server_fixture.h"

namespace strandcast::step_command_test {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr milliseconds kLimit{20};  // as 5 s once were
constexpr milliseconds kLate = 5 * kLimit;
constexpr uint32_t kSteps = 40;

Result<std::unique_ptr<ViewerClient>> connect_to(const test::FakeServer& server) {
  ClientConfig config = test::config_for(server.port());
  config.hello.role = Role::Controller;
  config.hello.gets_no_stream = true;
  return ViewerClient::connect(config);
}

/// Takes what it is asked for, and answers so late each time; what it was asked for goes to `portions`.
test::FakeServer::Script slow_server(milliseconds late, std::vector<uint32_t>& portions) {
  return [late, &portions](test::FakePeer& peer) {
    peer.welcome(test::make_welcome(2, 4));
    uint64_t tick = 0;
    while (const auto command = peer.read_until<ControlCommand>()) {
      portions.push_back(command->step_count);
      tick += command->step_count;
      peer.send(Notice{false, "Session 7 moved your view."});
      peer.send(ServerStatus{});
      std::this_thread::sleep_for(late);
      peer.send(Notice{false, "done", tick, 1});
    }
  };
}

TEST(StepCommand, WaitsForAnswersThatComeLateAndTellsHowFarItIs) {
  std::vector<uint32_t> portions;
  std::vector<uint32_t> told;
  {
    const test::FakeServer server(slow_server(kLate, portions));
    auto client = connect_to(server);
    ASSERT_TRUE(client) << client.error().to_string();
    const auto answer = take_steps(**client, {kSteps}, false, [&](uint32_t done) { told.push_back(done); });
    ASSERT_TRUE(answer) << answer.error().to_string();
    EXPECT_EQ(answer->tick, kSteps);
    (*client).reset();
  }
  uint32_t sum = 0;
  for (size_t i = 0; i < portions.size(); ++i) {
    sum += portions[i];
    if (i >= told.size()) continue;
    EXPECT_EQ(told[i], sum);
  }
  EXPECT_EQ(sum, kSteps);
  EXPECT_GT(portions.size(), 1u);
  EXPECT_EQ(told.size() + 1, portions.size());
}

// The counter-example: with a limit, as there was one, the same server is given up.
TEST(StepCommand, ALimitGivesUpASlowServer) {
  std::vector<uint32_t> portions;
  const test::FakeServer server(slow_server(10 * kLate, portions));
  auto client = connect_to(server);
  ASSERT_TRUE(client) << client.error().to_string();
  const auto answer = take_steps(**client, {kSteps, kLimit}, false, {});
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, ErrorCode::Timeout);
  EXPECT_THAT(answer.error().to_string(), HasSubstr("0 of 40 steps are done, 1 under way"));
}

TEST(StepCommand, EndsWhereItIsStoppedRefusedOrLeftAlone) {
  std::atomic<bool> stop{false};
  const auto error_of = [&](const test::FakeServer::Script& answer) {
    const test::FakeServer server([&](test::FakePeer& peer) {
      peer.welcome(test::make_welcome(2, 4));
      peer.read_until<ControlCommand>();
      peer.send(Notice{false, "done", 1, 1});
      peer.read_until<ControlCommand>();
      answer(peer);
      peer.read_to_end();
    });
    auto client = connect_to(server);
    EXPECT_TRUE(client) << client.error().to_string();
    if (!client) return std::string();
    const auto result = take_steps(**client, {kSteps}, stop, {});
    EXPECT_FALSE(result);
    (*client).reset();
    return result ? std::string() : result.error().to_string();
  };
  EXPECT_THAT(error_of([](test::FakePeer& peer) {
                peer.send(Notice{true, "send Pause first."});
              }),
              HasSubstr("send Pause first. (1 of 40 steps are done)"));
  EXPECT_THAT(error_of([](test::FakePeer& peer) { peer.reset(); }), HasSubstr("1 of 40 steps are done"));
  EXPECT_THAT(error_of([&](test::FakePeer&) { stop = true; }),
              HasSubstr("stopped (1 of 40 steps are done, 4"));
}

TEST(StepCommand, PortionsAreAboutAHalfSecondAndGrowGently) {
  using std::chrono::microseconds;
  EXPECT_EQ(next_portion(1, microseconds(10)), 4u) << "four times as many at most";
  EXPECT_EQ(next_portion(100, milliseconds(250)), 200u);
  EXPECT_EQ(next_portion(200, milliseconds(5000)), 20u);
  EXPECT_EQ(next_portion(1, milliseconds(9000)), 1u) << "a step that takes long is one all the same";
  EXPECT_EQ(next_portion(kMaxStepCount, milliseconds(1)), kMaxStepCount);
  EXPECT_EQ(next_portion(7, milliseconds(0)), 28u);
}

class StepsOfAServer : public test::ServerFixture {};

TEST_F(StepsOfAServer, AreTakenInPortionsAsAtOnce) {
  ServerConfig config;
  config.scene = test::small_scene();
  config.is_lockstep = true;
  if (!start(std::move(config))) return;
  testing::internal::CaptureStdout();
  const std::atomic<bool> stop{false};
  EXPECT_EQ(run_step(ctl_target(), 300, stop), kDoneExit);
  EXPECT_EQ(run_step(ctl_target(), 5, stop), kDoneExit);
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_THAT(said, HasSubstr("300 steps done: at step 300.\n"));
  EXPECT_THAT(said, HasSubstr("5 steps done: at step 305.\n"));
  EXPECT_EQ(server_->counters().sim.tick, 305u);
}

}  // namespace
}  // namespace strandcast::step_command_test
