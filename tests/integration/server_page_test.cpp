// The page on the server's port: its headers, connections that are kept, takers that are slow, and requests
// that mean no good. The files are made up; tests/web opens the real ones in a browser.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "tests/support/log_capture.h"
#include "tests/support/proxy_header.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_page_test {
namespace {

using test::code;
using test::RawClient;
using test::strict_config;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr std::string_view kPage = "<!doctype html>";
constexpr std::string_view kPageGzip = "page in gzip";
constexpr std::string_view kPageBrotli = "page in Brotli";
/// Many times what the kernel holds between two ends.
constexpr size_t kLargeBytes = 48u << 20;
const std::string& large() {
  static const std::string bytes(kLargeBytes, 'x');
  return bytes;
}

std::string with_host(const std::string& line, const std::string& fields = {}) {
  return line + " HTTP/1.1\r\nHost: 127.0.0.1\r\n" + fields + "\r\n";
}
const std::string kGetPage = with_host("GET /");
constexpr const char* kGzip = "Accept-Encoding: gzip, deflate\r\n";

class ServerPage : public test::ServerNet {
 protected:
  static NetConfig with_page(NetConfig config = {}) {
    static const PageFile files[] = {
        {"/", "text/html; charset=utf-8", "aa", PageFileName::Fixed, kPage, kPageGzip, kPageBrotli},
        {"/core.bb.wasm", "application/wasm", "bb", PageFileName::Hashed, "wasm", "wasm in gzip",
         "wasm in Brotli"},
        {"/large.cc.wasm", "application/wasm", "cc", PageFileName::Hashed, large(), large(), large()}};
    config.page = files;
    return config;
  }
  std::string ask(const std::string& request) {
    RawClient client(server_->port());
    client.send_raw(request);
    return client.read_answer();
  }
  static std::string body_of(const std::string& answer) {
    return answer.substr(std::min(answer.size(), answer.find("\r\n\r\n") + 4));
  }
  test::LogCapture log_;
};

TEST_F(ServerPage, ASessionBehindAProxyHasItsPageInItsFolder) {
  start(with_page());
  EXPECT_EQ(body_of(ask(with_host("GET /s/anna/"))), kPage);
  EXPECT_EQ(body_of(ask(with_host("GET /s/anna/core.bb.wasm"))), "wasm");
  const std::string moved = ask(with_host("GET /s/anna"));
  EXPECT_THAT(moved, StartsWith("HTTP/1.1 308"));
  EXPECT_THAT(moved, HasSubstr("Location: /s/anna/\r\n"));
  EXPECT_THAT(ask(with_host("GET /s/an%20na/")), StartsWith("HTTP/1.1 404"));
}

TEST_F(ServerPage, ThePageIsAskedForEachTimeAndComesWithItsPolicy) {
  start(with_page());
  const std::string answer = ask(with_host("GET /", kGzip));
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200 OK\r\n"));
  for (const char* field :
       {"Content-Type: text/html; charset=utf-8\r\n", "Content-Encoding: gzip\r\n",
        "Cache-Control: no-cache\r\n", "ETag: \"aa-gzip\"\r\n", "Vary: Accept-Encoding\r\n",
        "X-Content-Type-Options: nosniff\r\n", "Referrer-Policy: no-referrer\r\n",
        "Cross-Origin-Opener-Policy: same-origin\r\n", "Cross-Origin-Embedder-Policy: require-corp\r\n",
        "frame-ancestors 'none'", "ws://127.0.0.1 "})
    EXPECT_THAT(answer, HasSubstr(field));
  EXPECT_THAT(answer, Not(HasSubstr("Connection: close")));
  EXPECT_EQ(body_of(answer), kPageGzip);
  const std::string plain = ask(kGetPage);
  EXPECT_EQ(body_of(plain), kPage);
  EXPECT_THAT(plain, Not(HasSubstr("Content-Encoding")));
  EXPECT_THAT(plain, HasSubstr("ETag: \"aa-plain\"\r\n"));
  EXPECT_EQ(body_of(ask(with_host("GET /?utm=1"))), kPage);
}

// Browsers name Brotli over https and on localhost only: proxies on the way knew it not.
TEST_F(ServerPage, WhoTakesBrotliGetsIt) {
  start(with_page());
  const std::string answer = ask(with_host("GET /", "Accept-Encoding: gzip, deflate, br\r\n"));
  for (const char* field : {"Content-Encoding: br\r\n", "ETag: \"aa-br\"\r\n", "Vary: Accept-Encoding\r\n"})
    EXPECT_THAT(answer, HasSubstr(field));
  EXPECT_EQ(body_of(answer), kPageBrotli);
  EXPECT_EQ(body_of(ask(with_host("GET /", "Accept-Encoding: br;q=0, gzip\r\n"))), kPageGzip);
}

TEST_F(ServerPage, HashedFilesAreKeptForGood) {
  start(with_page());
  const std::string answer = ask(with_host("GET /core.bb.wasm", kGzip));
  EXPECT_THAT(answer, HasSubstr("Content-Type: application/wasm\r\n"));
  EXPECT_THAT(answer, HasSubstr("Cache-Control: public, max-age=31536000, immutable\r\n"));
  EXPECT_EQ(body_of(answer), "wasm in gzip");
}

TEST_F(ServerPage, WhatIsKnownIsNotSentAgain) {
  start(with_page());
  const std::string known = ask(with_host("GET /", std::string(kGzip) + "If-None-Match: \"aa-gzip\"\r\n"));
  EXPECT_THAT(known, StartsWith("HTTP/1.1 304 Not Modified\r\n"));
  EXPECT_THAT(known, HasSubstr("ETag: \"aa-gzip\""));
  EXPECT_EQ(body_of(known), "");
  EXPECT_THAT(ask(with_host("GET /", "If-None-Match: \"aa-gzip\"\r\n")), StartsWith("HTTP/1.1 200 "))
      << "what it has is compressed, and it does not say that it takes that";
}

TEST_F(ServerPage, HeadIsGetWithoutTheContent) {
  start(with_page());
  std::string get = ask(with_host("GET /core.bb.wasm", std::string(kGzip) + "Connection: close\r\n"));
  RawClient client(server_->port());
  client.send_raw(with_host("HEAD /core.bb.wasm", std::string(kGzip) + "Connection: close\r\n"));
  EXPECT_EQ(client.read_raw_to_end(), get.substr(0, get.size() - body_of(get).size()));
}

TEST_F(ServerPage, OtherMethodsAndPathsAreRefusedInASentence) {
  start(with_page());
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE"}) {
    const std::string answer = ask(with_host(method + std::string(" /")));
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 405 ")) << method;
    EXPECT_THAT(answer, HasSubstr("Allow: GET, HEAD\r\n"));
    EXPECT_EQ(body_of(answer), "The page is served by GET and HEAD only.\n");
  }
  for (const char* path : {"/core.bb", "/core.bc.wasm", "//", "/../", "/%2e%2e/etc/passwd", "/index.html",
                           "*", "http://127.0.0.1/", "/favicon.ico"})
    EXPECT_THAT(ask(with_host("GET " + std::string(path))), StartsWith("HTTP/1.1 404 ")) << path;
  EXPECT_THAT(ask("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n"), StartsWith("HTTP/1.1 403 "));
}

