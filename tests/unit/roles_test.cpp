// What tokens are good for and what roles may send: every combination.
#include "server/net/roles.h"

#include <gtest/gtest.h>

#include <map>

#include "tests/support/sample_messages.h"

namespace strandcast::roles_test {
namespace {

constexpr Role kRoles[] = {Role::Viewer, Role::Controller, Role::Source, Role::Admin};

TEST(Roles, EveryGrantAndRole) {
  // In the order of kRoles.
  const std::map<Grant, std::string> expected = {{Grant::Viewer, "yes no no no"},
                                                 {Grant::Controller, "yes yes no no"},
                                                 {Grant::Source, "no no yes no"},
                                                 {Grant::AllButAdmin, "yes yes yes no"},
                                                 {Grant::Admin, "yes yes yes yes"}};
  for (const auto& [grant, row] : expected) {
    std::string found;
    for (const Role role : kRoles) found += may_be(grant, role) ? " yes" : " no";
    EXPECT_EQ(found.substr(1), row) << to_string(grant);
  }
}

TEST(Roles, EveryMessageAndRole) {
  // One row per kind of message, in the order of ClientMessage.
  const std::vector<std::string> expected = {
      "no no no no",    "no no yes yes",   "no no yes yes", "yes yes no yes", "yes yes no yes",
      "yes yes no yes", "yes yes yes yes", "no yes no yes", "no yes no yes",  "no no no yes",
      "yes yes no yes", "yes yes no yes",  "no yes no yes", "no yes no yes",  "yes yes no yes",
      "no yes no yes",  "yes yes no yes",  "no yes no yes", "yes yes no yes"};
  const auto messages = sample_client_messages();
  ASSERT_EQ(messages.size(), expected.size());
  for (size_t i = 0; i < messages.size(); ++i) {
    ASSERT_EQ(messages[i].index(), i) << "one sample of every kind";
    std::string found;
    for (const Role role : kRoles) found += may_send(role, messages[i]) ? " yes" : " no";
    EXPECT_EQ(found.substr(1), expected[i]) << "message " << i;
  }
}

TEST(Roles, TokenMustMatchExactly) {
  EXPECT_TRUE(is_token_equal("secret", "secret"));
  EXPECT_FALSE(is_token_equal("secret", "secre"));
  EXPECT_FALSE(is_token_equal("secret", "secretsecret")) << "a repetition is no match";
  EXPECT_FALSE(is_token_equal("secret", "Secret"));
  EXPECT_FALSE(is_token_equal("secret", ""));
  EXPECT_TRUE(is_token_equal("", ""));
}

TEST(Roles, TheRightTokenIsFoundWhereverItStands) {
  const std::vector<AccessToken> tokens = {
      {"aaaa", Grant::Viewer}, {"bbbb", Grant::Controller}, {"bbba", Grant::Source}, {"cccc", Grant::Admin}};
  for (const AccessToken& token : tokens) EXPECT_EQ(find_grant(tokens, token.secret), token.grant);
  for (const char* wrong : {"", "a", "aaaab", "aaab", "dddd", "aaaabbbb"})
    EXPECT_EQ(find_grant(tokens, wrong), std::nullopt) << wrong;
  EXPECT_EQ(find_grant({}, ""), std::nullopt);
}

TEST(Roles, WithoutTokensAllButAdminIsFree) {
  for (const Role role : kRoles) {
    Hello hello;
    hello.role = role;
    EXPECT_EQ(check_role({}, hello).ok(), role != Role::Admin) << to_string(role);
  }
}

TEST(Roles, RefusalsSayWhatIsMissingAndNoToken) {
  const std::vector<AccessToken> tokens = {{"0123456789abcdef", Grant::Viewer}};
  Hello hello;
  hello.token = "0123456789abcdee";
  const Status wrong = check_role(tokens, hello);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::Unauthorized);
  hello.token = tokens[0].secret;
  EXPECT_TRUE(check_role(tokens, hello));
  hello.role = Role::Controller;
  const Status beyond = check_role(tokens, hello);
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().code, ErrorCode::Unsupported) << "the token as such is right";
  EXPECT_NE(beyond.error().message.find("good for viewer, not for a controller"), std::string::npos);
  for (const Status& status : {wrong, beyond})
    EXPECT_EQ(status.error().to_string().find("0123"), std::string::npos);
}

TEST(Roles, ATokenEndsWithItsTime) {
  constexpr int64_t kEndS = 1'900'000'000;
  const std::vector<AccessToken> tokens = {{"0123456789abcdef", Grant::Viewer, kEndS}};
  Hello hello;
  hello.token = tokens[0].secret;
  EXPECT_TRUE(check_role(tokens, hello, kEndS - 1));
  EXPECT_EQ(find_grant(tokens, hello.token, kEndS - 1), Grant::Viewer);
  EXPECT_EQ(find_grant(tokens, hello.token, kEndS), std::nullopt);
  const Status late = check_role(tokens, hello, kEndS);
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::Unauthorized);
  EXPECT_EQ(late.error().message, "This token has expired: ask for a new one.");
}

TEST(Roles, ASessionStaysAsLongAsItsTokenGivesItsRole) {
  constexpr int64_t kEndS = 1'900'000'000;
  const std::vector<AccessToken> tokens = {{"0123456789abcdef", Grant::Controller, kEndS},
                                           {"fedcba9876543210", Grant::Admin}};
  Hello hello;
  hello.token = tokens[0].secret;
  hello.role = Role::Controller;
  EXPECT_TRUE(check_stay(tokens, hello, kEndS - 1));
  EXPECT_TRUE(check_stay({}, hello, kEndS)) << "a server without tokens never had one";
  EXPECT_EQ(expiry_of(tokens, hello.token), kEndS);
  EXPECT_EQ(expiry_of(tokens, tokens[1].secret), 0);
  EXPECT_EQ(expiry_of(tokens, "no token of these"), 0);
  const auto why = [&](const std::vector<AccessToken>& now, int64_t unix_s) {
    const Status stay = check_stay(now, hello, unix_s);
    return stay ? std::pair(ErrorCode::Internal, std::string())
                : std::pair(stay.error().code, stay.error().message);
  };
  EXPECT_EQ(why(tokens, kEndS),
            std::pair(ErrorCode::Unauthorized,
                      std::string("This session's token has expired: ask for a new one.")));
  EXPECT_EQ(why({tokens[1]}, 0),
            std::pair(ErrorCode::Unauthorized,
                      std::string("This session's token was taken back: ask for a new one.")));
  EXPECT_EQ(
      why({{tokens[0].secret, Grant::Viewer}}, 0),
      std::pair(ErrorCode::Unsupported,
                std::string("This session's token is good for viewer now, no longer for a controller.")));
  EXPECT_TRUE(check_stay({{tokens[0].secret, Grant::Admin}}, hello, 0)) << "more than it needs";
}

}  // namespace
}  // namespace strandcast::roles_test
