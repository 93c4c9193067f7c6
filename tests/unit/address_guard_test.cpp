// How fast one address may connect, and what wrong tokens cost it.
#include "server/net/address_guard.h"
#include "common/base/units.h"

#include <gtest/gtest.h>

namespace strandcast::address_guard_test {
namespace {
constexpr int64_t kStartNs = 5 * kSInNs;

TEST(AddressGuard, TenConnectionsAtOnceAndTenASecond) {
  AddressGuard guard({});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(guard.take_connection("a", kStartNs)) << i;
  EXPECT_FALSE(guard.take_connection("a", kStartNs)) << "one over";
  EXPECT_TRUE(guard.take_connection("b", kStartNs)) << "others are not affected";
  EXPECT_TRUE(guard.take_connection("a", kStartNs + kSInNs / 10 + 1'000));
  EXPECT_FALSE(guard.take_connection("a", kStartNs + kSInNs / 10 + 1'000));
}

TEST(AddressGuard, FiftyRequestsAtOnceAndFiftyASecondWhateverTheConnections) {
  AddressGuard guard({});
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(guard.take_request("a", kStartNs)) << i;
  EXPECT_FALSE(guard.take_request("a", kStartNs)) << "one over";
  EXPECT_TRUE(guard.take_connection("a", kStartNs)) << "these are counted for themselves";
  EXPECT_TRUE(guard.take_request("b", kStartNs)) << "others are not affected";
  EXPECT_TRUE(guard.take_request("a", kStartNs + kSInNs / 50 + 1'000));
  EXPECT_FALSE(guard.take_request("a", kStartNs + kSInNs / 50 + 1'000));
}

TEST(AddressGuard, FiveWrongTokensInAMinuteAreForgivenAndTheSixthBlocksForAMinute) {
  AddressGuard guard({});
  for (int i = 0; i < 5; ++i) guard.on_wrong_token("a", kStartNs + i);
  EXPECT_FALSE(guard.is_blocked("a", kStartNs + 5)) << "at the limit";
  guard.on_wrong_token("a", kStartNs + 6);
  EXPECT_TRUE(guard.is_blocked("a", kStartNs + 7)) << "one over";
  EXPECT_TRUE(guard.take_connection("a", kStartNs + 7)) << "who asks for no more than /healthz gets it";
  EXPECT_FALSE(guard.is_blocked("b", kStartNs + 7));
  EXPECT_TRUE(guard.is_blocked("a", kStartNs + 6 + 60 * kSInNs - 1));
  EXPECT_FALSE(guard.is_blocked("a", kStartNs + 6 + 60 * kSInNs));
}

TEST(AddressGuard, WrongTokensOlderThanTheWindowDoNotCount) {
  AddressGuard guard({});
  for (int i = 0; i < 100; ++i) {
    // Five in any minute, for twenty minutes.
    const int64_t time_ns = kStartNs + i * 12 * kSInNs;
    guard.on_wrong_token("a", time_ns);
    EXPECT_FALSE(guard.is_blocked("a", time_ns)) << i;
  }
}

TEST(AddressGuard, TheTableIsBoundedAndKeepsThoseThatAreBlocked) {
  GuardLimits limits;
  limits.addresses = 8;
  AddressGuard guard(limits);
  for (int i = 0; i < 6; ++i) guard.on_wrong_token("bad", kStartNs);
  for (int i = 0; i < 1'000; ++i) {
    EXPECT_TRUE(guard.take_connection(std::to_string(i), kStartNs + i));
    EXPECT_LE(guard.size(), 8u);
  }
  EXPECT_EQ(guard.size(), 8u);
  EXPECT_TRUE(guard.is_blocked("bad", kStartNs + 1'000));
  // Even when all of them are blocked there is a bound.
  for (int address = 0; address < 20; ++address)
    for (int i = 0; i < 6; ++i) guard.on_wrong_token("bad" + std::to_string(address), kStartNs + 2'000);
  EXPECT_EQ(guard.size(), 8u);
}

TEST(AddressGuard, ABanLastsAsLongAsItWasSaidAndOutlivesTheOthersOfAFullTable) {
  GuardLimits limits;
  limits.addresses = 4;
  AddressGuard guard(limits);
  guard.ban("bad", kStartNs, kStartNs + 60 * kSInNs);
  guard.ban("bad", kStartNs, kStartNs + 1 * kSInNs);  // no shorter for that
  EXPECT_TRUE(guard.is_banned("bad", kStartNs + 59 * kSInNs));
  EXPECT_FALSE(guard.is_banned("bad", kStartNs + 60 * kSInNs));
  EXPECT_FALSE(guard.is_banned("good", kStartNs));
  for (int address = 0; address < 20; ++address)
    for (int i = 0; i < 6; ++i) guard.on_wrong_token(std::to_string(address), kStartNs + 2);
  EXPECT_TRUE(guard.is_banned("bad", kStartNs + 3));
}

}  // namespace
}  // namespace strandcast::address_guard_test
