// The server's token file: made once with fresh tokens, private, and read with care.
#include "server/net/token_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <set>

#include "tests/support/temporary_folder.h"

namespace strandcast::token_file_test {
namespace {

using testing::HasSubstr;
using testing::Not;

mode_t mode_of(const std::filesystem::path& path) {
  struct stat facts {};
  EXPECT_EQ(stat(path.c_str(), &facts), 0);
  return facts.st_mode & 0777;
}

class TokenFiles : public testing::Test {
 protected:
  Result<TokenFile> open_with(const std::string& text, mode_t mode = 0600) {
    std::ofstream(path_) << text;
    EXPECT_EQ(chmod(path_.c_str(), mode), 0);
    return open_token_file(path_);
  }

  TemporaryFolder folder_;
  const std::filesystem::path path_ = folder_.path() / "tokens";
};

TEST_F(TokenFiles, AreMadeOnceWithFreshTokensForTheOwnerOnly) {
  const mode_t old_mask = umask(0);
  const auto made = open_token_file(path_);
  umask(old_mask);
  ASSERT_TRUE(made) << made.error().to_string();
  EXPECT_TRUE(made->is_new);
  EXPECT_EQ(mode_of(path_), 0600u);
  std::set<std::string> secrets;
  std::set<Grant> grants;
  for (const AccessToken& token : made->tokens) {
    EXPECT_EQ(token.secret.size(), 32u) << "128 bits as hexadecimal digits";
    EXPECT_EQ(token.secret.find_first_not_of("0123456789abcdef"), std::string::npos);
    secrets.insert(token.secret);
    grants.insert(token.grant);
  }
  EXPECT_EQ(secrets.size(), 4u);
  EXPECT_EQ(grants, (std::set<Grant>{Grant::Viewer, Grant::Controller, Grant::Source, Grant::Admin}));

  const auto again = open_token_file(path_);
  ASSERT_TRUE(again) << again.error().to_string();
  EXPECT_FALSE(again->is_new);
  ASSERT_EQ(again->tokens.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(again->tokens[i].secret, made->tokens[i].secret);
    EXPECT_EQ(again->tokens[i].grant, made->tokens[i].grant);
  }
  const auto other = open_token_file(folder_.path() / "other");
  ASSERT_TRUE(other);
  EXPECT_EQ(secrets.count(other->tokens[0].secret), 0u);
}

TEST_F(TokenFiles, ThatOthersCanReadOrChangeAreRefused) {
  for (const mode_t mode : {0640, 0604, 0620, 0602, 0610, 0700, 0644}) {
    const auto opened = open_with("viewer 0123456789abcdef\n", mode);
    ASSERT_FALSE(opened) << mode;
    EXPECT_EQ(opened.error().code, ErrorCode::Unauthorized);
    EXPECT_THAT(opened.error().to_string(), HasSubstr("chmod 600"));
    EXPECT_THAT(opened.error().to_string(), HasSubstr(path_.string()));
  }
  for (const mode_t mode : {0600, 0400}) EXPECT_TRUE(open_with("viewer 0123456789abcdef\n", mode)) << mode;
}

TEST_F(TokenFiles, PlainFormIsGoodForAllButAdmin) {
  const auto opened = open_with("0123456789abcdef \r\n");
  ASSERT_TRUE(opened) << opened.error().to_string();
  ASSERT_EQ(opened->tokens.size(), 1u);
  EXPECT_EQ(opened->tokens[0].secret, "0123456789abcdef");
  EXPECT_EQ(opened->tokens[0].grant, Grant::AllButAdmin);
}

TEST_F(TokenFiles, BrokenOnesAreRefusedWithoutShowingTheirContent) {
  const std::string secret = "0123456789abcdef";
  for (const std::string& text :
       {std::string(), std::string("# nothing\n\n"), "root " + secret + "\n", "viewer " + secret + " more\n",
        "viewer " + secret + "\nadmin " + secret + "\n", "viewer " + secret + "\nfedcba9876543210\n",
        "viewer " + std::string(kMaxTokenBytes + 1, '0') + "\n", std::string(4'097, '0')}) {
    const auto opened = open_with(text);
    ASSERT_FALSE(opened) << text;
    EXPECT_THAT(opened.error().to_string(), HasSubstr(path_.string()));
    EXPECT_THAT(opened.error().to_string(), Not(HasSubstr("01234567")));
    EXPECT_THAT(opened.error().to_string(), Not(HasSubstr("00000000")));
  }
  EXPECT_TRUE(open_with("viewer " + std::string(kMaxTokenBytes, '0') + "\n"));
  EXPECT_FALSE(open_token_file(folder_.path()));
  EXPECT_FALSE(open_token_file(folder_.path() / "no" / "such"));
}

TEST_F(TokenFiles, ARoleIsNoToken) {
  for (const char* role : {"viewer", "controller", "source", "admin"}) {
    const auto opened = open_with(fmt::format("\n{}\n", role));
    ASSERT_FALSE(opened) << role;
    EXPECT_THAT(opened.error().to_string(),
                HasSubstr(fmt::format("line 2 has the role '{}', but no token after it", role)));
  }
  for (const char* text :
       {"viewer viewer\n", "viewer = viewer\n", "viewer = 0123456789abcdef\n", "viewer=viewer\n"})
    EXPECT_FALSE(open_with(text)) << text;
}

TEST_F(TokenFiles, ShortTokensAreRefusedWithTheirLength) {
  for (const std::string role : {"", "viewer ", "admin "}) {
    const auto opened = open_with(role + std::string(kMinTokenCharacters - 1, 'x') + "\n");
    ASSERT_FALSE(opened) << role;
    EXPECT_THAT(opened.error().to_string(),
                HasSubstr("the token in line 1 has 15 characters, it needs at least 16"));
    EXPECT_TRUE(open_with(role + std::string(kMinTokenCharacters, 'x') + "\n")) << role;
  }
}

// Seconds since 1970 by `date -u -d TIME +%s`.
TEST_F(TokenFiles, ALineMayEnd) {
  const auto opened = open_with(
      "viewer 0123456789abcdef expires=2027-01-31\nadmin fedcba9876543210 expires=2028-02-29T18:30:05Z\n"
      "source 00112233445566778\n");
  ASSERT_TRUE(opened) << opened.error().to_string();
  EXPECT_EQ(opened->tokens[0].expires_unix_s, 1'801'353'600);
  EXPECT_EQ(opened->tokens[1].expires_unix_s, 1'835'461'805);
  EXPECT_EQ(opened->tokens[2].expires_unix_s, 0);
  EXPECT_THAT(to_text(opened->tokens), HasSubstr("viewer 0123456789abcdef expires=2027-01-31T00:00:00Z\n"));
  for (const char* wrong :
       {"", "tomorrow", "2027-02-29", "2027-13-01", "2027-01-31T24:00:00Z", "2027-01-31 18:00",
        "2027-01-31T18:00:00", "20270131", "-2027-01-3", "1969-12-31"}) {
    const auto refused = open_with(fmt::format("viewer 0123456789abcdef expires={}\n", wrong));
    ASSERT_FALSE(refused) << wrong;
    EXPECT_THAT(refused.error().to_string(), HasSubstr("line 1 ")) << wrong;
  }
  EXPECT_FALSE(open_with("viewer 0123456789abcdef expires=2027-01-31 more\n"));
}

}  // namespace
}  // namespace strandcast::token_file_test
