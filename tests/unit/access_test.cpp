// Who may talk to the server: token, Host and Origin rules, message rate.
#include "server/net/access.h"

#include <gtest/gtest.h>

namespace strandcast {
namespace {

constexpr int64_t kSecondNs = 1'000'000'000;

TEST(Access, BeyondLoopbackNeedsALongToken) {
  EXPECT_TRUE(check_listening(true, "127.0.0.1", "").ok());
  EXPECT_TRUE(check_listening(false, "0.0.0.0", "0123456789abcdef").ok());
  const Status without = check_listening(false, "0.0.0.0", "");
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().message.find("0.0.0.0"), std::string::npos);
  EXPECT_NE(without.error().message.find("--token-file"), std::string::npos);
  EXPECT_FALSE(check_listening(false, "0.0.0.0", "0123456789abcde").ok()) << "15 characters";
}

TEST(Access, TokenMustMatchExactly) {
  EXPECT_TRUE(is_token_equal("secret", "secret"));
  EXPECT_FALSE(is_token_equal("secret", "secre"));
  EXPECT_FALSE(is_token_equal("secret", "secretsecret")) << "a repetition is no match";
  EXPECT_FALSE(is_token_equal("secret", "Secret"));
  EXPECT_FALSE(is_token_equal("secret", ""));
  EXPECT_TRUE(is_token_equal("", ""));
}

TEST(Access, HostNameIsSplitFromThePort) {
  EXPECT_EQ(host_name_of("LocalHost:7878"), "localhost");
  EXPECT_EQ(host_name_of("[::1]:7878"), "::1");
  EXPECT_EQ(host_name_of("[::1]"), "::1");
  EXPECT_EQ(host_name_of("10.0.0.7"), "10.0.0.7");
  EXPECT_EQ(host_name_of(""), "");
  EXPECT_EQ(host_name_of("[::1"), "");
  EXPECT_EQ(host_name_of("localhost:evil"), "");
  EXPECT_EQ(host_name_of("[::1].evil.example"), "");
}

TEST(Access, HostMatrix) {
  EXPECT_TRUE(is_host_allowed("localhost:1", "127.0.0.1", true, {}));
  EXPECT_TRUE(is_host_allowed("127.0.0.1:1", "127.0.0.1", true, {}));
  EXPECT_TRUE(is_host_allowed("[::1]:1", "::1", true, {}));
  EXPECT_FALSE(is_host_allowed("evil.example:1", "127.0.0.1", true, {}));
  EXPECT_FALSE(is_host_allowed("localhost.evil.example", "127.0.0.1", true, {}));
  EXPECT_FALSE(is_host_allowed("", "127.0.0.1", true, {}));
  EXPECT_TRUE(is_host_allowed("10.0.0.7:1", "10.0.0.7", false, {}));
  EXPECT_FALSE(is_host_allowed("localhost", "10.0.0.7", false, {}));
  EXPECT_TRUE(is_host_allowed("Hair-Box:1", "10.0.0.7", false, {"hair-box"}));
  EXPECT_FALSE(is_host_allowed("", "10.0.0.7", false, {""})) << "an empty name allows nothing";
}

TEST(Access, OriginMatrix) {
  EXPECT_TRUE(is_origin_allowed("", "localhost:7878"));
  EXPECT_TRUE(is_origin_allowed("http://localhost:7878", "localhost:7878"));
  EXPECT_TRUE(is_origin_allowed("https://LOCALHOST:7878", "localhost:7878"));
  EXPECT_FALSE(is_origin_allowed("null", "localhost:7878"));
  EXPECT_FALSE(is_origin_allowed("http://evil.example", "localhost:7878"));
  EXPECT_FALSE(is_origin_allowed("http://localhost:7878.evil.example", "localhost:7878"));
  EXPECT_FALSE(is_origin_allowed("http://localhost:8080", "localhost:7878"));
}

TEST(Access, RateLimitAllowsTheRateAndRefusesTwiceAsMuch) {
  RateLimit limit(100.0);
  int accepted = 0;
  // 200 per second for 10 s: the first 100 at once, then 100 per second.
  for (int i = 0; i < 2'000; ++i) accepted += limit.take(kSecondNs + i * (kSecondNs / 200)) ? 1 : 0;
  EXPECT_GE(accepted, 1'000);
  EXPECT_LE(accepted, 1'101);
  RateLimit steady(100.0);
  for (int i = 0; i < 1'000; ++i) EXPECT_TRUE(steady.take(kSecondNs + i * (kSecondNs / 100)));
}

}  // namespace
}  // namespace strandcast
