// Who may talk to the server: listening, Host and Origin rules, message rate.
#include "server/net/access.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

#include "server/net/net_server.h"

namespace strandcast::access_test {
namespace {

TEST(Access, BeyondLoopbackNeedsAToken) {
  EXPECT_TRUE(check_listening(true, "127.0.0.1", {}).ok());
  EXPECT_TRUE(check_listening(false, "0.0.0.0", {{std::string(32, 'v'), Grant::Viewer}}).ok());
  const Status without = check_listening(false, "0.0.0.0", {});
  ASSERT_FALSE(without.ok());
  EXPECT_EQ(without.error().code, ErrorCode::Unauthorized);
  EXPECT_NE(without.error().message.find("0.0.0.0"), std::string::npos);
  EXPECT_NE(without.error().message.find("--token-file"), std::string::npos);
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

struct HostCase {
  const char* header;
  const char* local_address;
  bool is_loopback;
  bool is_allowed;
};

TEST(Access, HostMatrix) {
  const std::vector<std::string> names = {"hair.example", "hair-box"};
  for (const auto& [header, local, is_loopback, is_allowed] :
       std::initializer_list<HostCase>{{"localhost:1", "127.0.0.1", true, true},
                                       {"LOCALHOST", "127.0.0.1", true, true},
                                       {"127.0.0.1:1", "127.0.0.1", true, true},
                                       {"[::1]:1", "::1", true, true},
                                       {"", "127.0.0.1", true, false},
                                       {"evil.example:1", "127.0.0.1", true, false},
                                       {"localhost.evil.example", "127.0.0.1", true, false},
                                       {"evil-localhost", "127.0.0.1", true, false},
                                       {"localhost.", "127.0.0.1", true, false},
                                       {"127.0.0.1.", "127.0.0.1", true, false},
                                       {"127.1", "127.0.0.1", true, false},
                                       {"2130706433", "127.0.0.1", true, false},
                                       {"localhost@evil.example", "127.0.0.1", true, false},
                                       {"10.0.0.7:1", "10.0.0.7", false, true},
                                       {"10.0.0.70", "10.0.0.7", false, false},
                                       {"10.0.0.8", "10.0.0.7", false, false},
                                       {"localhost", "10.0.0.7", false, false},
                                       {"127.0.0.1", "10.0.0.7", false, false},
                                       {"hair.example", "10.0.0.7", false, true},
                                       {"HAIR.Example:7878", "10.0.0.7", false, true},
                                       {"Hair-Box:1", "10.0.0.7", false, true},
                                       {"hair.example.", "10.0.0.7", false, false},
                                       {"xhair.example", "10.0.0.7", false, false},
                                       {"hair.example.evil.example", "10.0.0.7", false, false},
                                       {"sub.hair.example", "10.0.0.7", false, false},
                                       {"null", "10.0.0.7", false, false}})
    EXPECT_EQ(is_host_allowed(header, local, is_loopback, names), is_allowed) << header << " on " << local;
  EXPECT_FALSE(is_host_allowed("", "10.0.0.7", false, {""})) << "an empty name allows nothing";
}

TEST(Access, OriginMatrix) {
  const std::vector<std::string> origins = {"https://hair.example:8443", "http://Lab.Example"};
  for (const auto& [origin, is_allowed] :
       std::initializer_list<std::pair<const char*, bool>>{{"", true},  // no browser
                                                           {"http://localhost:7878", true},
                                                           {"https://LOCALHOST:7878", true},
                                                           {"http://localhost:8080", false},
                                                           {"http://localhost", false},
                                                           {"ws://localhost:7878", false},
                                                           {"http://localhost:7878.evil.example", false},
                                                           {"http://localhost:7878/", false},
                                                           {"http://localhost.:7878", false},
                                                           {"null", false},
                                                           {"http://evil.example", false},
                                                           {"https://hair.example:8443", true},
                                                           {"HTTPS://Hair.Example:8443", true},
                                                           {"http://lab.example", true},
                                                           {"http://hair.example:8443", false},
                                                           {"https://hair.example", false},
                                                           {"https://hair.example:8444", false},
                                                           {"https://hair.example:84430", false},
                                                           {"https://hair.example.:8443", false},
                                                           {"https://sub.hair.example:8443", false},
                                                           {"https://xhair.example:8443", false},
                                                           {"https://hair.example:8443.evil.example", false},
                                                           {"https://lab.example", false}})
    EXPECT_EQ(is_origin_allowed(origin, "localhost:7878", origins), is_allowed) << origin;
  EXPECT_FALSE(is_origin_allowed("https://hair.example:8443", "localhost:7878", {}));
}

TEST(Access, RateLimitIsExact) {
  RateLimit limit(20.0);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(limit.take(kSInNs)) << i;
  EXPECT_FALSE(limit.take(kSInNs)) << "one over";
  EXPECT_FALSE(limit.take(kSInNs + kSInNs / 20 - 1'000));
  EXPECT_TRUE(limit.take(kSInNs + kSInNs / 20 + 1'000)) << "one comes back in a twentieth of a second";
}

TEST(Access, RateLimitHoldsWhatItsDepthSays) {
  RateLimit limit(20.0, 5.0);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(limit.take(kSInNs)) << i;
  EXPECT_FALSE(limit.take(kSInNs)) << "one over";
  int later = 0;
  while (limit.take(60 * kSInNs)) ++later;
  EXPECT_EQ(later, 100) << "no more than that, however long nothing came";
}

TEST(Access, RateLimitAllowsTheRateAndRefusesTwiceAsMuch) {
  RateLimit limit(100.0);
  int accepted = 0;
  // 200 per second for 10 s: the first 100 at once, then 100 per second.
  for (int i = 0; i < 2'000; ++i) accepted += limit.take(kSInNs + i * (kSInNs / 200)) ? 1 : 0;
  EXPECT_GE(accepted, 1'000);
  EXPECT_LE(accepted, 1'101);
  RateLimit steady(100.0);
  for (int i = 0; i < 1'000; ++i) EXPECT_TRUE(steady.take(kSInNs + i * (kSInNs / 100)));
}

}  // namespace
}  // namespace strandcast::access_test
