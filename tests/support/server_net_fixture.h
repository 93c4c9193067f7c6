// A NetServer with a made-up application behind it, for tests with raw clients.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/net/net_server.h"
#include "tests/support/eventually.h"
#include "tests/support/raw_client.h"

namespace strandcast::test {

inline uint16_t code(CloseCode close_code) {
  return static_cast<uint16_t>(close_code);
}

inline EncodedFramePtr media(Opcode opcode, uint32_t sequence, uint32_t base_sequence,
                             size_t payload_bytes = 64, uint16_t stream_id = 0) {
  FrameHeader header;
  header.opcode = opcode;
  header.stream_id = stream_id;
  header.sequence = sequence;
  header.base_sequence = base_sequence;
  return make_encoded_frame(header, std::vector<std::byte>(payload_bytes, std::byte{0x5a}));
}

inline constexpr const char* kToken = "0123456789abcdef";
/// Needs that token, and treats loopback like any other address, which the limits per address are for.
inline NetConfig strict_config() {
  NetConfig config;
  config.tokens = {{kToken, Grant::AllButAdmin}};
  config.loopback_trust = LoopbackTrust::LikeAllOthers;
  config.limits.connections_per_s = 1e6;
  return config;
}

/// A chain of strand frames like an encoder's; also the handler that counts what reached the application.
class FakeApp : public NetHandler {
 public:
  Result<Admission> on_hello(const Visitor& visitor, const Hello& hello) override {
    if (hello.name == "throw") throw std::runtime_error("handler failed on purpose");
    if (hello.name == "refuse") return make_error(ErrorCode::BadInput, "Refused on purpose.");
    ++hellos;
    if (hello.name == "no place" || (hello.name == "later" && hellos < 4))
      return make_error(ErrorCode::Unavailable, "No place on purpose.");
    const std::lock_guard lock(mutex_);
    joined_.insert(visitor.session);
    Admission admission;
    admission.welcome.session_id = "0123456789abcdef";
    admission.welcome.scene_name = "fake";
    admission.welcome.codec = "delta";
    visitor.subscription.start_with(hello.mode);
    visitor.subscription.strands.codec = strand_codec;
    admission.welcome.strand_count = 1;
    admission.welcome.vertex_count = 16;
    admission.welcome.bound_m = 1e-4f;
    admission.asset = media(Opcode::Asset, 1, 0, asset_bytes);
    admission.preview = preview;
    return admission;
  }
  void on_message(SessionId session, const ClientMessage& message, int64_t) override {
    std::visit(Overloaded{[&](const MotionSamples& samples) { motion += samples.samples.size(); },
                          [&](const WindSamples& samples) { wind += samples.samples.size(); },
                          [&](const ControlCommand&) {
                            ++commands;
                            server->send(session, Notice{false, "done"});
                          },
                          [&](const SetParameter&) { ++parameters; }, [&](const CameraChange&) { ++cameras; },
                          [&](const AdminCommand&) { ++shut_downs; }, [](const auto&) {}},
               message);
  }
  Status readiness() override {
    if (is_stepping) return {};
    return make_error(ErrorCode::Unavailable, "Stuck on purpose.");
  }
  void on_need(SessionId, const StreamNeed& need) override {
    if (need.kind == StreamNeed::Kind::Picture) return;
    const uint16_t stream_id = need.stream_id;
    const std::lock_guard lock(mutex_);
    ++keyframe_requests;
    if (sequence_ > 0)
      server->publish_strands(media(Opcode::StrandKeyframe, sequence_, 0, frame_bytes, stream_id));
  }
  void on_left(SessionId session) override {
    const std::lock_guard lock(mutex_);
    left_twice = left_twice || joined_.count(session) == 0;
    joined_.erase(session);
  }

  void publish_next(uint16_t stream_id = 0) {
    const std::lock_guard lock(mutex_);
    ++sequence_;
    server->publish_strands(
        sequence_ == 1 ? media(Opcode::StrandKeyframe, 1, 0, frame_bytes, stream_id)
                       : media(Opcode::StrandDelta, sequence_, sequence_ - 1, frame_bytes, stream_id));
  }
  uint32_t sequence() const {
    const std::lock_guard lock(mutex_);
    return sequence_;
  }
  size_t joined_count() const {
    const std::lock_guard lock(mutex_);
    return joined_.size();
  }

  NetServer* server = nullptr;
  size_t frame_bytes = 256;
  size_t asset_bytes = 1'000;
  size_t strand_codec = 0;  // of who joins
  std::optional<Admission::Preview> preview;
  std::atomic<uint64_t> hellos{0}, motion{0}, wind{0}, commands{0}, parameters{0}, cameras{0},
      keyframe_requests{0}, shut_downs{0};
  std::atomic<bool> left_twice{false}, is_stepping{true};

 private:
  mutable std::mutex mutex_;
  std::set<SessionId> joined_;
  uint32_t sequence_ = 0;
};

class ServerNet : public testing::Test {
 protected:
  /// With one head, of the app's.
  void start(NetConfig config = {}, NetHead head = {}) {
    config.port = 0;
    head.handler = &app_;
    auto server = NetServer::listen(config, std::vector<NetHead>{head});
    ASSERT_TRUE(server.ok()) << server.error().to_string();
    server_ = std::move(*server);
    app_.server = server_.get();
    server_->start();
  }
  void TearDown() override {
    if (server_ != nullptr) server_->stop();
    EXPECT_EQ(app_.joined_count(), 0u) << "every session that joined must leave";
    EXPECT_FALSE(app_.left_twice);
  }

  static Hello hello(Role role = Role::Viewer, const std::string& token = {}) {
    Hello message;
    message.role = role;
    message.name = "test";
    message.token = token;
    return message;
  }
  /// A client that is past Welcome.
  std::unique_ptr<RawClient> join(const Hello& message = hello(), int receive_buffer_bytes = 0) {
    auto client = std::make_unique<RawClient>(server_->port(), receive_buffer_bytes);
    EXPECT_TRUE(client->handshake());
    client->send(message);
    EXPECT_TRUE(client->read_control<Welcome>().has_value());
    return client;
  }

  FakeApp app_;
  std::unique_ptr<NetServer> server_;
};

}  // namespace strandcast::test
