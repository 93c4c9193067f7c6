// Live inputs by real sockets, without a simulation: servers that are asked, and who may answer.
#include "server/app/live_manager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <poll.h>

#include <array>
#include <atomic>
#include <thread>

#include "common/base/profile.h"
#include "tests/support/eventually.h"
#include "tests/support/live_packets.h"
#include "tests/support/log_capture.h"
#include "tests/support/udp_socket.h"

namespace strandcast::live_manager_test {
namespace {

using test::UdpSocket;

/// Inputs with what they feed.
class LiveManagers : public testing::Test {
 protected:
  [[nodiscard]] bool open(const LiveDesc& live, const std::vector<AddressRange>& allowed = {}) {
    std::vector<LiveManager::Target> targets(1);
    targets[0] = {
        {live}, &hub_, {[this](uint64_t, const MotionSamples&, int64_t) { ++told_; }, nullptr, nullptr}};
    auto manager = LiveManager::open(std::move(targets), allowed);
    EXPECT_TRUE(manager) << manager.error().to_string();
    if (!manager) return false;
    manager_ = std::move(*manager);
    manager_->start();
    return true;
  }
  void TearDown() override {
    if (manager_ != nullptr) manager_->stop();
  }
  LiveInputStatus status() const { return manager_->status().front(); }
  glm::dvec3 head_m() { return hub_.sample(now_ns()).world_from_head.position_m; }
  bool is_head_at(const glm::dvec3& place_m) { return glm::distance(head_m(), place_m) < 1e-3; }

  InputHub hub_;
  std::atomic<uint64_t> told_{0};
  std::unique_ptr<LiveManager> manager_;
};

/// A server of VRPN for one connection at a time.
class VrpnServer {
 public:
  VrpnServer() : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(own);
    EXPECT_EQ(bind(listener_, reinterpret_cast<const sockaddr*>(&own), size), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    EXPECT_EQ(getsockname(listener_, reinterpret_cast<sockaddr*>(&own), &size), 0);
    port_ = ntohs(own.sin_port);
  }
  ~VrpnServer() {
    hang_up();
    close(listener_);
  }
  uint16_t port() const { return port_; }
  /// Waits for a client and its cookie; false when none comes.
  bool accept_client() {
    constexpr int kMostMs = 20'000;
    pollfd waiting{listener_, POLLIN, 0};
    if (poll(&waiting, 1, kMostMs) != 1) return false;
    client_ = accept(listener_, nullptr, nullptr);
    std::array<char, 24> cookie{};
    size_t got = 0;
    pollfd reading{client_, POLLIN, 0};
    while (got < cookie.size() && poll(&reading, 1, kMostMs) == 1) {
      const ssize_t size = recv(client_, cookie.data() + got, cookie.size() - got, 0);
      if (size <= 0) return false;
      got += static_cast<size_t>(size);
    }
    return std::string_view(cookie.data(), 14) == "vrpn: ver. 07.";
  }
  /// In pieces, as networks deliver.
  void send(const test::PacketBytes& bytes, size_t piece = 7) {
    for (size_t at = 0; at < bytes.size(); at += piece)
      (void)::send(client_, bytes.data() + at, std::min(piece, bytes.size() - at), MSG_NOSIGNAL);
  }
  void hang_up() {
    if (client_ >= 0) close(client_);
    client_ = -1;
  }

