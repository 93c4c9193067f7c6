// Limits of the server on sockets, at the limit and one over. SECURITY.md and docs/internals/limits.md list
// which test is for which limit.
#include "tests/support/proxy_header.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_limits_test {
namespace {

using test::code;
using test::kToken;
using test::RawClient;
using test::strict_config;

class ServerLimits : public test::ServerNet {
 protected:
  uint16_t port() const { return server_->port(); }
};

/// A request whose header has exactly this many bytes.
std::string request_of(size_t header_bytes) {
  const std::string begin = "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX: ";
  const std::string end = "\r\n\r\n";
  return begin + std::string(header_bytes - begin.size() - end.size(), 'x') + end;
}

TEST_F(ServerLimits, HttpHeader) {
  start();
  constexpr size_t kMaxHeaderBytes = 8'192;
  RawClient longest(port());
  longest.send_raw(request_of(kMaxHeaderBytes));
  EXPECT_NE(longest.read_raw_to_end().find("200 OK"), std::string::npos);
  RawClient one_over(port());
  one_over.send_raw(request_of(kMaxHeaderBytes + 1));
  EXPECT_EQ(one_over.read_raw_to_end().find("200 OK"), std::string::npos);
}

/// A ping and a field that no version knows, `size` bytes together.
std::vector<std::byte> padded_ping(size_t size) {
  std::vector<std::byte> bytes = encode(ClientMessage(Ping{7}));
  const size_t content = size - bytes.size() - 6;  // three bytes of tag, three of length
  for (const uint32_t number : {uint32_t{2000 << 3 | 2}, static_cast<uint32_t>(content)})
    for (const uint32_t byte : {(number & 0x7f) | 0x80, ((number >> 7) & 0x7f) | 0x80, number >> 14})
      bytes.push_back(static_cast<std::byte>(byte));
  bytes.resize(size);
  return bytes;
}

TEST_F(ServerLimits, MessageSize) {
  start();
  auto client = join();
  for (int i = 0; i < 3; ++i) {
    client->send_bytes(padded_ping(kMaxControlBytes));
    EXPECT_TRUE(client->read_control<Pong>()) << "at the limit, again and again";
  }
  client->send_bytes(padded_ping(kMaxControlBytes + 1));
  EXPECT_EQ(client->read_end().close_code, code(CloseCode::TooBig));
}

// What is away now, as a relay's server, may be there in a moment; a client that had to come again would take
// longer.
TEST_F(ServerLimits, WhoIsToTryLaterWaitsASecondWithTheConnectionOpen) {
  start();
  Hello later = hello();
  later.name = "later";
  join(later)->close();
  EXPECT_EQ(app_.hellos, 4u) << "on one connection";

  RawClient never(server_->port());
  ASSERT_TRUE(never.handshake());
  Hello no_place = hello();
  no_place.name = "no place";
  const int64_t begin_ns = now_ns();
  never.send(no_place);
  EXPECT_EQ(never.read_end().close_code, code(CloseCode::TryLater));
  EXPECT_GE(now_ns() - begin_ns, 900'000'000);

  RawClient hasty(server_->port());
  ASSERT_TRUE(hasty.handshake());
  hasty.send(no_place);
  hasty.send(no_place);
  EXPECT_EQ(hasty.read_end().close_code, code(CloseCode::Policy)) << "nothing comes before the Welcome";
}

TEST_F(ServerLimits, SessionsInAll) {
  NetConfig config;
  config.limits.sessions = 3;
  start(config);
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 3; ++i) clients.push_back(join());
  RawClient one_over(port());
  ASSERT_TRUE(one_over.handshake());
  EXPECT_EQ(one_over.read_end().close_code, code(CloseCode::Full));
  clients[0]->send(Ping{1});
  EXPECT_TRUE(clients[0]->read_control<Pong>());
}

