// NetServer against raw clients that behave and misbehave: joining, overload, refusals and the end of the
// server.
#include "server/net/net_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "common/base/base64.h"
#include "common/base/profile.h"
#include "tests/support/metrics_text.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_net_test {
namespace {

using test::code;
using test::FakeApp;
using test::media;
using test::RawClient;
using test::ServerNet;

TEST_F(ServerNet, ServesHealthMetricsAndNothingElse) {
  start();
  EXPECT_NE(test::http_get(server_->port(), "/healthz").find("200 OK"), std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/metrics").find("strandcast_net_connections_total"),
            std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/s/anna/healthz").find("200 OK"), std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/").find("404"), std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/../etc/passwd").find("404"), std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/healthz", "evil.example").find("403"), std::string::npos);
}

TEST_F(ServerNet, AnswersHeadAsGetWithoutTheText) {
  start();
  const auto ask = [&](const std::string& method, const std::string& path) {
    RawClient client(server_->port());
    client.send_raw(method + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    const std::string answer = client.read_raw_to_end();
    const size_t end = answer.find("\r\n\r\n");
    return std::pair(answer.substr(0, end), answer.substr(end + 4));
  };
  for (const std::string path : {"/healthz", "/readyz"}) {
    const auto [get_header, get_text] = ask("GET", path);
    const auto [head_header, head_text] = ask("HEAD", path);
    EXPECT_EQ(head_header, get_header);
    EXPECT_NE(get_text, "");
    EXPECT_EQ(head_text, "");
  }
  const auto [header, text] = ask("HEAD", "/metrics");
  EXPECT_NE(header.find("200 OK"), std::string::npos);
  EXPECT_EQ(text, "");
}

TEST_F(ServerNet, MetricsFollowTheirFormat) {
  start();
  const auto viewer = join();
  const std::string answer = test::http_get(server_->port(), "/metrics");
  const std::string text = answer.substr(answer.find("\r\n\r\n") + 4);
  EXPECT_THAT(test::metric_faults(text), testing::IsEmpty());
  std::vector<std::string> faults;
  EXPECT_EQ(test::read_metrics(text, faults)["strandcast_net_joined_sessions"].samples[0].second, 1.0);
}

TEST_F(ServerNet, AliveIsNotReady) {
  start();
  EXPECT_NE(test::http_get(server_->port(), "/readyz").find("200 OK"), std::string::npos);
  app_.is_stepping = false;
  const std::string answer = test::http_get(server_->port(), "/readyz");
  EXPECT_NE(answer.find(" 503 "), std::string::npos);
  EXPECT_NE(answer.find("Stuck on purpose."), std::string::npos);
  EXPECT_NE(test::http_get(server_->port(), "/healthz").find("200 OK"), std::string::npos);
}

TEST_F(ServerNet, RefusesLongHeaders) {
  start();
  EXPECT_NE(test::http_get(server_->port(), "/" + std::string(20'000, 'a')).find(" 431 "), std::string::npos);
  RawClient client(server_->port());
  client.send_raw("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + std::string(1 << 20, 'x'));
  EXPECT_NE(client.read_raw_to_end().find(" 431 "), std::string::npos) << "without an end";
  EXPECT_NE(test::http_get(server_->port(), "/healthz").find("200 OK"), std::string::npos);
}

// Whatever is behind the header is not read, so that nothing of it can make the server hold anything.
TEST_F(ServerNet, BodiesAreRefusedUnread) {
  NetConfig config;
  config.limits.handshake_ms = 60'000;
  start(config);
  const std::string chunked = "Transfer-Encoding: chunked\r\n\r\n";
  const std::string much(4 << 20, '0');
  const std::string cases[] = {"Content-Length: 5\r\n\r\nhello",
                               "Content-Length: 5\r\n\r\n",
                               "Content-Length: 18446744073709551615\r\n\r\n" + much,
                               "Transfer-Encoding: identity\r\n\r\n",
                               chunked,
                               chunked + much,
                               chunked + "1;" + much,
                               chunked + "0\r\nX: " + much,
                               chunked + "0\r\nX: " + std::string(70'000, 'x') + "\r\n\r\n"};
  for (const std::string& rest : cases)
    for (const char* line : {"GET /healthz", "POST /healthz", "GET /v1"}) {
      RawClient client(server_->port());
      client.send_raw(line + std::string(" HTTP/1.1\r\nHost: 127.0.0.1\r\n") + rest);
      const std::string answer = client.read_raw_to_end();
      EXPECT_TRUE(answer.starts_with("HTTP/1.1 413 ")) << line << " " << rest.substr(0, 40) << ": " << answer;
      EXPECT_NE(answer.find("without a body"), std::string::npos);
    }
  EXPECT_EQ(server_->counters().refused_http, 3 * std::size(cases));
  RawClient empty(server_->port());
  empty.send_raw("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n");
  EXPECT_NE(empty.read_raw_to_end().find("200 OK"), std::string::npos) << "a body of no bytes is none";
}

// Two readers could take one each for true.
TEST_F(ServerNet, FieldsThatDecideStandOnce) {
  start();
  const std::string upgrade =
      "GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Protocol: strandcast.v1\r\n";
  for (const char* field :
       {"Host: 127.0.0.1", "host: evil.example", "Origin: http://127.0.0.1\r\nOrigin: http://127.0.0.1",
        "Origin: http://127.0.0.1\r\nOrigin: http://evil.example",
        "Authorization: Bearer a\r\nAuthorization: Bearer b",
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Strandcast-Hello: QQ==\r\nStrandcast-Hello: QQ=="}) {
    RawClient client(server_->port());
    client.send_raw(upgrade + field + "\r\n\r\n");
    EXPECT_TRUE(client.read_raw_to_end().starts_with("HTTP/1.1 400 ")) << field;
  }
  EXPECT_EQ(server_->counters().open_sessions, 0u);
}

TEST_F(ServerNet, AKeyOfAWebSocketIsSixteenBytes) {
  start();
  const auto ask = [&](const std::string& key) {
    RawClient client(server_->port());
    client.send_raw(
        "GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: strandcast.v1\r\nSec-WebSocket-Key: " +
        key + "\r\n\r\n");
    return client.read_answer();
  };
  EXPECT_TRUE(ask("dGhlIHNhbXBsZSBub25jZQ==").starts_with("HTTP/1.1 101 "));
  for (const char* key : {"", "x", "dGhlIHNhbXBsZSBub25jZQ=", "dGhlIHNhbXBsZSBub25jZQ===",
                          "dGhlIHNhbXBsZSBub25j!Q==", "dGhlIHNhbXBsZSBub25jZWUg"})
    EXPECT_TRUE(ask(key).starts_with("HTTP/1.1 400 ")) << key;
}

/// A message as a client's WebSocket frame, masked with zeros.
std::string frame_of(const std::vector<std::byte>& message) {
  constexpr uint8_t kFinalBinary = 0x82, kMasked = 0x80, kSixteenBits = 126, kSixtyFourBits = 127;
  std::string frame(1, static_cast<char>(kFinalBinary));
  const size_t size = message.size();
  const int length_bytes = size < kSixteenBits ? 0 : size <= UINT16_MAX ? 2 : 8;
  frame += static_cast<char>(kMasked | (length_bytes == 0   ? static_cast<uint8_t>(size)
                                        : length_bytes == 2 ? kSixteenBits
                                                            : kSixtyFourBits));
  for (int i = length_bytes - 1; i >= 0; --i) frame += static_cast<char>(size >> (8 * i));
  return frame + std::string(4, '\0') + std::string(reinterpret_cast<const char*>(message.data()), size);
}

// A client that knows this server need not wait for the answer to its upgrade.
TEST_F(ServerNet, AHelloRightBehindTheUpgradeIsRead) {
  start();
  const std::string upgrade =
      "GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Protocol: strandcast.v1\r\n\r\n";
  const MotionSamples::Sample sample{1, {{1.0, 2.0, 3.0}, {0.5, 0.5, 0.5, 0.5}}};
  const std::vector<std::byte> longest =
      encode(ClientMessage(MotionSamples{std::vector<MotionSamples::Sample>(256, sample)}));
  const std::string all = upgrade + frame_of(encode(ClientMessage(hello(Role::Source)))) + frame_of(longest) +
                          frame_of(longest) + frame_of(encode(ClientMessage(Ping{1})));
  ASSERT_GT(all.size(), 8'192u) << "more than the header may have";
  // In one piece, and in two that part within the Hello, right behind the header and right before its end.
  uint64_t sessions = 0;
  for (const size_t first : {all.size(), upgrade.size() + 3, upgrade.size(), upgrade.size() - 1}) {
    RawClient client(server_->port());
    client.send_raw(all.substr(0, first));
    give_time_to_misbehave();  // so that the pieces arrive one by one
    client.send_raw(all.substr(first));
    ++sessions;
    EXPECT_TRUE(eventually([&] { return server_->counters().messages_received == 4 * sessions; })) << first;
    EXPECT_EQ(app_.motion, 512 * sessions);
  }
}

// It saves a round trip.
TEST_F(ServerNet, AHelloInTheRequestIsTaken) {
  start();
  RawClient early(server_->port());
  ASSERT_TRUE(
      early.handshake({.host = {}, .origin = {}, .hello = base64_of(encode(ClientMessage(hello())))}));
  EXPECT_TRUE(early.read_control<Welcome>().has_value()) << "no message was needed";
  EXPECT_EQ(server_->counters().messages_received, 1u);
  early.send(hello());
  EXPECT_EQ(early.read_end().close_code, code(CloseCode::Policy)) << "a second one is one too many";

  RawClient other(server_->port());
  ASSERT_TRUE(
      other.handshake({.host = {}, .origin = {}, .hello = base64_of(encode(ClientMessage(Ping{1})))}));
  EXPECT_EQ(other.read_end().close_code, code(CloseCode::Policy)) << "the first message must be Hello";
  std::vector<std::byte> cut = encode(ClientMessage(hello()));
  cut.pop_back();
  RawClient broken(server_->port());
  ASSERT_TRUE(broken.handshake({.host = {}, .origin = {}, .hello = base64_of(cut)}));
  EXPECT_EQ(broken.read_end().close_code, code(CloseCode::BadData));

  // What is no base64 is nothing; the answer says so.
  const auto answer_to = [&](const std::string& greeting) {
    RawClient client(server_->port());
    client.send_raw(
        "GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Protocol: strandcast.v1\r\nStrandcast-Hello: " +
        greeting + "\r\n\r\n");
    return client.read_answer();
  };
  EXPECT_THAT(answer_to(base64_of(encode(ClientMessage(hello())))),
              testing::HasSubstr("Strandcast-Hello: taken"));
  for (const char* greeting : {"", "x", "QQ=", "Q!=="})
    EXPECT_THAT(answer_to(greeting), testing::Not(testing::HasSubstr("Strandcast-Hello"))) << greeting;
  RawClient late(server_->port());
  ASSERT_TRUE(late.handshake({.host = {}, .origin = {}, .hello = "Q!=="}));
  late.send(hello());
  EXPECT_TRUE(late.read_control<Welcome>().has_value());
}

TEST_F(ServerNet, HandshakeNeedsPathProtocolHostAndOrigin) {
  start();
  const uint16_t port = server_->port();
  EXPECT_TRUE(RawClient(port).handshake());
  EXPECT_FALSE(RawClient(port).handshake({.path = "/v2", .host = {}, .origin = {}}));
  EXPECT_TRUE(RawClient(port).handshake({.path = "/s/anna/v1", .host = {}, .origin = {}}))
      << "a session behind a proxy has a folder of its own";
  EXPECT_FALSE(RawClient(port).handshake({.path = "/s/../v1", .host = {}, .origin = {}}));
  EXPECT_FALSE(RawClient(port).handshake({.path = "/s//v1", .host = {}, .origin = {}}));
  EXPECT_FALSE(RawClient(port).handshake({.path = "/v1", .host = {}, .origin = {}, .protocol = "other.v1"}));
  EXPECT_FALSE(RawClient(port).handshake({.path = "/v1", .host = "evil.example", .origin = {}}));
  EXPECT_FALSE(RawClient(port).handshake({.path = "/v1", .host = {}, .origin = "http://evil.example"}));
  EXPECT_TRUE(RawClient(port).handshake({.path = "/v1", .host = "localhost", .origin = "http://localhost"}));
}

TEST_F(ServerNet, JoinOrderIsWelcomeAssetKeyframeDeltas) {
  app_.asset_bytes = 3'000'000;  // takes many writes, while deltas are published all the time
  start();
  for (int i = 0; i < 5; ++i) app_.publish_next();
  RawClient client(server_->port());
  ASSERT_TRUE(client.handshake());
  client.send(hello());
  std::vector<Opcode> order;
  uint32_t last_sequence = 0;
  while (order.size() < 20) {
    app_.publish_next();
    const test::Received received = client.read();
    ASSERT_FALSE(received.is_end) << "closed with " << received.close_code;
    order.push_back(received.opcode());
    if (received.opcode() == Opcode::Control) continue;
    const auto header = unpack_frame_header(received.bytes);
    ASSERT_TRUE(header.ok()) << header.error().to_string();
    if (header->opcode == Opcode::StrandDelta) {
      EXPECT_EQ(header->base_sequence, last_sequence);
    }
    if (header->opcode != Opcode::Asset) last_sequence = header->sequence;
  }
  EXPECT_EQ(order[0], Opcode::Control);
  EXPECT_EQ(order[1], Opcode::Asset);
  EXPECT_EQ(order[2], Opcode::StrandKeyframe);
}

TEST_F(ServerNet, WhoWantsNoStreamIsHeardAndGetsNone) {
  start();
  for (int i = 0; i < 5; ++i) app_.publish_next();
  RawClient client(server_->port());
  ASSERT_TRUE(client.handshake());
  Hello quiet = hello(Role::Controller);
  quiet.gets_no_stream = true;
  client.send(quiet);
  ASSERT_TRUE(client.read_control<Welcome>().has_value());
  const uint64_t asked = app_.keyframe_requests;
  client.send(KeyframeRequest{});
  client.send(ModeRequest{StreamMode::Frames});
  // What would be media stands before the answer.
  client.send(ControlCommand{Command::Pause});
  for (bool is_answered = false; !is_answered;) {
    app_.publish_next();
    const test::Received received = client.read();
    ASSERT_FALSE(received.is_end) << "closed with " << received.close_code;
    ASSERT_EQ(received.opcode(), Opcode::Control);
    const auto message = decode_server_message(received.bytes);
    ASSERT_TRUE(message) << message.error().to_string();
    is_answered = std::holds_alternative<Notice>(*message);
  }
  EXPECT_EQ(app_.keyframe_requests, asked) << "it costs the others nothing";
}

TEST_F(ServerNet, RolesReachTheirHandlersAndPingIsAnswered) {
  start();
  app_.publish_next();
  auto source = join(hello(Role::Source));
  source->send(MotionSamples{{MotionSamples::Sample{1, Pose{}}, MotionSamples::Sample{2, Pose{}}}});
  source->send(WindSamples{{WindSamples::Sample{1, glm::vec3(1.0f)}}});
  EXPECT_TRUE(eventually([&] { return app_.motion == 2 && app_.wind == 1; }));

  auto controller = join(hello(Role::Controller));
  controller->send(ControlCommand{Command::Pause});
  EXPECT_TRUE(controller->read_control<Notice>().has_value());
  controller->send(SetParameter{"solver.name=dftl"});
  controller->send(CameraChange{});
  controller->send(FrameAck{7, 1, 1});
  EXPECT_TRUE(eventually([&] { return app_.parameters == 1 && app_.cameras == 1; }));

  controller->send(Ping{42});
  const auto pong = controller->read_control<Pong>();
  ASSERT_TRUE(pong.has_value());
  EXPECT_EQ(pong->client_time_ns, 42);
  EXPECT_LE(pong->server_receive_ns, pong->server_send_ns);
}

TEST_F(ServerNet, GarbageAtEveryStateClosesThatSessionOnly) {
  start();
  app_.publish_next();
  auto healthy = join();
  const std::vector<std::byte> garbage(100, std::byte{0xff});

  RawClient at_http(server_->port());
  at_http.send_raw(std::string("\x16\x03\x01 not http at all\r\n\r\n"));
  EXPECT_EQ(at_http.read_raw_to_end().find("200"), std::string::npos);

  RawClient before_hello(server_->port());
  ASSERT_TRUE(before_hello.handshake());
  before_hello.send_bytes(garbage);
  RawClient::End end = before_hello.read_end();
  EXPECT_EQ(end.close_code, code(CloseCode::BadData));
  EXPECT_FALSE(end.reason.empty());

  RawClient other_first(server_->port());
  ASSERT_TRUE(other_first.handshake());
  other_first.send(Ping{1});
  EXPECT_EQ(other_first.read_end().close_code, code(CloseCode::Policy));

  auto joined = join();
  joined->send_bytes(garbage);
  EXPECT_EQ(joined->read_end().close_code, code(CloseCode::BadData));

  auto texting = join();
  texting->send_text("hello");
  EXPECT_EQ(texting->read_end().close_code, code(CloseCode::BadData));

  auto broken_frame = join();
  broken_frame->send_raw(std::string(64, '\xff'));
  (void)broken_frame->read_end();

  healthy->send(Ping{1});
  EXPECT_TRUE(healthy->read_control<Pong>().has_value());
  EXPECT_GE(server_->counters().bad_messages, 5u);
}

// Section 10 of WIRE.md: a later version of the protocol may have kinds of messages that this one lacks.
TEST_F(ServerNet, UnknownKindsAreIgnoredAndCounted) {
  NetConfig config;
  config.limits.messages_per_s = 20.0;
  start(config);
  const std::vector<std::byte> newer = {std::byte{0x01}, std::byte{0xc2}, std::byte{0x3e}, std::byte{0x01},
                                        std::byte{0x78}};  // field 1000, one byte
  RawClient client(server_->port());
  ASSERT_TRUE(client.handshake());
  client.send_bytes(newer);
  client.send(hello());
  ASSERT_TRUE(client.read_control<Welcome>());
  client.send_bytes(newer);
  client.send(Ping{1});
  EXPECT_TRUE(client.read_control<Pong>());
  EXPECT_EQ(server_->counters().unknown_messages, 2u);
  EXPECT_EQ(server_->counters().bad_messages, 0u);
  for (int i = 0; i < 200; ++i) client.send_bytes(newer);
  EXPECT_EQ(client.read_end().close_code, code(CloseCode::Policy)) << "they count for the rate";
}

TEST_F(ServerNet, OneByteTooMuchIsTooBig) {
  start();
  auto client = join();
  client->send_bytes(std::vector<std::byte>(kMaxControlBytes + 1, std::byte{1}));
  EXPECT_EQ(client->read_end().close_code, code(CloseCode::TooBig));
}

TEST_F(ServerNet, HandlerErrorsAndExceptionsEndOneSession) {
  start();
  app_.publish_next();
  auto healthy = join();
  const std::vector<std::pair<std::string, CloseCode>> cases = {
      {"throw", CloseCode::Internal}, {"refuse", CloseCode::Policy}, {"no place", CloseCode::TryLater}};
  for (const auto& [name, expected] : cases) {
    RawClient client(server_->port());
    ASSERT_TRUE(client.handshake());
    Hello message = hello();
    message.name = name;
    client.send(message);
    const RawClient::End end = client.read_end();
    EXPECT_EQ(end.close_code, code(expected)) << name;
    EXPECT_FALSE(end.reason.empty());
  }
  healthy->send(Ping{1});
  EXPECT_TRUE(healthy->read_control<Pong>().has_value());
}

TEST_F(ServerNet, FullServerSaysSoAndHasRoomAgainLater) {
  NetConfig config;
  config.limits.sessions = 3;
  config.limits.sessions_per_address = 2;
  start(config);
  auto first = join();
  auto second = join();
  RawClient third(server_->port());
  ASSERT_TRUE(third.handshake());
  const RawClient::End end = third.read_end();
  EXPECT_EQ(end.close_code, code(CloseCode::Full));
  EXPECT_NE(end.reason.find("full"), std::string::npos);
  EXPECT_EQ(server_->counters().refused_full, 1u);
  first->close();
  EXPECT_TRUE(eventually([&] { return server_->counters().joined_sessions == 1; }));
  EXPECT_NE(join(), nullptr);
}

// Its link died without a word, and it comes back by a new one.
TEST_F(ServerNet, WhoAnswersNoPingGivesItsPlaceToANewcomer) {
  NetConfig config;
  config.limits.sessions_per_address = 2;
  start(config);
  Hello commanding;
  commanding.gets_no_stream = true;
  commanding.role = Role::Controller;
  auto dead = join(commanding);
  auto living = join();
  const auto asks = [&] {
    living->send(Ping{1});
    return living->read_control<Pong>().has_value();  // and answers the server's pings meanwhile
  };
  RawClient early(server_->port());
  ASSERT_TRUE(early.handshake());
  EXPECT_EQ(early.read_end().close_code, code(CloseCode::Full)) << "nobody is doubted yet";
  EXPECT_TRUE(eventually([&] {
    EXPECT_TRUE(asks());
    RawClient newcomer(server_->port());
    if (!newcomer.handshake()) return false;
    newcomer.send(Hello{});
    return newcomer.read_control<Welcome>().has_value();
  }));
  EXPECT_TRUE(asks()) << "who answers keeps its place";
  EXPECT_EQ(dead->read_end().close_code, 0);
  EXPECT_EQ(server_->counters().stalled, 1u);
}

TEST_F(ServerNet, SilentConnectionsAreEndedInTime) {
  NetConfig config;
  config.limits.handshake_ms = 200;
  start(config);
  RawClient nothing(server_->port());
  RawClient half(server_->port());
  half.send_raw("GET /v1 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: webso");
  RawClient no_hello(server_->port());
  ASSERT_TRUE(no_hello.handshake());
  EXPECT_EQ(nothing.read_raw_to_end(), "");
  EXPECT_EQ(half.read_raw_to_end(), "");
  EXPECT_EQ(no_hello.read_end().close_code, code(CloseCode::Policy));
  EXPECT_TRUE(eventually([&] { return server_->counters().timeouts == 3; }));
}

TEST_F(ServerNet, ResetAtEveryStateLeavesNothingBehind) {
  start();
  app_.publish_next();
  for (int state = 0; state < 5; ++state) {
    for (int repeat = 0; repeat < 5; ++repeat) {
      RawClient client(server_->port());
      if (state == 1) client.send_raw("GET /v1 HTT");
      if (state >= 2) {
        ASSERT_TRUE(client.handshake());
      }
      if (state >= 3) client.send(hello());
      if (state >= 4) {
        EXPECT_TRUE(client.read_media(Opcode::StrandKeyframe).has_value());
      }
      client.reset();
    }
  }
  EXPECT_TRUE(eventually([&] { return server_->counters().open_sessions == 0 && app_.joined_count() == 0; }));
  EXPECT_NE(join(), nullptr);
}

TEST_F(ServerNet, SlowReaderSkipsToKeyframesAndOthersGetEveryDelta) {
  app_.frame_bytes = 200'000;
  start();
  app_.publish_next();
  auto healthy = join();
  ASSERT_TRUE(healthy->read_media(Opcode::StrandKeyframe).has_value());
  auto slow = join(hello(), 4'096);
  ASSERT_TRUE(slow->read_media(Opcode::StrandKeyframe).has_value());

  const uint32_t first = app_.sequence() + 1;
  constexpr uint32_t kFrames = 60;
  for (uint32_t i = 0; i < kFrames; ++i) {
    app_.publish_next();
    const auto bytes = healthy->read_media(Opcode::StrandDelta);
    ASSERT_TRUE(bytes.has_value());
    EXPECT_EQ(unpack_frame_header(*bytes)->sequence, first + i) << "a healthy viewer misses nothing";
  }
  EXPECT_TRUE(eventually([&] { return server_->counters().frames_dropped > 0; }));
  EXPECT_GE(server_->counters().chain_losses, 1u);

  // It reads again: what comes is decodable, and it is led back by a keyframe.
  uint32_t last_sequence = 1;
  bool has_keyframe = false;
  while (!has_keyframe) {
    const test::Received received = slow->read();
    ASSERT_FALSE(received.is_end) << received.close_code;
    if (received.opcode() == Opcode::Control) continue;
    const FrameHeader header = *unpack_frame_header(received.bytes);
    has_keyframe = header.opcode == Opcode::StrandKeyframe;
    if (!has_keyframe) {
      EXPECT_EQ(header.base_sequence, last_sequence);
    }
    last_sequence = header.sequence;
  }
  EXPECT_GT(last_sequence, first);
  slow->send(Ping{1});
  EXPECT_TRUE(slow->read_control<Pong>().has_value());

  // Each is told what it missed, and the metrics tell of all.
  server_->broadcast(ServerStatus{});
  const auto told_slow = slow->read_control<ServerStatus>(),
             told_healthy = healthy->read_control<ServerStatus>();
  ASSERT_TRUE(told_slow && told_healthy);
  EXPECT_GT(told_slow->dropped_frames, 0u);
  EXPECT_EQ(told_healthy->dropped_frames, 0u);
  EXPECT_EQ(server_->counters().frames_dropped, told_slow->dropped_frames);
}

// By either codec: each has all classes, in streams of its own.
TEST_F(ServerNet, AViewerThatCostsMoreThanTheCapGetsAClassThatFits) {
  for (const size_t codec : {0, 1}) {
    // The asset shows that the link carries far more than the frames take.
    app_.asset_bytes = 4'000'000;
    app_.frame_bytes = 1'000;
    app_.strand_codec = codec;
    const uint16_t stream_id = stream_id_of({codec, 0});
    NetConfig config;
    StrandClass cheaper;
    cheaper.strand_share = 0.25f;
    NetHead head;
    head.strand_classes = {StrandClass{}, cheaper};
    head.strand_codecs.resize(2);
    config.limits.viewer_bytes_per_s = 0.5 * 1'000 * StrandClass{}.frame_rate_hz;
    start(config, head);
    app_.publish_next(stream_id);
    Hello viewer = hello();
    viewer.acknowledges = true;
    auto client = join(viewer);
    std::optional<StreamQuality> quality;
    EXPECT_TRUE(eventually([&] {
      app_.publish_next(stream_id);
      const test::Received received = client->read();
      if (received.is_end) return true;
      if (received.opcode() != Opcode::Control) {
        const FrameHeader header = *unpack_frame_header(received.bytes);
        client->send(FrameAck{header.sequence, 1, 0, header.stream_id});
        return false;
      }
      const auto message = decode_server_message(received.bytes);
      if (message && std::holds_alternative<StreamQuality>(*message))
        quality = std::get<StreamQuality>(*message);
      return quality.has_value();
    }));
    ASSERT_TRUE(quality.has_value());
    EXPECT_EQ(quality->stream_id, stream_id_of({codec, 1}));
    EXPECT_EQ(quality->strand_share, 0.25f);
    server_->stop();
  }
}

// As behind a proxy, which takes the asset at once: what the link carries is unknown until it is
// acknowledged.
TEST_F(ServerNet, AFewStrandsFollowAnAssetThatIsLate) {
  for (const bool carries_all : {true, false}) {
    const StrandStream few{0, 1};
    const uint16_t few_id = stream_id_of(few), last_id = carries_all ? stream_id_of({0, 0}) : few_id;
    app_.asset_bytes = 100'000;
    app_.preview = {few, "tangent"};
    NetConfig config;
    if (!carries_all) config.limits.viewer_bytes_per_s = 0.5 * 256 * StrandClass{}.frame_rate_hz;
    StrandClass fewer;
    fewer.strand_share = 0.25f;
    NetHead head;
    head.strand_classes = {StrandClass{}, fewer};
    start(config, head);
    Hello viewer = hello();
    viewer.acknowledges = true;
    auto client = join(viewer);
    std::optional<FrameHeader> asset;
    std::vector<FrameHeader> before, after;  // its acknowledgement
    EXPECT_TRUE(eventually([&] {
      if (before.empty() || last_id == few_id || !after.empty())
        app_.publish_next(before.empty() ? few_id : last_id);
      const test::Received received = client->read();
      if (received.is_end) return true;
      if (received.opcode() == Opcode::Control) return false;
      const FrameHeader header = *unpack_frame_header(received.bytes);
      if (header.opcode == Opcode::Asset) {
        asset = header;
      } else if (before.empty()) {
        before.push_back(header);
        client->send(FrameAck{asset->sequence, 1, 0, asset->stream_id});
      } else {
        after.push_back(header);
        client->send(FrameAck{header.sequence, 1, 0, header.stream_id});
      }
      return after.size() > 5;
    }));
    ASSERT_FALSE(before.empty());
    EXPECT_EQ(before.front().opcode, Opcode::StrandKeyframe);
    EXPECT_EQ(before.front().stream_id, few_id);
    ASSERT_GT(after.size(), 5u);
    EXPECT_EQ(after.back().stream_id, last_id);
    const auto keyframes = std::ranges::count(after, Opcode::StrandKeyframe, &FrameHeader::opcode);
    EXPECT_EQ(keyframes, carries_all ? 1 : 0) << "who goes on with the few needs no other keyframe";
    client->close();
    server_->stop();
  }
}

TEST_F(ServerNet, AViewerGetsFramesOfItsCodecOnly) {
  NetHead head;
  head.strand_codecs.resize(2);
  start({}, head);
  app_.publish_next();
  const auto scenes = join();
  app_.strand_codec = 1;
  const auto other = join();
  const uint16_t other_id = stream_id_of({1, 0});
  // Each asks for a keyframe of its own stream; what it lacks of the chain it asks for again.
  for (const auto& [client, stream_id] : {std::pair{scenes.get(), uint16_t{0}}, {other.get(), other_id}}) {
    for (size_t count = 0; count < 3;) {
      app_.publish_next(0);
      app_.publish_next(other_id);
      const test::Received received = client->read();
      ASSERT_FALSE(received.is_end);
      if (received.opcode() != Opcode::StrandKeyframe && received.opcode() != Opcode::StrandDelta) continue;
      EXPECT_EQ(unpack_frame_header(received.bytes)->stream_id, stream_id);
      ++count;
    }
  }
}

TEST_F(ServerNet, StalledReaderIsDroppedAndCounted) {
  app_.frame_bytes = 4'000'000;
  NetConfig config;
  config.limits.stalled_ms = 200;
  start(config);
  app_.publish_next();
  auto stalled = join(hello(), 4'096);
  EXPECT_TRUE(eventually([&] { return server_->counters().stalled == 1; }));
  EXPECT_TRUE(eventually([&] { return server_->counters().open_sessions == 0; }));
}

// What the kernel holds of a write has to shrink by half before the next part fits.
TEST_F(ServerNet, ASlowReaderIsNotAStalledOne) {
  app_.asset_bytes = 4'000'000;
  NetConfig config;
  config.limits.stalled_ms = 1'500;
  start(config);
  std::vector<std::unique_ptr<RawClient>> clients;
  for (const bool acknowledges : {true, false}) {
    Hello slow = hello();
    slow.acknowledges = acknowledges;
    clients.push_back(join(slow, 4'096));
  }
  for (int i = 0; i < 90; ++i) {
    for (const auto& client : clients) ASSERT_TRUE(client->read_raw(1'500)) << "after " << i << " parts";
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_EQ(server_->counters().stalled, 0u);
}

TEST_F(ServerNet, UnreadControlMessagesCloseTheSession) {
  app_.asset_bytes = 8'000'000;  // the first write never ends, so control messages pile up behind it
  start();
  auto client = std::make_unique<RawClient>(server_->port(), 4'096);
  ASSERT_TRUE(client->handshake());
  client->send(hello());
  ASSERT_TRUE(client->read_control<Welcome>().has_value());
  for (int i = 0; i < 200; ++i) server_->broadcast(ServerStatus{});
  EXPECT_TRUE(eventually([&] { return app_.joined_count() == 0; }));
}

TEST_F(ServerNet, TooManyMessagesAreRefused) {
  NetConfig config;
  config.limits.messages_per_s = 20.0;
  start(config);
  auto client = join();
  for (int i = 0; i < 90; ++i) client->send(FrameAck{1, 1, 1});
  client->send(Ping{1});
  EXPECT_TRUE(client->read_control<Pong>()) << "as after seconds in which nothing came through";
  for (int i = 0; i < 100; ++i) client->send(FrameAck{1, 1, 1});
  EXPECT_TRUE(eventually([&] { return app_.joined_count() == 0; }));
  EXPECT_EQ(server_->counters().bad_messages, 1u);
}

TEST_F(ServerNet, KeyframeRequestsAreRateLimited) {
  NetConfig config;
  config.limits.keyframe_interval_ms = 60'000;
  start(config);
  app_.publish_next();
  auto client = join();
  ASSERT_TRUE(client->read_media(Opcode::StrandKeyframe).has_value());
  const uint64_t before = app_.keyframe_requests;
  for (int i = 0; i < 100; ++i) client->send(KeyframeRequest{});
  client->send(Ping{1});
  ASSERT_TRUE(client->read_control<Pong>().has_value());
  EXPECT_EQ(app_.keyframe_requests, before);
}

TEST_F(ServerNet, PicturesReachTheirClassOnly) {
  start();
  Hello message = hello();
  message.mode = StreamMode::Frames;
  auto viewer = join(message);
  auto strands = join();
  server_->publish_picture(1, make_picture(media(Opcode::JpegFrame, 1, 0)));
  server_->publish_picture(0, make_picture(media(Opcode::JpegFrame, 2, 0)));
  server_->send_to_class(1, Notice{true, "of another class"});
  server_->send_to_class(0, Notice{true, "of this class"});
  const auto picture = viewer->read_media(Opcode::JpegFrame);
  ASSERT_TRUE(picture.has_value());
  EXPECT_EQ(unpack_frame_header(*picture)->sequence, 2u);
  const auto notice = viewer->read_control<Notice>();
  ASSERT_TRUE(notice.has_value());
  EXPECT_EQ(notice->text, "of this class");
  server_->broadcast(Notice{false, "end"});
  test::Received received;
  do {
    received = strands->read();
    EXPECT_NE(received.opcode(), Opcode::JpegFrame);
  } while (!received.is_end && received.opcode() != Opcode::Control);
}

TEST_F(ServerNet, StopSaysGoodbyeToAll) {
  start();
  app_.publish_next();
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 5; ++i) clients.push_back(join());
  RawClient silent(server_->port());  // never answers the closing handshake
  ASSERT_TRUE(silent.handshake());
  std::atomic<int> said_goodbye{0};
  std::vector<std::thread> readers;
  for (auto& client : clients)
    readers.emplace_back([&said_goodbye, &client] {
      const RawClient::End end = client->read_end();
      if (end.close_code == code(CloseCode::GoingAway) && !end.reason.empty()) ++said_goodbye;
    });
  server_->stop();
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(said_goodbye, 5);
}

TEST_F(ServerNet, PortInUseNamesThePort) {
  start();
  NetConfig config;
  config.port = server_->port();
  const auto second = NetServer::listen(config, app_);
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::Unavailable);
  EXPECT_NE(second.error().message.find(std::to_string(config.port)), std::string::npos);
}

TEST(NetServerListen, RefusesBadAddressesAndOpenPortsWithoutToken) {
  FakeApp app;
  NetConfig config;
  config.port = 0;
  config.address = "0.0.0.0";
  auto server = NetServer::listen(config, app);
  ASSERT_FALSE(server.ok());
  EXPECT_EQ(server.error().code, ErrorCode::Unauthorized);
  config.address = "nonsense";
  server = NetServer::listen(config, app);
  ASSERT_FALSE(server.ok());
  EXPECT_NE(server.error().message.find("nonsense"), std::string::npos);
}

}  // namespace
}  // namespace strandcast::server_net_test
