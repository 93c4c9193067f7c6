// A server behind proxies: each client counts for itself, and nobody else may say for whom it connects.
#include "tests/support/log_capture.h"
#include "tests/support/proxy_header.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_proxy_test {
namespace {

using test::code;
using test::proxy_header;
using test::proxy_v4;
using test::RawClient;

constexpr const char* kToken = "0123456789abcdef";
constexpr const char* kFirst = "203.0.113.9";
constexpr const char* kSecond = "203.0.113.10";

class ServerProxy : public test::ServerNet {
 protected:
  /// Behind a proxy on this machine; the first wrong token blocks.
  static NetConfig behind_proxy(ProxyProtocol protocol = ProxyProtocol::None,
                                const char* proxy = "127.0.0.1") {
    NetConfig config;
    config.tokens = {{kToken, Grant::AllButAdmin}};
    config.trusted_proxies = {*parse_address_range(proxy)};
    config.proxy_protocol = protocol;
    config.allowed_hosts = {"127.0.0.1"};
    config.limits.wrong_tokens = 0;
    config.limits.wrong_token_block_ms = 3'600'000;
    config.limits.connections_per_s = 1e6;
    return config;
  }
  /// The status of GET /metrics with this token, sent behind `begin` and with these fields.
  std::string metrics(const std::string& token, const std::string& fields, const std::string& begin = {}) {
    RawClient client(server_->port());
    client.send_raw(begin + "GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n" + fields +
                    "Authorization: Bearer " + token + "\r\n\r\n");
    const std::string answer = client.read_raw_to_end();
    constexpr size_t kStatusAt = 9, kStatusChars = 3;
    return answer.size() > kStatusAt ? answer.substr(kStatusAt, kStatusChars) : answer;
  }
  static std::string forwarded(const std::string& list) { return "X-Forwarded-For: " + list + "\r\n"; }

