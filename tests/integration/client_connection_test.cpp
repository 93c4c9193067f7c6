// ViewerClient against servers that refuse, vanish, stall or break the protocol.
#include <atomic>
#include <future>
#include <thread>

#include "client/net/http_get.h"
#include "common/client/viewer_client.h"
#include "common/wire/close_code.h"
#include "tests/support/client_config.h"
#include "tests/support/eventually.h"
#include "tests/support/fake_server.h"
#include "tests/support/sample_messages.h"

namespace strandcast::client_connection_test {
namespace {

using std::chrono::milliseconds;
using test::config_for;
using test::FakePeer;
using test::FakeServer;
using test::make_welcome;
using testing::HasSubstr;

constexpr uint32_t kStrands = 20;
constexpr uint32_t kVertices = 8;
constexpr milliseconds kLong{20'000};  // never reached by code that works

/// The error of connecting to a server that runs this script.
Error refusal(const FakeServer::Script& script, milliseconds timeout = kLong) {
  const FakeServer server(script);
  ClientConfig config = config_for(server.port());
  config.connect_timeout = timeout;
  config.welcome_timeout = timeout;
  const auto client = ViewerClient::connect(config);
  if (client) return make_error(ErrorCode::Internal, "it connected");
  return client.error();
}

/// Waits for the end of the connection and gives its reason; other events are thrown away.
Error end_of(ViewerClient& client) {
  while (true) {
    const auto events = client.wait(kLong);
    if (events.empty()) return make_error(ErrorCode::Internal, "the connection did not end");
    for (const auto& event : events)
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
  }
}

/// The reason why a client leaves after the server, past its Welcome, did this; and the close code the server
/// saw.
struct Ending {
  Error error;
  uint16_t close_code = 0;
};
Ending ending_after(const FakeServer::Script& misbehave) {
  std::atomic<uint16_t> close_code{0};
  Ending ending;
  {
    const FakeServer server([&](FakePeer& peer) {
      if (!peer.welcome(make_welcome(kStrands, kVertices))) return;
      misbehave(peer);
      close_code = peer.read_to_end();
    });
    auto client = ViewerClient::connect(config_for(server.port()));
    if (!client) return {client.error(), 0};
    ending.error = end_of(**client);
  }
  ending.close_code = close_code;
  return ending;
}

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (const int value : values) bytes.push_back(static_cast<std::byte>(value));
  return bytes;
}

TEST(ClientConnect, SaysThatNobodyListens) {
  uint16_t port = 0;
  {
    port = FakeServer([](FakePeer&) {}).port();
  }
  const auto client = ViewerClient::connect(config_for(port));
  ASSERT_FALSE(client);
  EXPECT_EQ(client.error().code, ErrorCode::Unavailable);
  EXPECT_EQ(client.error().place, fmt::format("127.0.0.1:{}", port));
}

TEST(ClientConnect, GivesUpOnASilentServer) {
  const Error silent = refusal([](FakePeer& peer) { peer.wait_for_test_end(); }, milliseconds(100));
  EXPECT_EQ(silent.code, ErrorCode::Timeout) << silent.to_string();
  const Error no_welcome = refusal(
      [](FakePeer& peer) {
        peer.upgrade();
        peer.wait_for_test_end();
      },
      milliseconds(300));
  EXPECT_EQ(no_welcome.code, ErrorCode::Timeout);
  EXPECT_THAT(no_welcome.message, HasSubstr("Welcome"));
}

TEST(ClientConnect, RefusesWhatIsNotThisProtocol) {
  const Error not_http = refusal([](FakePeer& peer) {
    peer.send_raw("SSH-2.0-OpenSSH_9.2\r\n\r\n\r\n");
    peer.wait_for_test_end();
  });
  EXPECT_EQ(not_http.code, ErrorCode::BadInput) << not_http.to_string();
  const Error other_version = refusal([](FakePeer& peer) {
    peer.upgrade("strandcast.v9");
    peer.wait_for_test_end();
  });
  EXPECT_EQ(other_version.code, ErrorCode::Unsupported);
  EXPECT_THAT(other_version.message, HasSubstr("strandcast.v9"));
  const Error no_version = refusal([](FakePeer& peer) {
    peer.upgrade("");
    peer.wait_for_test_end();
  });
  EXPECT_EQ(no_version.code, ErrorCode::Unsupported);
}

TEST(ClientConnect, NamesTheHttpStatusOfARefusal) {
  const std::vector<std::pair<unsigned, ErrorCode>> cases = {
      {401, ErrorCode::Unauthorized}, {403, ErrorCode::Unauthorized}, {404, ErrorCode::NotFound},
      {426, ErrorCode::Unsupported},  {429, ErrorCode::Unavailable},  {500, ErrorCode::Unavailable},
      {502, ErrorCode::Unavailable},  {503, ErrorCode::Unavailable},  {504, ErrorCode::Unavailable}};
  for (const auto& [status, code] : cases) {
    const Error error = refusal([status = status](FakePeer& peer) {
      peer.answer_http(status, "the\x1b[31m reason");
      peer.wait_for_test_end();
    });
    EXPECT_EQ(error.code, code) << error.to_string();
    EXPECT_THAT(error.message, HasSubstr(std::to_string(status)));
    EXPECT_EQ(error.message.find('\x1b'), std::string::npos)
        << "control characters must not reach a terminal";
  }
}

TEST(ClientConnect, TakesTheReasonOfAGoodbyeAndItsCloseCode) {
  const std::vector<std::pair<CloseCode, ErrorCode>> cases = {
      {CloseCode::Unauthorized, ErrorCode::Unauthorized}, {CloseCode::Full, ErrorCode::LimitExceeded},
      {CloseCode::Policy, ErrorCode::BadInput},           {CloseCode::Refused, ErrorCode::Unsupported},
      {CloseCode::NotFound, ErrorCode::NotFound},         {CloseCode::GoingAway, ErrorCode::Unavailable}};
  for (const auto& [close, code] : cases) {
    const Error error = refusal([close = close](FakePeer& peer) {
      peer.upgrade();
      peer.send(Goodbye{"Because of this."});
      peer.close(static_cast<uint16_t>(close), "");
    });
    EXPECT_EQ(error.code, code) << error.to_string();
    EXPECT_THAT(error.message, HasSubstr("Because of this."));
  }
  const Error rude = refusal([](FakePeer& peer) {
    peer.upgrade();
    peer.send(Goodbye{"No close frame."});
    peer.wait_for_test_end();
  });
  EXPECT_THAT(rude.message, HasSubstr("No close frame."));
}

TEST(ClientConnect, SendsItsHelloWithTheToken) {
  std::promise<std::optional<Hello>> received;
  const FakeServer server([&](FakePeer& peer) {
    received.set_value(peer.welcome(make_welcome(kStrands, kVertices)));
    peer.read_to_end();
  });
  ClientConfig config = config_for(server.port());
  config.hello = {Role::Source, StreamMode::Frames, "test", "a secret", 320, 200};
  const auto client = ViewerClient::connect(config);
  ASSERT_TRUE(client) << client.error().to_string();
  EXPECT_EQ((*client)->welcome().strand_count, kStrands);
  const auto hello = received.get_future().get();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->token, "a secret");
  EXPECT_EQ(hello->role, Role::Source);
  EXPECT_EQ(hello->mode, StreamMode::Frames);
  EXPECT_EQ(hello->frame_width, 320u);
}

TEST(ClientHostile, ControlMessagesBeforeTheWelcomeAreRefused) {
  size_t refused = 0;
  for (const ServerMessage& message : sample_server_messages()) {
    if (std::holds_alternative<Welcome>(message) || std::holds_alternative<Goodbye>(message) ||
        std::holds_alternative<Pong>(message))
      continue;
    const Error error = refusal([&](FakePeer& peer) {
      peer.upgrade();
      peer.send(message);
      peer.read_to_end();
    });
    EXPECT_EQ(error.code, ErrorCode::BadInput) << error.to_string();
    EXPECT_THAT(error.message, HasSubstr("before its Welcome"));
    ++refused;
  }
  EXPECT_EQ(refused, 12u) << "status, stream quality, mode change, frame quality, session list, notice, look "
                             "change, scene text, parameter list, camera, state times, stream list";
}

TEST(ClientHostile, MediaBeforeTheWelcomeIsRefused) {
  const Error error = refusal([](FakePeer& peer) {
    peer.upgrade();
    peer.send(*make_encoded_frame({.opcode = Opcode::StrandKeyframe, .sequence = 1}, {}));
    peer.read_to_end();
  });
  EXPECT_EQ(error.code, ErrorCode::BadInput) << error.to_string();
}

TEST(ClientHostile, EveryMalformedMessageEndsTheConnectionWithAReason) {
  const auto frame = make_encoded_frame({.opcode = Opcode::StrandKeyframe, .sequence = 1},
                                        std::vector<std::byte>(100, std::byte{1}));
  const std::span<const std::byte> whole(frame->message);
  auto longer = frame->message;
  longer.push_back(std::byte{0});
  auto huge_claim = frame->message;
  huge_claim[12] = huge_claim[13] = huge_claim[14] = huge_claim[15] = std::byte{0xff};
  auto control = encode(ServerMessage(ServerStatus{}));
  control.resize(control.size() / 2 + 1);
  const std::vector<std::pair<const char*, FakeServer::Script>> cases = {
      {"text", [](FakePeer& peer) { peer.send_text("hello"); }},
      {"empty", [](FakePeer& peer) { peer.send_bytes({}); }},
      {"header cut", [&](FakePeer& peer) { peer.send_bytes(whole.first(kFrameHeaderBytes - 1)); }},
      {"payload cut", [&](FakePeer& peer) { peer.send_bytes(whole.first(whole.size() - 1)); }},
      {"payload too long", [&](FakePeer& peer) { peer.send_bytes(longer); }},
      {"length claims more", [&](FakePeer& peer) { peer.send_bytes(huge_claim); }},
      {"control garbage",
       [](FakePeer& peer) {
         peer.send_bytes(bytes_of({0x01, 0xff, 0xff, 0xff, 0xff}));
       }},
      {"second Welcome", [](FakePeer& peer) { peer.send(make_welcome(kStrands, kVertices)); }},
      {"reserved bits", [](FakePeer& peer) { peer.send_raw(std::string(32, '\xff')); }},
      // A 64-bit length of 2^62 in the WebSocket header itself: refused before anything is allocated.
      {"endless message",
       [](FakePeer& peer) { peer.send_raw(std::string("\x82\x7f\x40\0\0\0\0\0\0\0", 10)); }},
  };
  for (const auto& [name, script] : cases) {
    const Ending ending = ending_after(script);
    const bool is_named =
        ending.error.code == ErrorCode::BadInput || ending.error.code == ErrorCode::LimitExceeded;
    EXPECT_TRUE(is_named) << name << ": " << ending.error.to_string();
    EXPECT_FALSE(ending.error.message.empty());
    EXPECT_THAT(ending.error.place, HasSubstr("127.0.0.1")) << name;
  }
  EXPECT_EQ(ending_after(cases[0].second).close_code, 1002)
      << "the server is told that it broke the protocol";
}

TEST(ClientHostile, AVanishedServerEndsTheConnection) {
  EXPECT_EQ(ending_after([](FakePeer& peer) { peer.reset(); }).error.code, ErrorCode::Unavailable);

  const FakeServer server([](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.wait_for_test_end();  // half open: neither data nor pongs
  });
  ClientConfig config = config_for(server.port());
  config.idle_timeout = milliseconds(200);
  auto client = ViewerClient::connect(config);
  ASSERT_TRUE(client) << client.error().to_string();
  EXPECT_EQ(end_of(**client).code, ErrorCode::Timeout);
  EXPECT_FALSE((*client)->send(KeyframeRequest{})) << "nothing can be sent any more";
}

// Section 10 of WIRE.md: a later version of the protocol may have kinds of messages that this one lacks.
TEST(ClientMessages, UnknownKindsAreIgnoredAndCounted) {
  const FakeServer server([&](FakePeer& peer) {
    const std::vector<std::byte> newer = bytes_of({0x01, 0xc2, 0x3e, 0x01, 0x78});  // field 1000, one byte
    if (!peer.upgrade()) return;
    peer.read();
    peer.send_bytes(newer);
    peer.send(make_welcome(kStrands, kVertices));
    peer.send_bytes(newer);
    peer.send_bytes(bytes_of({0x77, 1, 2, 3}));  // no opcode of ours
    peer.send(Notice{false, "still here"});
    peer.read_to_end();
  });
  auto client = ViewerClient::connect(config_for(server.port()));
  ASSERT_TRUE(client) << client.error().to_string();
  bool has_notice = false;
  EXPECT_TRUE(eventually([&] {
    for (const ClientEvent& event : (*client)->wait(milliseconds(100))) {
      EXPECT_FALSE(std::holds_alternative<ClosedEvent>(event));
      has_notice = has_notice || std::holds_alternative<Notice>(event);
    }
    return has_notice;
  }));
  EXPECT_EQ((*client)->counters().unknown_messages, 3u);
}

TEST(ClientHostile, EndlessControlMessagesStayBounded) {
  constexpr int kMessages = 20'000;
  std::atomic<bool> is_sent{false};
  const FakeServer server([&](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    for (int i = 0; i < kMessages; ++i) {
      peer.send(ServerStatus{.tick = static_cast<uint64_t>(i)});
      peer.send(Notice{false, "again"});
      peer.send(Pong{i, i, i});  // never asked for
    }
    is_sent = true;
    peer.read_to_end();
  });
  auto client = ViewerClient::connect(config_for(server.port()));
  ASSERT_TRUE(client) << client.error().to_string();
  while (!is_sent || (*client)->counters().received_messages < 3u * kMessages)
    std::this_thread::sleep_for(milliseconds(1));
  EXPECT_LE((*client)->poll().size(), 1 + MailboxLimits{}.notices);
  EXPECT_FALSE((*client)->clock().has_value()) << "pongs that answer no probe must not move the clock";
}

TEST(ClientHostile, AServerThatDoesNotReadCannotMakeTheSendQueueGrow) {
  const FakeServer server([](FakePeer& peer) {
    peer.welcome(make_welcome(kStrands, kVertices));
    peer.wait_for_test_end();
  });
  auto client = ViewerClient::connect(config_for(server.port()));
  ASSERT_TRUE(client) << client.error().to_string();
  MotionSamples full;
  full.samples.resize(kMaxSamplesPerMessage);
  Status sent;
  for (int i = 0; i < 1'000'000 && sent; ++i) sent = (*client)->send(full);
  ASSERT_FALSE(sent);
  EXPECT_EQ(sent.error().code, ErrorCode::LimitExceeded);
  EXPECT_LE((*client)->queued_messages(), kMaxSendQueueMessages);
}

TEST(HttpGet, ReturnsStatusAndBodyAndBoundsWaiting) {
  const FakeServer good([](FakePeer& peer) { peer.answer_http(503, "starting"); });
  const auto answer = http_get({"127.0.0.1", good.port()}, "/healthz", kLong);
  ASSERT_TRUE(answer) << answer.error().to_string();
  EXPECT_EQ(answer->status, 503u);
  EXPECT_EQ(answer->body, "starting");

  const FakeServer silent([](FakePeer& peer) { peer.wait_for_test_end(); });
  const auto waited = http_get({"127.0.0.1", silent.port()}, "/healthz", milliseconds(100));
  ASSERT_FALSE(waited);
  EXPECT_EQ(waited.error().code, ErrorCode::Timeout);

  const FakeServer endless([](FakePeer& peer) {
    peer.send_raw("HTTP/1.1 200 OK\r\n\r\n");
    while (peer.send_raw(std::string(1 << 16, 'x'))) {
    }
  });
  const auto bounded = http_get({"127.0.0.1", endless.port()}, "/healthz", kLong);
  ASSERT_FALSE(bounded);
  EXPECT_EQ(bounded.error().code, ErrorCode::LimitExceeded);
}

/// Hostile HTTP answers: how each begins, and what then comes again and again.
struct EndlessAnswer {
  const char* name;
  std::string begin;
  std::string piece;
};

std::vector<EndlessAnswer> endless_answers(const std::string& status_line) {
  const std::string chunked = status_line + "Transfer-Encoding: chunked\r\n\r\n";
  const std::string kilobyte(1000, 'x');
  return {{"a line of the header", status_line + "Name: ", kilobyte},
          {"lines of the header", status_line, "Name: " + kilobyte + "\r\n"},
          {"a body of any length", status_line + "\r\n", kilobyte},
          {"a body that says its length", status_line + "Content-Length: 1000000000\r\n\r\n", kilobyte},
          {"the extension of a chunk", chunked + "1;", kilobyte},
          {"chunks with extensions", chunked, "1;" + kilobyte + "\r\nx\r\n"},
          {"the length of a chunk", chunked, std::string(1000, '0')},
          {"a trailer", chunked + "0\r\n", "Name: " + kilobyte + "\r\n"}};
}

constexpr uint64_t kEndlessBytes = 64u << 20;
constexpr uint64_t kMostTakenBytes = 16u << 20;  // what the client's limits and the buffers of sockets take

/// Sends it as long as somebody takes it; the bytes that went.
uint64_t send_endless(FakePeer& peer, const EndlessAnswer& answer) {
  std::string many;
  while (many.size() < 64'000) many += answer.piece;
  uint64_t sent = 0;
  if (!peer.send_raw(answer.begin)) return sent;
  while (sent < kEndlessBytes && peer.send_raw(many)) sent += many.size();
  return sent;
}

TEST(HttpGet, LeavesAnAnswerWithoutEnd) {
  for (const EndlessAnswer& answer : endless_answers("HTTP/1.1 200 OK\r\n")) {
    std::atomic<uint64_t> sent{0};
    {
      const FakeServer server([&](FakePeer& peer) { sent = send_endless(peer, answer); });
      const auto got = http_get({"127.0.0.1", server.port()}, "/healthz", kLong);
      ASSERT_FALSE(got) << answer.name;
      EXPECT_THAT(got.error().message,
                  testing::AnyOf(HasSubstr("too long"), HasSubstr("no HTTP answer: bad")))
          << answer.name;
    }
    EXPECT_LT(sent, kMostTakenBytes) << answer.name;
  }
}

TEST(ClientHostile, AnUpgradeAnswerWithoutEndIsLeft) {
  for (const char* status :
       {"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: upgrade\r\n",
        "HTTP/1.1 503 Service Unavailable\r\n"}) {
    for (const EndlessAnswer& answer : endless_answers(status)) {
      std::atomic<uint64_t> sent{0};
      const Error error = refusal([&](FakePeer& peer) { sent = send_endless(peer, answer); });
      EXPECT_EQ(error.code, ErrorCode::BadInput) << answer.name << ": " << error.to_string();
      EXPECT_LT(sent, kMostTakenBytes) << answer.name;
    }
  }
}

}  // namespace
}  // namespace strandcast::client_connection_test
