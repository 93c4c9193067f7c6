// TLS on the server's only port, with the product's own client and with raw ones.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/net/http_get.h"
#include "common/client/reconnect_policy.h"
#include "common/client/viewer_client.h"
#include "common/net/tls_private.h"
#include "tests/support/proxy_header.h"
#include "tests/support/server_net_fixture.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test_certificate.h"
#include "tests/tools/load/load_viewers.h"

namespace strandcast::tls_test {
namespace {

/// What OpenSSL gives as the reason why a client that knows this version of TLS only, and every cipher, gets
/// no connection; 0 when it gets one. `begin` is sent in front of everything.
int reason_of_refusal(uint16_t port, int version, const std::string& begin = {}) {
  const std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)> context(SSL_CTX_new(TLS_client_method()),
                                                                  SSL_CTX_free);
  SSL_CTX_set_security_level(context.get(), 0);
  EXPECT_EQ(SSL_CTX_set_cipher_list(context.get(), "ALL:@SECLEVEL=0"), 1);
  EXPECT_EQ(SSL_CTX_set_min_proto_version(context.get(), version), 1);
  EXPECT_EQ(SSL_CTX_set_max_proto_version(context.get(), version), 1);
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(send(descriptor, begin.data(), begin.size(), 0), static_cast<ssize_t>(begin.size()));
  const std::unique_ptr<SSL, decltype(&SSL_free)> connection(SSL_new(context.get()), SSL_free);
  SSL_set_fd(connection.get(), descriptor);
  ERR_clear_error();
  const int reason = SSL_connect(connection.get()) == 1 ? 0 : ERR_GET_REASON(ERR_peek_error());
  close(descriptor);
  return reason;
}

using SslContext = std::unique_ptr<SSL_CTX, decltype(&SSL_CTX_free)>;

/// Takes away what OpenSSL itself has against old versions: its security level, and ciphers that they lack.
void allow_all(SSL_CTX* context) {
  SSL_CTX_set_security_level(context, 0);
  EXPECT_EQ(SSL_CTX_set_cipher_list(context, "ALL:@SECLEVEL=0"), 1);
}

/// A side that speaks this version of TLS only.
SslContext only_version(int version, const TlsFiles& files) {
  SslContext context(SSL_CTX_new(TLS_method()), SSL_CTX_free);
  allow_all(context.get());
  EXPECT_EQ(SSL_CTX_set_min_proto_version(context.get(), version), 1);
  EXPECT_EQ(SSL_CTX_set_max_proto_version(context.get(), version), 1);
  EXPECT_EQ(SSL_CTX_use_certificate_file(context.get(), files.certificate.c_str(), SSL_FILETYPE_PEM), 1);
  EXPECT_EQ(SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM), 1);
  return context;
}

/// A handshake in memory.
bool can_shake_hands(SSL_CTX* server, SSL_CTX* client) {
  const std::unique_ptr<SSL, decltype(&SSL_free)> accepts(SSL_new(server), SSL_free);
  const std::unique_ptr<SSL, decltype(&SSL_free)> connects(SSL_new(client), SSL_free);
  BIO* to_client = nullptr;
  BIO* to_server = nullptr;
  EXPECT_EQ(BIO_new_bio_pair(&to_client, 0, &to_server, 0), 1);
  SSL_set_bio(accepts.get(), to_client, to_client);
  SSL_set_bio(connects.get(), to_server, to_server);
  SSL_set_accept_state(accepts.get());
  SSL_set_connect_state(connects.get());
  constexpr int kTurns = 10;
  bool is_accepted = false, is_connected = false;
  for (int i = 0; i < kTurns && !(is_accepted && is_connected); ++i) {
    is_connected = SSL_do_handshake(connects.get()) == 1;
    is_accepted = SSL_do_handshake(accepts.get()) == 1;
  }
  return is_accepted && is_connected;
}

