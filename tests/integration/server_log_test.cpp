// What the log says about those who are refused, for a person and for fail2ban, and how much of it.
#include <fstream>
#include <regex>

#include "tests/support/log_capture.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_log_test {
namespace {

using test::code;
using test::kToken;
using test::RawClient;
using test::strict_config;

class ServerLog : public test::ServerNet {
 protected:
  void request(const std::string& text) {
    RawClient client(server_->port());
    client.send_raw(text);
    (void)client.read_raw_to_end();
  }
  void upgrade(const test::HandshakeOptions& options) {
    RawClient client(server_->port());
    EXPECT_FALSE(client.handshake(options));
  }
  void say_hello(const Hello& message) {
    RawClient client(server_->port());
    ASSERT_TRUE(client.handshake());
    client.send(message);
    (void)client.read_end();
  }
  size_t refused(const std::string& word) const {
    return log_.count("warning [net] refused 127.0.0.1 " + word + ": ");
  }

  test::LogCapture log_;
};

TEST_F(ServerLog, EveryRefusalHasItsLine) {
  NetConfig config = strict_config();
  config.limits.sessions = 1;
  config.limits.handshake_ms = 60'000;
  config.limits.refusal_lines_per_address = 100;
  start(config);
  const std::string host = "Host: 127.0.0.1\r\n";
  request("GET /healthz HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(refused("host"), 1u);
  EXPECT_EQ(log_.count("host: 'evil.example'"), 1u);
  upgrade({.path = "/v1", .host = {}, .origin = "http://evil.example"});
  EXPECT_EQ(refused("origin"), 1u);
  request("GET /secret HTTP/1.1\r\n" + host + "\r\n");
  upgrade({.path = "/v1", .host = {}, .origin = {}, .protocol = "other.v1"});
  EXPECT_EQ(refused("path"), 2u);
  request("nonsense\r\n\r\n");
  request("GET /healthz HTTP/1.1\r\n" + host + "Content-Length: 1\r\n\r\nx");
  EXPECT_EQ(refused("request"), 2u);
  say_hello(hello(Role::Viewer, "wrong"));
  request("GET /metrics HTTP/1.1\r\n" + host + "Authorization: Bearer wrong\r\n\r\n");
  EXPECT_EQ(refused("token"), 2u);
  say_hello(hello(Role::Admin, kToken));
  EXPECT_EQ(refused("role"), 1u);
  {
    RawClient garbage(server_->port());
    ASSERT_TRUE(garbage.handshake());
    garbage.send_bytes(std::vector<std::byte>(10, std::byte{0xff}));
    (void)garbage.read_end();
  }
  EXPECT_EQ(refused("message"), 1u);
  const auto viewer = join(hello(Role::Viewer, kToken));
  say_hello(hello(Role::Viewer, kToken));
  EXPECT_EQ(refused("full"), 1u);
}

TEST_F(ServerLog, SilenceHasItsLine) {
  NetConfig config = strict_config();
  config.limits.handshake_ms = 50;
  start(config);
  RawClient silent(server_->port());
  EXPECT_EQ(silent.read_raw_to_end(), "");
  EXPECT_EQ(refused("timeout"), 1u);
}

TEST_F(ServerLog, ABlockAndARateHaveTheirLines) {
  NetConfig config = strict_config();
  config.limits.wrong_tokens = 0;
  config.limits.connections_per_s = 3.0;
  start(config);
  say_hello(hello(Role::Viewer, "wrong"));
  say_hello(hello(Role::Viewer, "wrong too"));
  EXPECT_EQ(refused("blocked"), 1u);
  constexpr int kAttempts = 50;
  for (int i = 0; i < kAttempts && refused("rate") == 0; ++i)
    (void)test::http_get(server_->port(), "/healthz");
  EXPECT_GE(refused("rate"), 1u);
}

TEST_F(ServerLog, NobodyFillsIt) {
  start(strict_config());
  for (int i = 0; i < 30; ++i) request("GET /secret HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  EXPECT_EQ(refused("path"), 10u);
  EXPECT_EQ(server_->counters().refused_http, 30u) << "all are counted";
}

// Such a line would have fail2ban shut out whom the attacker names.
TEST_F(ServerLog, TextsOfStrangersMakeNoLines) {
  start(strict_config());
  const std::string forged = "x 12:00:00.000 warning [net] refused 198.51.100.1 token: x";
  request("GET /healthz HTTP/1.1\r\nHost: " + forged + "\r\n\r\n");
  request("GET /\xc2\x85\xe2\x80\xa8\xe2\x80\xae HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  Hello turned = hello(Role::Viewer, kToken);
  turned.name =
      "a\xe2\x80\xae"
      "b\xc2\x9b"
      "c";
  const auto viewer = join(turned);
  EXPECT_EQ(log_.count("viewer 'a?b?c'"), 1u);
  for (const std::string& line : log_.lines())
    for (const char* raw : {"\xc2\x85", "\xc2\x9b", "\xe2\x80\xa8", "\xe2\x80\xae", "\n", "\r"})
      EXPECT_EQ(line.find(raw), std::string::npos) << line;
  server_->stop();

  std::ifstream filter(STRANDCAST_SOURCE_DIR "/deploy/fail2ban/strandcast-filter.conf");
  std::string pattern;
  for (std::string line; std::getline(filter, line);)
    if (constexpr std::string_view kKey = "failregex = "; line.starts_with(kKey))
      pattern = line.substr(kKey.size());
  const size_t host = pattern.find("<HOST>");
  ASSERT_NE(host, std::string::npos) << pattern;
  const std::regex failure(pattern.replace(host, 6, "(\\S+)"));
  std::smatch found;
  const std::string right =
      "12:00:00.000 warning [net] refused 198.51.100.1 token: The token is wrong or missing.";
  ASSERT_TRUE(std::regex_search(right, found, failure));
  EXPECT_EQ(found[1], "198.51.100.1");
  size_t refusals = 0;
  for (const std::string& line : log_.lines()) {
    const std::string printed = "12:00:00.000 " + line;
    if (!std::regex_search(printed, found, failure)) continue;
    EXPECT_EQ(found[1], "127.0.0.1") << line;
    ++refusals;
  }
  EXPECT_EQ(refusals, 2u);
}

// The reason is the one that counts, with the time that passed.
TEST_F(ServerLog, AViewerThatAcknowledgesNothingIsToldApart) {
  NetConfig config;
  config.limits.unused_ms = 300;
  config.limits.stalled_ms = 60'000;
  start(config);
  app_.publish_next();
  Hello message = hello();
  message.acknowledges = true;
  const auto viewer = join(message);
  EXPECT_TRUE(eventually([&] {
    viewer->send(Ping{1});
    return server_->counters().stalled == 1;
  }));
  EXPECT_EQ(log_.count("acknowledges nothing for 300 ms while it says other things, dropped"), 1u);
}

}  // namespace
}  // namespace strandcast::server_log_test