  test::LogCapture log_;
};

TEST_F(ServerProxy, WrongTokensBlockTheClientAndNotItsProxy) {
  start(behind_proxy());
  EXPECT_EQ(metrics("wrong", forwarded(kFirst)), "401");
  EXPECT_EQ(metrics("wrong too", forwarded(kFirst)), "429");
  EXPECT_EQ(metrics(kToken, forwarded(kFirst)), "200") << "a right token passes a block";
  EXPECT_EQ(metrics(kToken, forwarded(kSecond)), "200");
  EXPECT_EQ(metrics("wrong too", forwarded(std::string(kSecond) + ", " + kFirst)), "429")
      << "its own writing";
  EXPECT_EQ(metrics(kToken, forwarded(kFirst) + forwarded(kSecond)), "200") << "two fields are one list";
  for (const char* address : {kFirst, kSecond}) {
    RawClient client(server_->port());
    ASSERT_TRUE(client.handshake({.path = "/v1", .host = {}, .origin = {}, .forwarded_for = address}));
    client.send(hello(Role::Viewer, address == kFirst ? "wrong too" : kToken));
    if (address == kFirst) {
      EXPECT_EQ(client.read_end().close_code, code(CloseCode::TryLater));
      continue;
    }
    EXPECT_TRUE(client.read_control<Welcome>());
    EXPECT_EQ(log_.count("from 203.0.113.10 joined"), 1u);
  }
}

TEST_F(ServerProxy, NobodyElseSpeaksForOthers) {
  start(behind_proxy(ProxyProtocol::None, "10.0.0.1"));
  EXPECT_EQ(metrics(kToken, forwarded(kFirst)), "200");
  RawClient client(server_->port());
  ASSERT_TRUE(client.handshake({.path = "/v1", .host = {}, .origin = {}, .forwarded_for = kFirst}));
  client.send(hello(Role::Viewer, kToken));
  EXPECT_TRUE(client.read_control<Welcome>());
  EXPECT_EQ(log_.count("from 127.0.0.1 joined"), 1u);
  EXPECT_EQ(log_.count(kFirst), 0u);
}

TEST_F(ServerProxy, ComingThroughAProxyOnLoopbackIsNotComingFromLoopback) {
  start(behind_proxy());
  RawClient client(server_->port());
  client.send_raw("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  EXPECT_NE(client.read_raw_to_end().find(" 401 "), std::string::npos);
}

TEST_F(ServerProxy, AProxyThatSaysNothingIsTold) {
  start(behind_proxy());
  (void)test::http_get(server_->port(), "/healthz");
  EXPECT_EQ(log_.count("names no client"), 0u) << "its own probe";
  EXPECT_NE(join(hello(Role::Viewer, kToken)), nullptr);
  EXPECT_EQ(log_.count("warning [net] trusted proxy 127.0.0.1 names no client"), 1u);
}

TEST_F(ServerProxy, AProxyThatNamesNobodyIsRefused) {
  start(behind_proxy());
  for (const char* list : {"unknown", "203.0.113.9, unknown", ""})
    EXPECT_EQ(metrics(kToken, forwarded(list)), "400") << list;
  EXPECT_EQ(log_.count("refused 127.0.0.1 proxy: "), 3u);
}

TEST_F(ServerProxy, EachClientHasItsOwnRate) {
  NetConfig config = behind_proxy();
  config.limits.connections_per_s = 1.0;
  start(config);
  constexpr int kAttempts = 50;
  std::string answer;
  for (int i = 0; i < kAttempts && answer != "429"; ++i) answer = metrics(kToken, forwarded(kFirst));
  EXPECT_EQ(answer, "429");
  EXPECT_EQ(metrics(kToken, forwarded(kSecond)), "200");
}

TEST_F(ServerProxy, PROXYHeadersNameTheClient) {
  start(behind_proxy(ProxyProtocol::Version2));
  EXPECT_EQ(metrics("wrong", {}, proxy_v4(9)), "401");
  EXPECT_EQ(metrics("wrong too", {}, proxy_v4(9)), "429");
  EXPECT_EQ(metrics(kToken, {}, proxy_v4(10)), "200");
  EXPECT_EQ(metrics("wrong too", forwarded(kSecond), proxy_v4(9)), "429")
      << "no proxy, so its word counts nothing";
  EXPECT_EQ(metrics(kToken, {}, proxy_header(0x20, 0, {})), "200") << "the proxy for itself";
  RawClient pieces(server_->port());
  for (const char byte : proxy_v4(11, std::string("\x02\0\x04name", 7)))
    pieces.send_raw(std::string(1, byte));
  ASSERT_TRUE(pieces.handshake());
  pieces.send(hello(Role::Viewer, kToken));
  EXPECT_TRUE(pieces.read_control<Welcome>());
  EXPECT_EQ(log_.count("from 203.0.113.11 joined"), 1u);
  // By the address that the client connected to the Host may name us.
  RawClient named(server_->port());
  named.send_raw(proxy_v4(12) + "GET /healthz HTTP/1.1\r\nHost: 192.0.2.1\r\n\r\n");
  EXPECT_NE(named.read_raw_to_end().find("200 OK"), std::string::npos);
}

TEST_F(ServerProxy, WrongPROXYHeadersAreClosedUnanswered) {
  NetConfig config = behind_proxy(ProxyProtocol::Version2);
  config.limits.handshake_ms = 60'000;
  start(config);
  const std::string wrong[] = {"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
                               "PROXY TCP4 1.2.3.4 5.6.7.8 1 2\r\n",
                               std::string(100, '\0'),
                               proxy_header(0x21, 0x11, "short"),
                               proxy_header(0x22, 0x11, std::string(12, '\0')),
                               proxy_header(0x20, 0, std::string(2'100, '\0'))};
  for (const std::string& begin : wrong) {
    RawClient client(server_->port());
    client.send_raw(begin);
    EXPECT_EQ(client.read_raw_to_end(), "");
  }
  EXPECT_EQ(log_.count("refused 127.0.0.1 proxy: "), std::size(wrong));
}

// Whoever connects directly sends none, and one that he sends is no HTTP.
TEST_F(ServerProxy, PROXYHeadersOfOthersAreNone) {
  start(behind_proxy(ProxyProtocol::Version2, "10.0.0.1"));
  EXPECT_EQ(metrics(kToken, {}), "200");
  EXPECT_EQ(metrics(kToken, {}, proxy_v4(9)), "400");
}

}  // namespace
}  // namespace strandcast::server_proxy_test