 private:
  int listener_;
  int client_ = -1;
  uint16_t port_ = 0;
};

test::PacketBytes tracked(double time_s, double height_m) {
  return test::vrpn_pose(time_s, 0, 3, 0, {0, height_m, 0}, {0, 0, 0, 1});
}

TEST_F(LiveManagers, AServerOfVrpnIsAskedAndAskedAgain) {
  test::LogCapture log;
  VrpnServer server;
  if (!open({.protocol = "vrpn", .host = "127.0.0.1", .port = server.port()})) return;
  double time_s = 100.0;
  for (const double height_m : {1.5, 1.7}) {
    ASSERT_TRUE(server.accept_client());
    server.send(test::vrpn_begin("Tracker0"));
    EXPECT_TRUE(eventually([&] {
      server.send(tracked(time_s += 0.004, height_m));
      std::this_thread::sleep_for(std::chrono::milliseconds(4));
      return is_head_at({0.0, height_m, 0.0});
    }));
    EXPECT_THAT(status().subject, testing::StartsWith("Tracker0"));
    server.hang_up();
  }
  // What is no VRPN ends a connection, and is tried again.
  ASSERT_TRUE(server.accept_client());
  server.send(test::PacketBytes(64, std::byte{'x'}));
  EXPECT_TRUE(eventually([&] { return status().malformed > 0; }));
  server.hang_up();
  EXPECT_TRUE(server.accept_client());
  EXPECT_GE(log.count("connected"), 3u);
}

TEST_F(LiveManagers, AServerThatIsNotThereIsWaitedForAndToldOnce) {
  test::LogCapture log;
  uint16_t port = 0;
  {
    const VrpnServer gone;
    port = gone.port();
  }
  if (!open({.protocol = "vrpn", .host = "127.0.0.1", .port = port})) return;
  EXPECT_TRUE(eventually([&] { return log.count("tried again every 0.5 s") > 0; }));
  EXPECT_TRUE(status().is_stale);
}

TEST_F(LiveManagers, MotiveIsAskedAndAloneMayAnswer) {
  test::LogCapture log;
  // An address of its own, for the port where it is asked is everybody's.
  const char* kMotive = "127.0.0.9";
  constexpr uint16_t kCommandPort = 1510;
  const uint16_t port = test::free_udp_port();
  UdpSocket motive(kMotive, kCommandPort);
  if (!open({.protocol = "natnet", .host = kMotive, .port = port})) return;
  // It is greeted, and asked for names.
  EXPECT_TRUE(motive.is_sent_something());
  test::NatnetPacket packet;
  packet.bodies = {{.id = 7, .position_m = {0.5f, 1.25f, 0.0f}, .rotation = {0, 0, 0, 1}}};
  UdpSocket stranger("127.0.0.8");
  EXPECT_TRUE(eventually([&] {
    ++packet.frame;
    packet.time_s += 0.004;
    motive.send(test::natnet(packet), port);
    stranger.send(test::natnet(packet), port);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at({0.5, 1.25, 0.0}) && status().refused > 3;
  }));
  EXPECT_EQ(status().sender, motive.name());
  EXPECT_GT(told_, 0u);
  EXPECT_EQ(log.count("127.0.0.9 alone was asked"), 1u) << "once, however often";
}

TEST_F(LiveManagers, WhatIsMalformedHidesNothingElseAndIsSummedUp) {
  test::LogCapture log;
  const uint16_t port = test::free_udp_port();
  if (!open({.protocol = "opentrack", .port = port})) return;
  UdpSocket broken, tracker;
  for (uint64_t sent = 1; sent <= 100; ++sent) {
    broken.send(test::PacketBytes(5), port);
    ASSERT_TRUE(eventually([&] { return status().malformed == sent; }));
  }
  EXPECT_TRUE(eventually([&] {
    tracker.send(test::opentrack({10, 0, 0, 0, 0, 0}), port);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at({0.1, 0.0, 0.0});
  }));
  EXPECT_EQ(log.count(tracker.name() + " sends"), 1u);
  EXPECT_EQ(log.count("malformed packet"), 4u);
  (void)manager_->on_tick(now_ns() + 10 * kSInNs);
  EXPECT_EQ(log.count("malformed packet"), 5u);
  EXPECT_EQ(log.count("(96 more like it)"), 1u);
}

TEST_F(LiveManagers, WhoIsNotAllowedIsNotRead) {
  // This machine's own address in the network counts as a stranger's.
  const std::string address = test::own_network_address();
  if (address.empty()) GTEST_SKIP() << "needs an address beside loopback's";
  test::LogCapture log;
  const uint16_t port = test::free_udp_port();
  const AddressRange elsewhere{*IpAddress::parse("198.51.100.7"), 128};
  if (!open({.protocol = "opentrack", .port = port}, {elsewhere})) return;
  UdpSocket stranger(address.c_str()), here;
  EXPECT_TRUE(eventually([&] {
    stranger.send(test::opentrack({70, 0, 0, 0, 0, 0}), port, address.c_str());
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return status().refused > 3;
  }));
  EXPECT_EQ(status().packets, 0u);
  EXPECT_GE(log.count("--mocap-allow " + address), 1u);
  EXPECT_TRUE(eventually([&] {
    here.send(test::opentrack({10, 0, 0, 0, 0, 0}), port);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at({0.1, 0.0, 0.0});
  })) << "this machine always may";
}

TEST_F(LiveManagers, WhoIsAllowedIsHeard) {
  const std::string address = test::own_network_address();
  if (address.empty()) GTEST_SKIP() << "needs an address beside loopback's";
  const uint16_t port = test::free_udp_port();
  if (!open({.protocol = "opentrack", .port = port}, {{*IpAddress::parse(address), 128}})) return;
  UdpSocket stage(address.c_str());
  EXPECT_TRUE(eventually([&] {
    stage.send(test::opentrack({20, 0, 0, 0, 0, 0}), port, address.c_str());
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at({0.2, 0.0, 0.0});
  }));
  EXPECT_EQ(status().sender, stage.name());
}

TEST_F(LiveManagers, LoopbackAloneIsListenedToWhereNothingElseIsAllowed) {
  const std::string address = test::own_network_address();
  if (address.empty()) GTEST_SKIP() << "needs an address beside loopback's";
  const uint16_t port = test::free_udp_port();
  if (!open({.protocol = "opentrack", .port = port})) return;
  UdpSocket stage(address.c_str()), here;
  for (int i = 0; i < 20; ++i) stage.send(test::opentrack({20, 0, 0, 0, 0, 0}), port, address.c_str());
  EXPECT_TRUE(eventually([&] {
    here.send(test::opentrack({10, 0, 0, 0, 0, 0}), port);
    std::this_thread::sleep_for(std::chrono::milliseconds(4));
    return is_head_at({0.1, 0.0, 0.0});
  }));
  EXPECT_EQ(status().refused, 0u) << "it does not even come in";
  EXPECT_EQ(status().sender, here.name());
}

}  // namespace
}  // namespace strandcast::live_manager_test