TEST_F(ServerPage, AServerWithoutItSaysSo) {
  start();
  const std::string answer = ask(kGetPage);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(body_of(answer), HasSubstr("built without its page"));
  EXPECT_EQ(server_->counters().refused_http, 0u) << "nobody did wrong";
}

// A token that somebody puts there by mistake is in no line of the log.
TEST_F(ServerPage, WhatFollowsAQuestionMarkIsInNoLog) {
  start(with_page());
  ask(with_host("GET /?token=secret"));
  ask(with_host("GET /nowhere?token=secret"));
  ask(with_host("POST /?token=secret"));
  EXPECT_TRUE(eventually([&] { return log_.count("'/nowhere'") == 1; }));
  EXPECT_EQ(log_.count("secret"), 0u);
}

TEST_F(ServerPage, AConnectionIsKeptForAHundredFiles) {
  start(with_page(strict_config()));
  RawClient client(server_->port());
  for (int i = 0; i < 99; ++i) {
    client.send_raw(kGetPage);
    const std::string answer = client.read_answer();
    ASSERT_EQ(body_of(answer), kPage) << i;
    ASSERT_THAT(answer, Not(HasSubstr("Connection: close"))) << i;
    if (i % 40 == 0) std::this_thread::sleep_for(std::chrono::seconds(1));  // 50 a second
  }
  client.send_raw(kGetPage);
  const std::string last = client.read_raw_to_end();
  EXPECT_EQ(body_of(last), kPage);
  EXPECT_THAT(last, HasSubstr("Connection: close\r\n"));
  EXPECT_EQ(server_->counters().connections, 1u);
}