/// So many connections that say nothing, then one more, which is closed at once.
void expect_connection_limit(uint16_t port, size_t limit) {
  std::vector<std::unique_ptr<RawClient>> silent;
  for (size_t i = 0; i < limit; ++i) silent.push_back(std::make_unique<RawClient>(port));
  RawClient one_over(port);
  EXPECT_EQ(one_over.read_raw_to_end(), "");
  silent.back()->send_raw("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  EXPECT_NE(silent.back()->read_raw_to_end().find("200 OK"), std::string::npos) << "at the limit";
}

TEST_F(ServerLimits, ConnectionsOfOneAddress) {
  NetConfig config = strict_config();
  config.limits.handshake_ms = 60'000;
  start(config);
  expect_connection_limit(port(), 16);
  EXPECT_EQ(server_->counters().refused_full, 1u);
}

TEST_F(ServerLimits, ConnectionsOnTrustedLoopback) {
  NetConfig config;
  config.limits.sessions = 1;
  config.limits.handshake_ms = 60'000;
  start(config);
  expect_connection_limit(port(), 1 + 64);
  EXPECT_EQ(server_->counters().refused_full, 1u);
}

/// A connection that a proxy opens for 203.0.113.`last`.
std::unique_ptr<RawClient> connect_for(uint16_t port, int last) {
  auto client = std::make_unique<RawClient>(port);
  client->send_raw(test::proxy_v4(last));
  return client;
}

// From 80 addresses, some silent and some behind the upgrade: more than there are places without a Hello.
TEST_F(ServerLimits, StrangersFillNeitherTheHallNorHealthz) {
  NetConfig config = strict_config();
  config.limits.handshake_ms = 60'000;
  config.limits.sessions = 2;
  config.trusted_proxies = {*parse_address_range("127.0.0.1")};
  config.proxy_protocol = ProxyProtocol::Version2;
  config.allowed_hosts = {"127.0.0.1"};
  start(config);
  std::vector<std::unique_ptr<RawClient>> strangers;
  for (int i = 0; i < 80; ++i) {
    strangers.push_back(connect_for(port(), i));
    if (i % 4 == 0) {
      ASSERT_TRUE(strangers.back()->handshake()) << i;
    }
  }
  // A place is given away a moment after the connection that takes it is counted.
  ASSERT_TRUE(eventually([&] {
    const auto counters = server_->counters();
    return counters.connections == 80 && counters.refused_full >= 80 - 64;
  }));
  EXPECT_EQ(server_->counters().refused_full, 80u - 64u) << "the oldest made room";
  const auto prober = connect_for(port(), 100);
  prober->send_raw("GET /healthz HTTP/1.1\r\nHost: 192.0.2.1\r\n\r\n");
  EXPECT_NE(prober->read_raw_to_end().find("200 OK"), std::string::npos);
  std::vector<std::unique_ptr<RawClient>> viewers;
  for (int i = 0; i < 2; ++i) {
    viewers.push_back(connect_for(port(), 101));
    ASSERT_TRUE(viewers.back()->handshake());
    viewers.back()->send(hello(Role::Viewer, kToken));
    EXPECT_TRUE(viewers.back()->read_control<Welcome>()) << "the hall is empty";
  }
  // Whoever came before the hall was full is told at the Hello.
  auto& waiting = *strangers[76];
  waiting.send(hello(Role::Viewer, kToken));
  EXPECT_EQ(waiting.read_end().close_code, code(CloseCode::Full));
}

// One address with many connections loses one of its own to a newcomer.
TEST_F(ServerLimits, WhoHasMostGivesAPlace) {
  NetConfig config = strict_config();
  config.limits.handshake_ms = 60'000;
  config.trusted_proxies = {*parse_address_range("127.0.0.1")};
  config.proxy_protocol = ProxyProtocol::Version2;
  config.allowed_hosts = {"127.0.0.1"};
  start(config);
  std::vector<std::unique_ptr<RawClient>> singles, many;
  for (int i = 0; i < 48; ++i) singles.push_back(connect_for(port(), i));
  for (int i = 0; i < 16; ++i) {
    many.push_back(connect_for(port(), 200));
    ASSERT_TRUE(many.back()->handshake());
  }
  const auto prober = connect_for(port(), 100);
  prober->send_raw("GET /healthz HTTP/1.1\r\nHost: 192.0.2.1\r\n\r\n");
  EXPECT_NE(prober->read_raw_to_end().find("200 OK"), std::string::npos);
  EXPECT_TRUE(many[0]->read().is_end);
  many[1]->send(hello(Role::Viewer, kToken));
  EXPECT_TRUE(many[1]->read_control<Welcome>());
  singles[0]->send_raw("GET /healthz HTTP/1.1\r\nHost: 192.0.2.1\r\n\r\n");
  EXPECT_NE(singles[0]->read_raw_to_end().find("200 OK"), std::string::npos);
}

TEST_F(ServerLimits, SilenceEndsASession) {
  NetConfig config;
  config.limits.idle_ms = 300;
  start(config);
  auto talks = join(hello(Role::Source));
  // The server looks after a source by pings only, which this one does not answer: it never reads.
  auto silent = join(hello(Role::Source));
  EXPECT_TRUE(eventually([&] {
    talks->send(Ping{1});
    EXPECT_TRUE(talks->read_control<Pong>());
    return server_->counters().open_sessions == 1;
  }));
  talks->send(Ping{1});
  EXPECT_TRUE(talks->read_control<Pong>()) << "whoever says something stays";
}

// What SECURITY.md promises; the other tests shorten these.
TEST(NetLimitsByDefault, AreAsPromised) {
  const NetLimits limits;
  EXPECT_EQ(limits.handshake_ms, 5'000);
  EXPECT_LE(limits.idle_ms, 15'000) << "a dead peer is seen in 15 s";
  EXPECT_EQ(limits.stalled_ms, 4'500) << "a stalled viewer is dropped within 5 s, sweeps included";
  EXPECT_LT(limits.close_ms, 5'000) << "the server ends within 5 s";
  EXPECT_EQ(limits.sessions, 256u);
  EXPECT_EQ(limits.sessions_per_address, 64u);
  EXPECT_EQ(limits.messages_per_s, 1'000.0);
  EXPECT_EQ(kMessagesAtOnceS, 5.0);
  EXPECT_EQ(limits.connections_per_s, 10.0);
  EXPECT_EQ(limits.requests_per_s, 50.0);
  EXPECT_EQ(limits.wrong_tokens, 5u);
  EXPECT_EQ(limits.wrong_token_window_ms, 60'000);
  EXPECT_EQ(limits.wrong_token_block_ms, 60'000);
  EXPECT_EQ(limits.guarded_addresses, 1'024u);
  EXPECT_EQ(limits.refusal_lines_per_address, 10u);
  EXPECT_EQ(limits.refusal_lines, 300u);
  EXPECT_EQ(limits.session_lines, 1'200u);
}

TEST_F(ServerLimits, ConnectionsPerSecond) {
  NetConfig config = strict_config();
  config.limits.connections_per_s = 1.0;
  start(config);
  // A place comes back every second; unit tests have the exact figures.
  EXPECT_NE(test::http_get(port(), "/healthz").find("200 OK"), std::string::npos);
  constexpr int kAttempts = 50;
  for (int i = 0; i < kAttempts && server_->counters().refused_rate == 0; ++i)
    (void)test::http_get(port(), "/healthz");
  EXPECT_GT(server_->counters().refused_rate, 0u);
}

TEST_F(ServerLimits, ConnectionsOnTrustedLoopbackAreNotCounted) {
  NetConfig config;
  config.limits.connections_per_s = 1.0;
  start(config);
  for (int i = 0; i < 20; ++i)
    EXPECT_NE(test::http_get(port(), "/healthz").find("200 OK"), std::string::npos) << i;
}

constexpr uint16_t kNoHandshake = 1;  // no close code

/// How a session with this token ends; Normal when it is let in.
uint16_t close_code_with(uint16_t port, const std::string& token) {
  RawClient client(port);
  if (!client.handshake()) return kNoHandshake;
  Hello hello;
  hello.token = token;
  client.send(hello);
  while (true) {
    const test::Received received = client.read();
    if (received.is_end) return received.close_code;
    const auto message = decode_server_message(received.bytes);
    if (message && std::holds_alternative<Welcome>(*message)) return code(CloseCode::Normal);
  }
}

TEST_F(ServerLimits, WrongTokensOfOneAddress) {
  NetConfig config = strict_config();
  config.limits.wrong_token_window_ms = config.limits.wrong_token_block_ms = 3'600'000;
  start(config);
  for (uint32_t i = 0; i < config.limits.wrong_tokens; ++i)
    EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::Unauthorized));
  EXPECT_EQ(close_code_with(port(), kToken), code(CloseCode::Normal)) << "at the limit";
  EXPECT_EQ(server_->counters().refused_rate, 0u);
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::Unauthorized));
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::TryLater)) << "one over";
  EXPECT_EQ(close_code_with(port(), kToken), code(CloseCode::Normal)) << "a right one passes";
  EXPECT_EQ(server_->counters().refused_rate, 1u);
  EXPECT_NE(test::http_get(port(), "/healthz").find("200 OK"), std::string::npos) << "that is no guess";
  EXPECT_EQ(server_->counters().refused_token, config.limits.wrong_tokens + 1);
}

// A page that was opened without its token, again and again.
TEST_F(ServerLimits, NoTokenIsNoGuess) {
  NetConfig config = strict_config();
  config.limits.wrong_tokens = 0;
  config.limits.wrong_token_block_ms = 3'600'000;
  start(config);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(close_code_with(port(), ""), code(CloseCode::Unauthorized));
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::Unauthorized)) << "not blocked yet";
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::TryLater));
}

