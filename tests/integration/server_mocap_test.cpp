// Live motion capture through a whole server: datagrams on loopback move the head, and everybody is told how
// they come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <mutex>
#include <thread>

#include "common/motion/mocap_packet.h"
#include "common/motion/motion_clip.h"
#include "common/scene/scene_file.h"
#include "server/input/input_hub.h"
#include "server/input/live/live_parser.h"
#include "tests/support/live_packets.h"
#include "tests/support/log_capture.h"
#include "tests/support/metrics_text.h"
#include "tests/support/raw_client.h"
#include "tests/support/server_fixture.h"
#include "tests/support/udp_socket.h"

namespace strandcast::server_mocap_test {
namespace {

using test::UdpSocket;
using testing::AllOf;
using testing::HasSubstr;

Result<std::unique_ptr<LiveParser>> parser_of(const std::string& protocol) {
  LiveParserConfig config;
  config.protocol = protocol;
  return make_live_parser(config);
}

/// A server that hears one protocol on a port of its own.
class LiveMocap : public test::ServerFixture {
 protected:
  [[nodiscard]] bool listen(LiveDesc live, const std::function<void(ServerConfig&)>& change = {}) {
    port_ = test::free_udp_port();
    live.port = port_;
    ServerConfig config;
    config.scene = test::bald_scene();
    config.scene.live = {live};
    config.sim_device = "lanes";
    config.on_publish = [this](const std::shared_ptr<const Snapshot>& state) {
      const std::lock_guard lock(mutex_);
      head_ = state->world_from_head;
    };
    if (change) change(config);
    return start(std::move(config));
  }
  Pose head() {
    const std::lock_guard lock(mutex_);
    return head_;
  }
  LiveInputStatus status() const { return server_->counters().live_inputs.front(); }
  /// Sends over and over, as a tracker does, until it holds.
  template <class Condition>
  [[nodiscard]] bool sends_until(const UdpSocket& from, const test::PacketBytes& packet,
                                 Condition condition) {
    return eventually([&] {
      from.send(packet, port_);
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
      return condition();
    });
  }
  bool is_head_at(const glm::dvec3& place_m, double within_m = 1e-3) {
    return glm::distance(head().position_m, place_m) < within_m;
  }

  uint16_t port_ = 0;

