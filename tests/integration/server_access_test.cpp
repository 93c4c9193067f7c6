// Who is let in as what, and what an admin may do: NetServer against raw clients.
#include <map>

#include "tests/support/sample_messages.h"
#include "tests/support/server_net_fixture.h"

namespace strandcast::server_access_test {
namespace {

using test::code;
using test::RawClient;

const std::vector<AccessToken> kTokens = {{"viewer-token-0000", Grant::Viewer},
                                          {"controller-token-1", Grant::Controller},
                                          {"source-token-2222", Grant::Source},
                                          {"admin-token-33333", Grant::Admin}};
constexpr Role kRoles[] = {Role::Viewer, Role::Controller, Role::Source, Role::Admin};

class ServerAccess : public test::ServerNet {
 protected:
  void start_with_tokens(LoopbackTrust trust = LoopbackTrust::Trusted) {
    NetConfig config;
    config.tokens = kTokens;
    config.loopback_trust = trust;
    config.limits.connections_per_s = 1e6;
    config.limits.wrong_tokens = 1'000;
    start(config);
  }
  static Hello hello_as(Role role, const std::string& token) {
    Hello message = hello(role, token);
    message.name = to_string(role);
    return message;
  }
  std::unique_ptr<RawClient> join_as(Role role) {
    return join(hello_as(role, kTokens[static_cast<size_t>(role)].secret));
  }
};

TEST_F(ServerAccess, EveryTokenAndRole) {
  start_with_tokens();
  for (const AccessToken& token : kTokens)
    for (const Role role : kRoles) {
      RawClient client(server_->port());
      ASSERT_TRUE(client.handshake());
      client.send(hello_as(role, token.secret));
      if (may_be(token.grant, role)) {
        const auto welcome = client.read_control<Welcome>();
        ASSERT_TRUE(welcome) << to_string(token.grant) << " as " << to_string(role);
        EXPECT_EQ(welcome->role, role);
        continue;
      }
      const RawClient::End end = client.read_end();
      EXPECT_EQ(end.close_code, code(CloseCode::Refused))
          << to_string(token.grant) << " as " << to_string(role);
      EXPECT_NE(end.reason.find(to_string(role)), std::string::npos) << end.reason;
    }
}

TEST_F(ServerAccess, WrongTokensAreRefusedAndNotRepeated) {
  start_with_tokens();
  for (const char* token :
       {"", "viewer-token-000", "viewer-token-0000viewer-token-0000", "viewer-token-0001"}) {
    RawClient client(server_->port());
    ASSERT_TRUE(client.handshake());
    client.send(hello(Role::Viewer, token));
    const RawClient::End end = client.read_end();
    EXPECT_EQ(end.close_code, code(CloseCode::Unauthorized));
    EXPECT_EQ(end.reason.find("-token-"), std::string::npos) << "the token must not leak";
  }
  EXPECT_EQ(server_->counters().refused_token, 4u);
}

TEST_F(ServerAccess, EveryMessageAndRole) {
  start_with_tokens();
  app_.publish_next();
  for (const ClientMessage& message : sample_client_messages())
    for (const Role role : kRoles) {
      auto client = join_as(role);
      client->send(message);
      if (may_send(role, message)) {
        client->send(Ping{42});
        EXPECT_TRUE(client->read_control<Pong>()) << to_string(role) << " sends message " << message.index();
        continue;
      }
      const RawClient::End end = client->read_end();
      EXPECT_EQ(end.close_code, code(CloseCode::Policy)) << to_string(role) << " sends " << message.index();
      EXPECT_NE(end.reason.find(to_string(role)), std::string::npos) << end.reason;
    }
  // A source and an admin, each once; a controller and an admin, each once.
  EXPECT_EQ(app_.motion, 10u);
  EXPECT_EQ(app_.wind, 10u);
  EXPECT_EQ(app_.commands, 2u);
  EXPECT_EQ(app_.parameters, 2u);
}

TEST_F(ServerAccess, WithoutTokensNobodyIsAdmin) {
  start();
  RawClient client(server_->port());
  ASSERT_TRUE(client.handshake());
  client.send(hello(Role::Admin));
  EXPECT_EQ(client.read_end().close_code, code(CloseCode::Refused));
  for (const Role role : {Role::Viewer, Role::Controller, Role::Source})
    EXPECT_NE(join(hello(role)), nullptr);
}

TEST_F(ServerAccess, AnAdminSeesEverySessionAndNoToken) {
  start_with_tokens();
  auto viewer = join_as(Role::Viewer);
  auto source = join_as(Role::Source);
  auto admin = join_as(Role::Admin);
  admin->send(AdminCommand{AdminAction::ListSessions, 0});
  const auto list = admin->read_control<SessionList>();
  ASSERT_TRUE(list);
  ASSERT_EQ(list->sessions.size(), 3u);
  const Role roles[] = {Role::Viewer, Role::Source, Role::Admin};
  for (size_t i = 0; i < 3; ++i) {
    const SessionInfo& session = list->sessions[i];
    EXPECT_EQ(session.role, roles[i]);
    EXPECT_EQ(session.name, to_string(roles[i]));
    EXPECT_EQ(session.address, "127.0.0.1");
    EXPECT_GT(session.sent_bytes, 0u) << "a Welcome at least";
    EXPECT_GE(session.connected_s, 0.0);
  }
  const auto bytes = encode(ServerMessage(*list));
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  EXPECT_EQ(text.find("-token-"), std::string::npos);
}

TEST_F(ServerAccess, AnAdminEndsOneSession) {
  start_with_tokens();
  auto victim = join_as(Role::Viewer);
  auto other = join_as(Role::Viewer);
  auto admin = join_as(Role::Admin);
  admin->send(AdminCommand{AdminAction::ListSessions, 0});
  const auto list = admin->read_control<SessionList>();
  ASSERT_TRUE(list);
  admin->send(AdminCommand{AdminAction::Kick, list->sessions[0].id});
  const RawClient::End end = victim->read_end();
  EXPECT_EQ(end.close_code, code(CloseCode::Kicked));
  EXPECT_FALSE(end.reason.empty());
  auto notice = admin->read_control<Notice>();
  ASSERT_TRUE(notice);
  EXPECT_FALSE(notice->is_error) << notice->text;
  other->send(Ping{1});
  EXPECT_TRUE(other->read_control<Pong>());
  // Nobody has this number now, and none ever had the other.
  for (const uint64_t session : {list->sessions[0].id, uint64_t{1} << 60}) {
    admin->send(AdminCommand{AdminAction::Kick, session});
    notice = admin->read_control<Notice>();
    ASSERT_TRUE(notice);
    EXPECT_TRUE(notice->is_error);
  }
  admin->send(AdminCommand{AdminAction::Kick, list->sessions[2].id});
  EXPECT_EQ(admin->read_end().close_code, code(CloseCode::Kicked)) << "itself, too";
}

TEST_F(ServerAccess, AnAdminEndsTheServer) {
  start_with_tokens();
  auto admin = join_as(Role::Admin);
  admin->send(AdminCommand{AdminAction::ShutDown, 0});
  const auto notice = admin->read_control<Notice>();
  ASSERT_TRUE(notice);
  EXPECT_FALSE(notice->is_error);
  EXPECT_TRUE(eventually([&] { return app_.shut_downs == 1; }));
}

// What a file of tokens that was read again says counts for who is there already, too.
TEST_F(ServerAccess, SessionsGoWithTheirTokens) {
  start_with_tokens();
  auto viewer = join_as(Role::Viewer);
  auto controller = join_as(Role::Controller);
  auto watching = join(hello_as(Role::Viewer, kTokens[1].secret));  // by the controller's token
  auto source = join_as(Role::Source);
  auto admin = join_as(Role::Admin);
  ASSERT_TRUE(server_->set_tokens({{kTokens[1].secret, Grant::Viewer},
                                   {kTokens[2].secret, Grant::Source, 1},  // 1970
                                   kTokens[3],
                                   {"another-viewer-444", Grant::Viewer}}));
  const RawClient::End gone = viewer->read_end();
  EXPECT_EQ(gone.close_code, code(CloseCode::Unauthorized));
  EXPECT_EQ(gone.reason, "This session's token was taken back: ask for a new one.");
  const RawClient::End lowered = controller->read_end();
  EXPECT_EQ(lowered.close_code, code(CloseCode::Refused));
  EXPECT_EQ(lowered.reason, "This session's token is good for viewer now, no longer for a controller.");
  const RawClient::End expired = source->read_end();
  EXPECT_EQ(expired.close_code, code(CloseCode::Unauthorized));
  EXPECT_EQ(expired.reason, "This session's token has expired: ask for a new one.");
  for (RawClient* stays : {watching.get(), admin.get()}) {
    stays->send(Ping{1});
    EXPECT_TRUE(stays->read_control<Pong>());
  }
  EXPECT_EQ(app_.joined_count(), 2u);
  EXPECT_EQ(server_->counters().refused_token, 0u) << "it is nobody's guess";
}

TEST_F(ServerAccess, ASessionEndsWhenItsTokenExpires) {
  start_with_tokens();
  std::unique_ptr<RawClient> client;
  // On a machine that stands still for so long it expires before it was used.
  const bool has_joined = eventually([&] {
    std::vector<AccessToken> tokens = kTokens;
    tokens[0].expires_unix_s = unix_time_s() + 2;
    EXPECT_TRUE(server_->set_tokens(tokens));
    client = std::make_unique<RawClient>(server_->port());
    EXPECT_TRUE(client->handshake());
    client->send(hello_as(Role::Viewer, kTokens[0].secret));
    return client->read_control<Welcome>().has_value();
  });
  ASSERT_TRUE(has_joined);
  const RawClient::End end = client->read_end();
  EXPECT_EQ(end.close_code, code(CloseCode::Unauthorized));
  EXPECT_EQ(end.reason, "This session's token has expired: ask for a new one.");
}

std::string metrics_with(uint16_t port, const std::string& header) {
  RawClient client(port);
  client.send_raw("GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n" + header + "\r\n");
  return client.read_raw_to_end();
}

TEST_F(ServerAccess, MetricsNeedATokenWhereLoopbackIsNotTrusted) {
  start_with_tokens(LoopbackTrust::LikeAllOthers);
  const uint16_t port = server_->port();
  for (const AccessToken& token : kTokens) {
    const std::string answer = metrics_with(port, "Authorization: Bearer " + token.secret + "\r\n");
    EXPECT_NE(answer.find("200 OK"), std::string::npos) << to_string(token.grant);
    EXPECT_NE(answer.find("strandcast_net_connections_total"), std::string::npos);
  }
  for (const std::string& header :
       {std::string(), std::string("Authorization: Bearer \r\n"),
        std::string("Authorization: Bearer wrong\r\n"), "Authorization: Basic " + kTokens[0].secret + "\r\n",
        "Authorization: " + kTokens[0].secret + "\r\n",
        "Authorization: Bearer " + kTokens[0].secret + "x\r\n"}) {
    const std::string answer = metrics_with(port, header);
    EXPECT_NE(answer.find("401"), std::string::npos) << header;
    EXPECT_NE(answer.find("WWW-Authenticate: Bearer"), std::string::npos);
    EXPECT_EQ(answer.find("strandcast_net"), std::string::npos);
  }
  EXPECT_NE(test::http_get(port, "/healthz").find("200 OK"), std::string::npos) << "free for load balancers";
}

TEST_F(ServerAccess, MetricsAreFreeOnTrustedLoopback) {
  start_with_tokens();
  EXPECT_NE(metrics_with(server_->port(), "").find("200 OK"), std::string::npos);
}

TEST(ServerAccessListen, UntrustedLoopbackNeedsTokens) {
  test::FakeApp app;
  NetConfig config;
  config.port = 0;
  config.loopback_trust = LoopbackTrust::LikeAllOthers;
  EXPECT_FALSE(NetServer::listen(config, app));
  config.tokens = kTokens;
  EXPECT_TRUE(NetServer::listen(config, app));
}

}  // namespace
}  // namespace strandcast::server_access_test