constexpr size_t kMostFlood = 64u << 20;

/// So many bytes of this are taken before the connection ends, or kMostFlood.
size_t flood(RawClient& client, const std::string& piece) {
  std::string many;
  while (many.size() < 64'000) many += piece;
  size_t sent = 0;
  while (sent < kMostFlood && client.send_raw(many)) sent += many.size();
  return sent;
}

// What makes no message is counted, too: neither comes to Session::on_message().
TEST_F(ServerLimits, ControlFramesAndEmptyFragmentsAreCounted) {
  const std::string mask(4, '\0');
  const std::string pong = "\x8a\x80" + mask;  // nobody asked for it, and nothing answers it
  const std::string begin = "\x02\x80" + mask;
  const std::string empty("\x00\x80\x00\x00\x00\x00", 6);
  start();
  for (const bool has_joined : {false, true}) {
    for (const std::string& piece : {pong, empty}) {
      auto client = has_joined ? join() : std::make_unique<RawClient>(port());
      ASSERT_NE(client, nullptr);
      if (!has_joined) {
        ASSERT_TRUE(client->handshake());
      }
      if (piece == empty) {
        ASSERT_TRUE(client->send_raw(begin));
      }
      EXPECT_LT(flood(*client, piece), kMostFlood / 2) << has_joined << (piece == pong ? " pong" : " empty");
    }
  }
  EXPECT_NE(join(), nullptr) << "all others are served";
}

TEST_F(ServerLimits, WrongTokensForMetricsCountToo) {
  NetConfig config = strict_config();
  config.limits.wrong_tokens = 0;
  config.limits.wrong_token_block_ms = 3'600'000;
  start(config);
  EXPECT_NE(test::http_get(port(), "/metrics").find("401"), std::string::npos) << "none at all is no guess";
  EXPECT_NE(test::http_get(port(), "/healthz").find("200 OK"), std::string::npos);
  RawClient guess(port());
  guess.send_raw("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer wrong\r\n\r\n");
  EXPECT_NE(guess.read_raw_to_end().find("401"), std::string::npos);
  RawClient again(port());
  again.send_raw("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + std::string(kToken) +
                 "\r\n\r\n");
  EXPECT_NE(again.read_raw_to_end().find("200 OK"), std::string::npos) << "a right one passes";
  RawClient more(port());
  more.send_raw("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer wrong\r\n\r\n");
  EXPECT_NE(more.read_raw_to_end().find(" 429 "), std::string::npos);
  EXPECT_NE(test::http_get(port(), "/healthz").find("200 OK"), std::string::npos);
}

TEST_F(ServerLimits, ABlockEnds) {
  NetConfig config = strict_config();
  config.limits.wrong_tokens = 0;
  config.limits.wrong_token_block_ms = 50;
  start(config);
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::Unauthorized));
  EXPECT_TRUE(eventually([&] { return close_code_with(port(), "wrong") == code(CloseCode::Unauthorized); }))
      << "it is looked at again";
}

TEST_F(ServerLimits, WrongTokensOnTrustedLoopbackDoNotBlock) {
  NetConfig config = strict_config();
  config.loopback_trust = LoopbackTrust::Trusted;
  config.limits.wrong_tokens = 0;
  config.limits.wrong_token_block_ms = 3'600'000;
  start(config);
  EXPECT_EQ(close_code_with(port(), "wrong"), code(CloseCode::Unauthorized));
  EXPECT_EQ(close_code_with(port(), kToken), code(CloseCode::Normal));
}

}  // namespace
}  // namespace strandcast::server_limits_test