 private:
  std::mutex mutex_;
  Pose head_;
};

/// x and z in cm; opentrack's z goes back.
test::PacketBytes tracked(double x_cm, double yaw_deg = 0.0) {
  return test::opentrack({x_cm, 0.0, 0.0, yaw_deg, 0.0, 0.0});
}

TEST_F(LiveMocap, DatagramsMoveTheHeadUntilNoneComes) {
  if (!listen({.protocol = "opentrack"})) return;
  EXPECT_TRUE(status().is_stale);
  EXPECT_TRUE(status().sender.empty());
  UdpSocket tracker;
  ASSERT_TRUE(sends_until(tracker, tracked(30.0, 90.0), [&] { return is_head_at({0.3, 0.0, 0.0}); }));
  // Yaw to the right of opentrack is a turn to -X here.
  EXPECT_LT(glm::distance(head().rotation * glm::dvec3(0, 0, 1), glm::dvec3(-1, 0, 0)), 1e-2);
  EXPECT_EQ(status().sender, tracker.name());
  EXPECT_FALSE(status().is_stale);
  EXPECT_FALSE(server_->counters().sim.is_motion_stale);
  EXPECT_GT(status().packets, 0u);
  const std::string text = test::http_get(server_->port(), "/metrics");
  std::vector<std::string> faults;
  auto metrics = test::read_metrics(text.substr(text.find("\r\n\r\n") + 4), faults);
  test::check_metrics(metrics, faults);
  EXPECT_THAT(faults, testing::IsEmpty());
  ASSERT_EQ(metrics["strandcast_live_packets_total"].samples.size(), 1u);
  EXPECT_EQ(metrics["strandcast_live_packets_total"].samples[0].first,
            "strandcast_live_packets_total{input=\"0\",protocol=\"opentrack\"}");
  EXPECT_GT(metrics["strandcast_live_packets_total"].samples[0].second, 0.0);
  EXPECT_EQ(metrics["strandcast_live_stale"].samples[0].second, 0.0);
  // Nothing comes: it is told everywhere, and the head stays.
  EXPECT_TRUE(eventually([&] { return status().is_stale && server_->counters().sim.is_motion_stale; }));
  EXPECT_TRUE(is_head_at({0.3, 0.0, 0.0}));
  EXPECT_THAT(test::http_get(server_->port(), "/metrics"),
              HasSubstr("strandcast_live_stale{input=\"0\",protocol=\"opentrack\"} 1"));
}

TEST_F(LiveMocap, OneSenderIsHeardAtATime) {
  test::LogCapture log;
  if (!listen({.protocol = "opentrack"})) return;
  UdpSocket first, second;
  ASSERT_TRUE(sends_until(first, tracked(20.0), [&] { return is_head_at({0.2, 0.0, 0.0}); }));
  const uint64_t refused_before = status().refused;
  ASSERT_TRUE(sends_until(first, tracked(20.0), [&] {
    second.send(tracked(-40.0), port_);
    EXPECT_GT(head().position_m.x, -0.01);
    return status().refused > refused_before + 20;
  }));
  EXPECT_EQ(status().sender, first.name());
  // When the first is gone it is the second's turn.
  EXPECT_TRUE(sends_until(second, tracked(-40.0), [&] { return is_head_at({-0.4, 0.0, 0.0}); }));
  EXPECT_EQ(status().sender, second.name());
  EXPECT_EQ(log.count(first.name() + " sends"), 1u);
  EXPECT_EQ(log.count(second.name() + " sends too"), 1u);
  EXPECT_EQ(log.count(first.name() + " has stopped sending"), 1u);
}

TEST_F(LiveMocap, MalformedPacketsAreCountedAndChangeNothing) {
  test::LogCapture log;
  if (!listen({.protocol = "opentrack"})) return;
  UdpSocket tracker;
  ASSERT_TRUE(sends_until(tracker, tracked(10.0), [&] { return is_head_at({0.1, 0.0, 0.0}); }));
  EXPECT_TRUE(eventually([&] {
    tracker.send(tracked(10.0), port_);
    tracker.send(test::PacketBytes(47), port_);
    tracker.send(test::opentrack({std::numeric_limits<double>::quiet_NaN(), 0, 0, 0, 0, 0}), port_);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return status().malformed > 100 && status().impossible > 100;
  }));
  EXPECT_TRUE(is_head_at({0.1, 0.0, 0.0}));
  EXPECT_GE(log.count("malformed"), 1u);
  EXPECT_LE(log.count("malformed"), 25u) << "a flood fills no log";
}

TEST_F(LiveMocap, CommandsCalibrateAndChoose) {
  if (!listen({.protocol = "freed"})) return;
  UdpSocket tracker;
  const auto camera = [](uint8_t number, double height_mm) {
    test::FreedPacket packet;
    packet.camera = number;
    packet.position_mm = {0, 0, height_mm};
    return test::freed(packet);
  };
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::Calibrate, ""}), kRefusedExit)
      << "nothing is seen";
  ASSERT_TRUE(sends_until(tracker, camera(1, 1'700), [&] { return is_head_at({0.0, 1.7, 0.0}); }));
  std::atomic<bool> is_over{false};
  std::thread stage([&] {
    while (!is_over) {
      tracker.send(camera(1, 1'700), port_);
      tracker.send(camera(2, 1'200), port_);
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
    }
  });
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::Calibrate, ""}), kDoneExit);
  EXPECT_TRUE(eventually([&] { return is_head_at({0.0, 0.0, 0.0}); }));
  EXPECT_TRUE(status().is_calibrated);
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::Reset, ""}), kDoneExit);
  EXPECT_TRUE(eventually([&] { return is_head_at({0.0, 1.7, 0.0}); }));
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::ChooseSubject, "2"}), kDoneExit);
  EXPECT_TRUE(eventually([&] { return is_head_at({0.0, 1.2, 0.0}); }));
  // Nobody of that name: the head waits.
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::ChooseSubject, "3"}), kDoneExit);
  EXPECT_TRUE(eventually([&] { return status().is_stale; }));
  // The scene that is saved knows whom the head waits for.
  const auto path = std::filesystem::temp_directory_path() / fmt::format("mocap_{}.textproto", getpid());
  EXPECT_EQ(run_save(ctl_target(), path), kDoneExit);
  const auto saved = load_scene(path, {});
  ASSERT_TRUE(saved) << saved.error().to_string();
  ASSERT_EQ(saved->live.size(), 1u);
  EXPECT_EQ(saved->live[0].subject, "3");
  EXPECT_EQ(saved->live[0].port, port_);
  std::filesystem::remove(path);
  is_over = true;
  stage.join();
}