using test::CertificatePlan;
using test::make_certificate;
using test::RawClient;
using testing::HasSubstr;

constexpr const char* kToken = "0123456789abcdef";
constexpr std::chrono::milliseconds kWait{100};

class Tls : public test::ServerNet {
 protected:
  NetConfig with_certificate(const CertificatePlan& plan = {}) {
    NetConfig config;
    config.tls = files_ = make_certificate(folder_.path(), "server", plan);
    return config;
  }
  static NetConfig far_away(NetConfig config) {
    config.loopback_trust = LoopbackTrust::LikeAllOthers;
    config.tokens = {{kToken, Grant::AllButAdmin}};
    config.limits.connections_per_s = 1e6;
    return config;
  }
  ClientConfig client_config(const std::string& host = "127.0.0.1") const {
    ClientConfig config;
    config.address = {host, server_->port(), true};
    config.tls_authorities = files_.certificate;
    config.hello.name = "tls";
    config.hello.token = kToken;
    return config;
  }
  static void expect_final(const Error& error, ErrorCode code, const char* part) {
    EXPECT_EQ(error.code, code) << error.to_string();
    EXPECT_THAT(error.to_string(), HasSubstr(part));
    EXPECT_EQ(ReconnectPolicy(1).on_lost(error, 1), std::nullopt) << "trying again cannot help";
  }

  TemporaryFolder folder_;
  TlsFiles files_;
};