TEST_F(ServerPage, RequestsInOnePieceAreAnsweredInTurn) {
  start(with_page());
  RawClient client(server_->port());
  client.send_raw(kGetPage + with_host("HEAD /") + with_host("GET /core.bb.wasm") +
                  with_host("GET /healthz") + kGetPage);
  const std::string text = client.read_raw_to_end();
  std::vector<std::string> bodies;
  for (size_t at = 0; (at = text.find("\r\n\r\n", at)) != std::string::npos;) {
    at += 4;
    bodies.push_back(text.substr(at, text.find("HTTP/1.1", at) - at));
  }
  EXPECT_THAT(bodies, testing::ElementsAre(kPage, "", "wasm", "ok\n")) << "nothing behind what ends it";
}

TEST_F(ServerPage, WhoeverWantsItsConnectionEndedIsObeyed) {
  start(with_page());
  for (const std::string& request : {with_host("GET /", "Connection: close\r\n"),
                                     std::string("GET / HTTP/1.0\r\nHost: 127.0.0.1\r\n\r\n")}) {
    RawClient client(server_->port());
    client.send_raw(request);
    EXPECT_EQ(body_of(client.read_raw_to_end()), kPage);
  }
}

TEST_F(ServerPage, ASessionMayBeginOnAKeptConnection) {
  NetConfig config = with_page();
  config.limits.handshake_ms = 600;
  start(config);
  RawClient client(server_->port());
  client.send_raw(kGetPage);
  EXPECT_EQ(body_of(client.read_answer()), kPage);
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  ASSERT_TRUE(client.handshake());
  std::this_thread::sleep_for(std::chrono::milliseconds(400));  // its time begins with the upgrade
  client.send(hello());
  EXPECT_TRUE(client.read_control<Welcome>());
}

TEST_F(ServerPage, AnIdleConnectionEndsWithoutAWord) {
  NetConfig config = with_page();
  config.limits.handshake_ms = 200;
  start(config);
  RawClient client(server_->port());
  client.send_raw(kGetPage);
  EXPECT_EQ(body_of(client.read_raw_to_end()), kPage);
  EXPECT_EQ(server_->counters().timeouts, 0u);
  RawClient half(server_->port());
  half.send_raw(kGetPage + "GET / HTTP/1.1\r\nHo");
  EXPECT_EQ(body_of(half.read_raw_to_end()), kPage);
  EXPECT_EQ(server_->counters().timeouts, 1u) << "a request that does not end is another thing";
}

// The deadline is one of progress: who takes little at a time gets all, who takes nothing loses the
// connection.
TEST_F(ServerPage, ASlowTakerGetsAllAndAStalledOneNothingMore) {
  NetConfig config = with_page();
  config.limits.handshake_ms = 500;
  start(config);
  const auto begin = std::chrono::steady_clock::now();
  constexpr int kReceiveBytes = 64 << 10;
  RawClient slow(server_->port(), kReceiveBytes);
  slow.send_raw(with_host("GET /large.cc.wasm"));
  constexpr size_t kParts = 48;
  for (size_t i = 0; i < kParts; ++i) {
    ASSERT_TRUE(slow.read_raw(kLargeBytes / kParts)) << i;
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  }
  EXPECT_GT(std::chrono::steady_clock::now() - begin, 2 * std::chrono::milliseconds(500));
  EXPECT_EQ(server_->counters().timeouts, 0u);
  RawClient stalled(server_->port(), kReceiveBytes);
  stalled.send_raw(with_host("GET /large.cc.wasm"));
  EXPECT_TRUE(eventually([&] { return server_->counters().timeouts == 1; }));
  EXPECT_FALSE(stalled.read_raw(kLargeBytes));
}