TEST_F(LiveMocap, AServerWithoutInputsSaysHowToGetThem) {
  if (!start(test::bald_scene())) return;
  EXPECT_EQ(run_command(ctl_target(), LiveCommand{LiveAction::Calibrate, ""}), kRefusedExit);
  EXPECT_TRUE(server_->counters().live_inputs.empty());
  EXPECT_EQ(test::http_get(server_->port(), "/metrics").find("strandcast_live_"), std::string::npos);
}

TEST_F(LiveMocap, TheSenderThatShipsMovesTheHeadAsItsMotionSays) {
  if (!listen({.protocol = "vmc"})) return;
  FeedOptions feed;
  feed.as = "vmc";
  feed.to = fmt::format("127.0.0.1:{}", port_);
  feed.seconds = 2.0;
  std::atomic<bool> stop{false};
  std::atomic<bool> is_over{false};
  // Wherever the head is, the motion comes by there.
  double farthest_m = 0.0, largest_m = 0.0;
  std::thread feeder([&] {
    EXPECT_EQ(run_feed(ctl_target(), feed, stop), kDoneExit);
    is_over = true;
  });
  while (!is_over) {
    const glm::dvec3 place_m = head().position_m;
    // A packet is there before the step that takes it.
    if (!status().is_stale && place_m != glm::dvec3(0.0)) {
      double nearest_m = 1e9;
      for (double t_s = 0.0; t_s < 2.5; t_s += 0.005)
        nearest_m = std::min(nearest_m, glm::distance(place_m, built_in_motion(t_s).position_m));
      farthest_m = std::max(farthest_m, nearest_m);
      largest_m = std::max(largest_m, glm::length(place_m - built_in_motion(0.0).position_m));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  feeder.join();
  EXPECT_GT(status().packets, 50u);
  EXPECT_GT(largest_m, 0.005) << "it moved";
  EXPECT_LT(farthest_m, 0.03);
  EXPECT_EQ(status().malformed + status().impossible + status().gated, 0u);
}

TEST_F(LiveMocap, MonitorShowsWhatComes) {
  if (!listen({.protocol = "opentrack"})) return;
  UdpSocket tracker;
  std::atomic<bool> is_over{false};
  std::thread stage([&] {
    while (!is_over) {
      tracker.send(tracked(12.5), port_);
      std::this_thread::sleep_for(std::chrono::milliseconds(8));
    }
  });
  ASSERT_TRUE(eventually([&] { return status().rate_hz > 0.0; }));
  testing::internal::CaptureStdout();
  std::atomic<bool> stop{false};
  EXPECT_EQ(run_monitor(ctl_target(), 1.2, stop), kDoneExit);
  const std::string text = testing::internal::GetCapturedStdout();
  is_over = true;
  stage.join();
  EXPECT_THAT(text, AllOf(HasSubstr(fmt::format("opentrack on port {}", port_)), HasSubstr(tracker.name()),
                          HasSubstr("packets/s"), HasSubstr("12.5")));
}

TEST_F(LiveMocap, SendersThatMayNotAreRefused) {
  // Whoever is asked is the only one that may answer.
  test::LogCapture log;
  if (!listen({.protocol = "natnet", .host = "127.0.0.1"})) return;
  UdpSocket stranger("127.0.0.2");
  EXPECT_TRUE(sends_until(stranger, test::PacketBytes(100), [&] { return status().refused > 5; }));
  EXPECT_EQ(status().malformed + status().packets, 0u) << "nothing of it is read";
  EXPECT_GE(log.count(stranger.name() + " may not send"), 1u);
}

// What comes by one protocol goes on by others, as the head moves.
TEST_F(LiveMocap, OtherProgramsFollowTheHead) {
  const std::array<UdpSocket, 3> sockets;
  const std::array<std::string, 3> protocols = {"opentrackio", "opentrackio-cbor", "vmc"};
  const bool is_there = listen({.protocol = "opentrack"}, [&](ServerConfig& config) {
    for (size_t i = 0; i < sockets.size(); ++i)
      config.sends.push_back({protocols[i], {"127.0.0.1", sockets[i].port()}});
  });
  if (!is_there) return;
  UdpSocket tracker;
  ASSERT_TRUE(sends_until(tracker, tracked(30.0, 90.0), [&] { return is_head_at({0.3, 0.0, 0.0}); }));
  for (size_t i = 0; i < sockets.size(); ++i) {
    auto parser = parser_of(protocols[i].substr(0, protocols[i].find('-'))).value();
    EXPECT_TRUE(sends_until(tracker, tracked(30.0, 90.0), [&] {
      const auto packet = parser->parse(sockets[i].take(), 0);
      return packet && packet->poses.size() == 1 &&
             glm::distance(packet->poses[0].world_from_subject.position_m, glm::dvec3(0.3, 0, 0)) < 1e-3 &&
             angle_between_rad(packet->poses[0].world_from_subject.rotation, head().rotation) < 1e-2;
    })) << protocols[i];
  }
}

TEST(HeadSends, AreOneSentenceWhereTheyAreWrong) {
  EXPECT_EQ(parse_head_send("opentrackio://239.135.1.7").value(),
            (HeadSend{"opentrackio", {"239.135.1.7", 55555}}));
  EXPECT_EQ(parse_head_send("vmc:5").value(), (HeadSend{"vmc", {"127.0.0.1", 5}}));
  EXPECT_THAT(parse_head_send("natnet").error().to_string(), AllOf(HasSubstr("--send"), HasSubstr("freed")));
  EXPECT_THAT(parse_head_send("vmc:0").error().to_string(), HasSubstr("--send vmc:0"));
  // Of further heads, what numbers them.
  const auto second = HeadSender::open({{"vmc", {}}, {"opentrack", {}}}, {1, 60.0});
  ASSERT_TRUE(second);
  EXPECT_TRUE((*second)->is_empty());
  EXPECT_FALSE(HeadSender::open({{"freed", {}}}, {1, 60.0}).value()->is_empty());
}

TEST(MocapPackets, SayWhatTheirParsersRead) {
  for (const char* name : {"vmc", "opentrack", "freed", "vrchat", "opentrackio"}) {
    SCOPED_TRACE(name);
    const auto encoding = find_mocap_encoding(name);
    ASSERT_TRUE(encoding);
    auto parser = parser_of(name);
    ASSERT_TRUE(parser) << parser.error().to_string();
    for (const LiveProtocol& protocol : live_protocols())
      if (protocol.name == std::string(name)) {
        EXPECT_EQ(protocol.default_port, encoding->port);
      }
    // All around, but for heads that look straight up, where two of three angles are one.
    for (int i = 0; i < 200; ++i) {
      const double t = 0.37 * i;
      const glm::dquat turn = glm::angleAxis(3.0 * std::sin(t), glm::dvec3(0, 1, 0)) *
                              glm::angleAxis(1.4 * std::sin(1.7 * t), glm::dvec3(1, 0, 0)) *
                              glm::angleAxis(3.0 * std::sin(2.3 * t), glm::dvec3(0, 0, 1));
      const Pose pose{{std::sin(t), 1.6 + 0.1 * std::cos(t), 2.0 * std::sin(0.3 * t)}, turn};
      const auto packet = (*parser)->parse(encoding->encode({t, pose, {}}), i);
      ASSERT_TRUE(packet) << packet.error().to_string();
      ASSERT_EQ(packet->poses.size(), 1u) << i;
      EXPECT_LT(glm::distance(packet->poses[0].world_from_subject.position_m, pose.position_m), 2e-5) << i;
      EXPECT_LT(angle_between_rad(packet->poses[0].world_from_subject.rotation, turn), 2e-6) << i;
    }
  }
  EXPECT_THAT(find_mocap_encoding("bvh").error().to_string(), HasSubstr("opentrack"));
}

// A float has steps of 31 ms at five days, and of a quarter of a millisecond below 4096 s.
TEST(MocapPackets, TimesOfVmcStayFine) {
  const auto encoding = find_mocap_encoding("vmc");
  auto parser = parser_of("vmc");
  std::optional<int64_t> before;
  for (int i = 0; i < 400; ++i) {
    const auto packet = (*parser)->parse(encoding->encode({5.0 * 86'400.0 + i / 60.0, {}}), i);
    ASSERT_TRUE(packet && packet->poses.size() == 1);
    const auto time_ns = packet->poses[0].source_time_ns;
    ASSERT_TRUE(time_ns);
    if (before) {
      EXPECT_NEAR(static_cast<double>(*time_ns - *before), 1e9 / 60.0, 0.3e6) << i;
    }
    before = time_ns;
  }
}

TEST(MocapPackets, WindGoesWithVmc) {
  const auto encoding = find_mocap_encoding("vmc");
  auto parser = parser_of("vmc");
  const auto packet = (*parser)->parse(encoding->encode({0.0, {}, glm::vec3(1, -2, 3)}), 0);
  ASSERT_TRUE(packet && packet->wind_mps);
  EXPECT_EQ(*packet->wind_mps, glm::dvec3(1, -2, 3));
}

/// What a server says that cannot start.
std::string refusal_of(const LiveDesc& live) {
  ServerConfig config;
  config.scene = test::bald_scene();
  config.scene.live = {live};
  config.sim_device = "lanes";
  config.net.port = 0;
  const auto server = Server::start(config);
  return server ? "it started" : server.error().to_string();
}

TEST(LiveMocapErrors, AreOneSentenceThatNamesTheField) {
  EXPECT_THAT(refusal_of({.protocol = "smoke"}),
              AllOf(HasSubstr("live.0"), HasSubstr("smoke"), HasSubstr("vmc")));
  UdpSocket busy;
  EXPECT_THAT(refusal_of({.protocol = "vmc", .port = busy.port()}),
              AllOf(HasSubstr("live.0"), HasSubstr(std::to_string(busy.port())), HasSubstr("in use")));
  EXPECT_THAT(refusal_of({.protocol = "vrpn", .host = "no.such.host.invalid"}),
              AllOf(HasSubstr("live.0.host"), HasSubstr("no.such.host.invalid")));
  EXPECT_THAT(refusal_of({.protocol = "vrpn"}), AllOf(HasSubstr("live.0.host"), HasSubstr("vrpn://HOST")));
}

}  // namespace
}  // namespace strandcast::server_mocap_test
