// Who may talk to the server: listening, Host and Origin rules, message rate.
#include "server/net/access.h"

#include <gtest/gtest.h>

#include "server/net/net_server.h"

namespace strandcast {
namespace {

constexpr int64_t kSecondNs = 1'000'000'000;

TEST(Access, BeyondLoopbackNeedsALongToken) {
  const AccessToken admin{std::string(32, 'a'), Grant::Admin};
  const auto with = [&](size_t characters) {
    return std::vector<AccessToken>{admin, {std::string(characters, 'v'), Grant::Viewer}};
  };
  EXPECT_TRUE(check_listening(true, "127.0.0.1", {}).ok());
  EXPECT_TRUE(check_listening(false, "0.0.0.0", with(kMinRemoteTokenCharacters)).ok());
  const Status without = check_listening(false, "0.0.0.0", {});
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().message.find("0.0.0.0"), std::string::npos);
  EXPECT_NE(without.error().message.find("--token-file"), std::string::npos);
  const Status is_short = check_listening(false, "0.0.0.0", with(kMinRemoteTokenCharacters - 1));
  ASSERT_FALSE(is_short.ok());
  EXPECT_EQ(is_short.error().message.find("vvv"), std::string::npos) << "a token is never printed";
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