TEST_F(Tls, CarriesEveryByteBothWays) {
  app_.asset_bytes = 3'000'000;  // many records
  app_.frame_bytes = 100'000;
  start(far_away(with_certificate()));
  app_.publish_next();
  ClientConfig config = client_config();
  config.hello.role = Role::Controller;
  auto client = ViewerClient::connect(config);
  ASSERT_TRUE(client.ok()) << client.error().to_string();
  EXPECT_EQ((*client)->welcome().scene_name, "fake");
  bool has_asset = false;
  uint32_t last_sequence = 0;
  for (int i = 0; i < 1'000 && last_sequence < 20; ++i) {
    app_.publish_next();
    for (const ClientEvent& event : (*client)->wait(kWait)) {
      const auto* media = std::get_if<MediaEvent>(&event);
      ASSERT_FALSE(std::holds_alternative<ClosedEvent>(event))
          << std::get<ClosedEvent>(event).error.to_string();
      if (media == nullptr) continue;
      for (const std::byte byte : media->payload()) ASSERT_EQ(byte, std::byte{0x5a});
      if (media->header.opcode == Opcode::Asset) {
        has_asset = true;
        EXPECT_EQ(media->payload().size(), app_.asset_bytes);
      } else {
        EXPECT_EQ(media->payload().size(), app_.frame_bytes);
        last_sequence = media->header.sequence;
      }
    }
  }
  EXPECT_TRUE(has_asset);
  EXPECT_GE(last_sequence, 20u);
  for (int i = 0; i < 50; ++i) EXPECT_TRUE((*client)->send(SetParameter{std::string(4'000, 'a')}).ok());
  EXPECT_TRUE(eventually([&] { return app_.parameters == 50; }));
}

TEST_F(Tls, NamesAreChecked) {
  start(with_certificate());
  EXPECT_TRUE(ViewerClient::connect(client_config("localhost")).ok());
  server_->stop();
  start(with_certificate({"DNS:hair.example,IP:10.0.0.7", 86'400}));
  for (const char* host : {"127.0.0.1", "localhost"}) {
    const auto client = ViewerClient::connect(client_config(host));
    ASSERT_FALSE(client.ok()) << host;
    expect_final(client.error(), ErrorCode::Unauthorized, "mismatch");
  }
}

TEST_F(Tls, CertificatesOfNobodyKnownAreRefused) {
  start(with_certificate());
  ClientConfig config = client_config();
  config.tls_authorities.clear();  // those of the system
  auto client = ViewerClient::connect(config);
  ASSERT_FALSE(client.ok());
  expect_final(client.error(), ErrorCode::Unauthorized, "--tls-ca");
  config.tls_authorities = make_certificate(folder_.path(), "other").certificate;
  client = ViewerClient::connect(config);
  ASSERT_FALSE(client.ok());
  expect_final(client.error(), ErrorCode::Unauthorized, "certificate");
  config.tls_authorities = folder_.path() / "none";
  client = ViewerClient::connect(config);
  ASSERT_FALSE(client.ok());
  expect_final(client.error(), ErrorCode::Unsupported, "none");
  EXPECT_EQ(app_.joined_count(), 0u);
}

TEST_F(Tls, BeginsBehindAPROXYHeader) {
  NetConfig config = far_away(with_certificate());
  config.trusted_proxies = {*parse_address_range("127.0.0.1")};
  config.proxy_protocol = ProxyProtocol::Version2;
  start(config);
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION})
    EXPECT_EQ(reason_of_refusal(server_->port(), version, test::proxy_v4(9)), 0) << version;
}

TEST_F(Tls, CertificatesThatAreOverAreRefused) {
  start(with_certificate({"IP:127.0.0.1", -3'600}));
  const auto client = ViewerClient::connect(client_config());
  ASSERT_FALSE(client.ok());
  expect_final(client.error(), ErrorCode::Unauthorized, "expired");
}

TEST_F(Tls, AServerWithoutTlsIsTold) {
  start();
  files_ = make_certificate(folder_.path(), "server");
  const auto client = ViewerClient::connect(client_config());
  ASSERT_FALSE(client.ok());
  expect_final(client.error(), ErrorCode::Unsupported, "TLS");
}

TEST_F(Tls, PlainConnectionsAreForTrustedLoopbackOnly) {
  start(with_certificate());
  EXPECT_NE(test::http_get(server_->port(), "/healthz").find("200 OK"), std::string::npos);
  EXPECT_NE(join(), nullptr);
  server_->stop();
  NetConfig only = with_certificate();
  only.plain_access = PlainAccess::Nobody;
  for (const NetConfig& config : {only, far_away(with_certificate())}) {
    start(config);
    const std::string answer = test::http_get(server_->port(), "/healthz");
    EXPECT_NE(answer.find("426"), std::string::npos) << answer;
    EXPECT_NE(answer.find("wss://"), std::string::npos);
    RawClient raw(server_->port());
    EXPECT_FALSE(raw.handshake());
    EXPECT_EQ(raw.http_status(), 426);
    ClientConfig plain = client_config();
    plain.address.is_tls = false;
    const auto client = ViewerClient::connect(plain);
    ASSERT_FALSE(client.ok());
    expect_final(client.error(), ErrorCode::Unsupported, "--tls");
    EXPECT_EQ(server_->counters().refused_tls, 3u);
    server_->stop();
  }
}

TEST_F(Tls, HttpGoesOverItToo) {
  start(far_away(with_certificate()));
  const Address address{"127.0.0.1", server_->port(), true};
  constexpr std::chrono::milliseconds kTimeout{30'000};
  auto answer = http_get(address, "/metrics", kTimeout, {files_.certificate, kToken});
  ASSERT_TRUE(answer.ok()) << answer.error().to_string();
  EXPECT_EQ(answer->status, 200u);
  EXPECT_THAT(answer->body, HasSubstr("strandcast_net_refused_tls_total"));
  answer = http_get(address, "/metrics", kTimeout, {files_.certificate, {}});
  ASSERT_TRUE(answer.ok()) << answer.error().to_string();
  EXPECT_EQ(answer->status, 401u);
  answer = http_get(address, "/healthz", kTimeout);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::Unauthorized) << answer.error().to_string();
}

// A file of many records, and another one on the same connection by whoever keeps it.
TEST_F(Tls, ThePageGoesOverItToo) {
  static const std::string large(900'000, 'x');
  static const PageFile page[] = {{"/", "text/html", "aa", PageFileName::Fixed, large, large, large}};
  NetConfig config = far_away(with_certificate());
  config.page = page;
  start(config);
  const auto answer = http_get({"127.0.0.1", server_->port(), true}, "/", std::chrono::milliseconds(30'000),
                               {files_.certificate, {}});
  ASSERT_TRUE(answer.ok()) << answer.error().to_string();
  EXPECT_EQ(answer->status, 200u);
  EXPECT_EQ(answer->body.size(), large.size());
  EXPECT_EQ(server_->counters().refused_http, 0u) << "whoever goes then has done nothing wrong";
  EXPECT_THAT(test::http_get(server_->port(), "/"), HasSubstr("426 Upgrade Required"))
      << "and over nothing else";
}

TEST_F(Tls, BrokenAndUnfinishedHandshakesEndThatConnectionOnly) {
  NetConfig config = with_certificate();
  config.limits.handshake_ms = 300;
  start(config);
  auto healthy = join();
  RawClient garbage(server_->port());
  garbage.send_raw(std::string("\x16\x03\x01\x00\x05hello", 10));
  (void)garbage.read_raw_to_end();
  EXPECT_TRUE(eventually([&] { return server_->counters().refused_tls == 1; }));
  RawClient half(server_->port());
  half.send_raw(std::string("\x16\x03\x01\x02\x00\x01", 6));
  EXPECT_EQ(half.read_raw_to_end(), "") << "closed when its time is over";
  RawClient silent(server_->port());
  EXPECT_EQ(silent.read_raw_to_end(), "");
  EXPECT_TRUE(eventually([&] { return server_->counters().timeouts == 2; }));
  healthy->send(Ping{1});
  EXPECT_TRUE(healthy->read_control<Pong>());
}

TEST_F(Tls, OldVersionsAreRefused) {
  start(with_certificate());
  auto healthy = join();
  for (const int version : {TLS1_VERSION, TLS1_1_VERSION})
    EXPECT_EQ(reason_of_refusal(server_->port(), version), SSL_R_TLSV1_ALERT_PROTOCOL_VERSION) << version;
  EXPECT_TRUE(eventually([&] { return server_->counters().refused_tls == 2; }));
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION})
    EXPECT_EQ(reason_of_refusal(server_->port(), version), 0) << version;
  healthy->send(Ping{1});
  EXPECT_TRUE(healthy->read_control<Pong>()) << "the others are served on";
}

TEST_F(Tls, ManyViewersOfTheLoadProgramComeOverIt) {
  app_.asset_bytes = 300'000;  // many records
  start(far_away(with_certificate()));
  app_.publish_next();
  load::LoadViewers viewers({"127.0.0.1", server_->port(), kToken, load::Encryption{files_.certificate}});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(viewers.join({}).ok());
  for (int i = 0; i < 1'000 && viewers.watching_count() < 4; ++i) {
    app_.publish_next();
    viewers.run_for(10);
  }
  EXPECT_EQ(viewers.watching_count(), 4u);
  EXPECT_EQ(viewers.measures().joined, 4u);
  EXPECT_EQ(viewers.measures().chain_errors, 0u);
  const load::LoadConfig distrusting{"127.0.0.1", server_->port(), kToken,
                                     load::Encryption{make_certificate(folder_.path(), "other").certificate}};
  load::LoadViewers others(distrusting);
  ASSERT_TRUE(others.join({}).ok());
  for (int i = 0; i < 1'000 && others.open_count() > 0; ++i) others.run_for(10);
  EXPECT_EQ(others.open_count(), 0u) << "a certificate of nobody known";
  EXPECT_EQ(others.measures().joined, 0u);
}

TEST_F(Tls, ANewCertificateIsTakenWithoutARestart) {
  start(with_certificate());
  auto early = ViewerClient::connect(client_config());
  ASSERT_TRUE(early.ok()) << early.error().to_string();
  const TlsFiles fresh = make_certificate(folder_.path(), "fresh");
  const auto old_certificate = folder_.path() / "old.crt";
  std::filesystem::copy(files_.certificate, old_certificate);
  const auto replace = [](const std::filesystem::path& from, const std::filesystem::path& to) {
    std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing);
  };
  replace(fresh.key, files_.key);
  const Status mismatch = server_->reload_tls();
  ASSERT_FALSE(mismatch) << "a key that does not fit";
  ClientConfig with_old = client_config();
  with_old.tls_authorities = old_certificate;
  EXPECT_TRUE(ViewerClient::connect(with_old).ok()) << "the old one stays";
  replace(fresh.certificate, files_.certificate);
  ASSERT_TRUE(server_->reload_tls());
  EXPECT_TRUE(ViewerClient::connect(client_config()).ok());
  EXPECT_FALSE(ViewerClient::connect(with_old).ok());
  EXPECT_TRUE((*early)->send(Ping{1}).ok()) << "who is there stays";
}

TEST_F(Tls, StopSaysGoodbyeOverIt) {
  start(with_certificate());
  auto client = ViewerClient::connect(client_config());
  ASSERT_TRUE(client.ok()) << client.error().to_string();
  server_->stop();
  std::optional<Error> end;
  for (int i = 0; i < 300 && !end; ++i)
    for (const ClientEvent& event : (*client)->wait(kWait))
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) end = closed->error;
  ASSERT_TRUE(end);
  EXPECT_THAT(end->to_string(), HasSubstr("stopping"));
}

TEST(TlsContexts, RefuseOldVersionsEvenWhereOpenSslAllowsThem) {
  const TemporaryFolder folder;
  const TlsFiles files = make_certificate(folder.path(), "server");
  const auto server = make_server_tls(files);
  const auto client = make_client_tls(files.certificate);
  ASSERT_TRUE(server.ok() && client.ok());
  for (const TlsContextPtr& ours : {*server, *client}) allow_all(ours->ssl.native_handle());
  for (const int version : {TLS1_VERSION, TLS1_1_VERSION, TLS1_2_VERSION, TLS1_3_VERSION}) {
    const SslContext other = only_version(version, files);
    EXPECT_TRUE(can_shake_hands(other.get(), other.get())) << version << " as such";
    const bool is_new = version >= TLS1_2_VERSION;
    EXPECT_EQ(can_shake_hands((*server)->ssl.native_handle(), other.get()), is_new) << version;
    EXPECT_EQ(can_shake_hands(other.get(), (*client)->ssl.native_handle()), is_new) << version;
  }
}

TEST(TlsFilesOfServer, AreReadWithCare) {
  TemporaryFolder folder;
  const TlsFiles good = make_certificate(folder.path(), "good");
  const TlsFiles other = make_certificate(folder.path(), "other");
  EXPECT_TRUE(make_server_tls(good));
  for (const mode_t mode : {0644, 0604, 0660, 0602}) {
    ASSERT_EQ(chmod(good.key.c_str(), mode), 0);
    const auto open_to_others = make_server_tls(good);
    ASSERT_FALSE(open_to_others) << mode;
    EXPECT_THAT(open_to_others.error().to_string(), HasSubstr("chmod 600"));
  }
  ASSERT_EQ(chmod(good.key.c_str(), 0640), 0);
  EXPECT_TRUE(make_server_tls(good)) << "a group for keys is usual";
  for (const TlsFiles& bad :
       {TlsFiles{good.certificate, other.key}, TlsFiles{good.certificate, folder.path() / "no"},
        TlsFiles{folder.path() / "no", good.key}, TlsFiles{good.key, good.key}}) {
    const auto made = make_server_tls(bad);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::BadInput);
    EXPECT_THAT(made.error().to_string(), HasSubstr(folder.path().string()));
  }
}

}  // namespace
}  // namespace strandcast::tls_test