TEST_F(ServerPage, RequestsPerSecondOnOneConnectionToo) {
  NetConfig config = with_page(strict_config());
  config.limits.requests_per_s = 5.0;
  start(config);
  RawClient client(server_->port());
  std::string many;
  for (int i = 0; i < 50; ++i) many += kGetPage;
  client.send_raw(many);
  EXPECT_THAT(client.read_raw_to_end(), HasSubstr("HTTP/1.1 429 "));
  EXPECT_EQ(server_->counters().refused_rate, 1u);
}

// A page that is open elsewhere keeps nobody out.
TEST_F(ServerPage, IdleConnectionsGiveTheirPlaces) {
  NetConfig config = with_page(strict_config());
  config.limits.handshake_ms = 60'000;
  start(config);
  std::vector<std::unique_ptr<RawClient>> kept;
  for (int i = 0; i < 16; ++i) {
    kept.push_back(std::make_unique<RawClient>(server_->port()));
    kept.back()->send_raw(kGetPage);
    ASSERT_EQ(body_of(kept.back()->read_answer()), kPage);
  }
  RawClient newcomer(server_->port());
  newcomer.send_raw(kGetPage);
  EXPECT_EQ(body_of(newcomer.read_answer()), kPage);
  EXPECT_EQ(kept[0]->read_raw_to_end(), "") << "the one that came first";
  kept[1]->send_raw(kGetPage);
  EXPECT_EQ(body_of(kept[1]->read_answer()), kPage);
  EXPECT_EQ(server_->counters().refused_full, 0u);
}

// A proxy asks on one connection for one client after another.
TEST_F(ServerPage, EachRequestOfAProxyIsItsOwnClients) {
  NetConfig config = with_page(strict_config());
  config.loopback_trust = LoopbackTrust::Trusted;
  config.trusted_proxies = {*parse_address_range("127.0.0.1")};
  config.allowed_hosts = {"127.0.0.1"};
  config.limits.wrong_tokens = 0;
  config.limits.requests_per_s = 3.0;
  start(config);
  const auto asks_for = [](const std::string& client) { return "X-Forwarded-For: " + client + "\r\n"; };
  RawClient proxy(server_->port());
  for (const char* client : {"203.0.113.1", "203.0.113.2", "203.0.113.1", "203.0.113.2", "203.0.113.1"}) {
    proxy.send_raw(with_host("GET /", asks_for(client)));
    EXPECT_EQ(body_of(proxy.read_answer()), kPage) << client;
  }
  proxy.send_raw(with_host("GET /metrics", asks_for("203.0.113.9") + "Authorization: Bearer wrong\r\n"));
  EXPECT_THAT(proxy.read_answer(), StartsWith("HTTP/1.1 401 "));
  EXPECT_EQ(log_.count("refused 203.0.113.9 token"), 1u) << "the wrong token is its own";
}

// Whatever is asked, something is said and the next one is served.
TEST_F(ServerPage, HostileRequestsHarmNobody) {
  start(with_page());
  const std::string long_field(7'000, ',');
  const std::string cases[] = {"Accept-Encoding: " + long_field + "\r\n",
                               "If-None-Match: " + long_field + "\r\n",
                               "Accept-Encoding: gzip\r\nAccept-Encoding: gzip;q=0\r\n",
                               "Range: bytes=0-0,1-1,2-2,3-,-5\r\n",
                               "If-None-Match: \"\r\n",
                               "Expect: 100-continue\r\n",
                               "Connection: keep-alive, close, upgrade\r\n",
                               "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: x\r\n",
                               "Transfer-Encoding: chunked\r\n",
                               "Content-Length: -1\r\n",
                               "Content-Length: 1\r\nContent-Length: 2\r\n",
                               "\x01: \x02\r\n",
                               " folded: yes\r\n"};
  for (const std::string& fields : cases)
    EXPECT_THAT(ask(with_host("GET /", fields)), StartsWith("HTTP/1.1 ")) << fields.substr(0, 40);
  for (const char* line :
       {"GET /\x80\xff HTTP/1.1", "GET  / HTTP/1.1", "GET / HTTP/9.9", "GET /", "\r\n\r\nGET / HTTP/1.1"}) {
    RawClient client(server_->port());
    client.send_raw(std::string(line) + "\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n");
    (void)client.read_raw_to_end();
  }
  EXPECT_EQ(body_of(ask(kGetPage)), kPage);
}

}  // namespace
}  // namespace strandcast::server_page_test
