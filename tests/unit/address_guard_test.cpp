// How fast one address may connect, and what wrong tokens cost it.
#include "server/net/address_guard.h"

#include <gtest/gtest.h>

namespace strandcast {
namespace {

using Verdict = AddressGuard::Verdict;

constexpr int64_t kSecondNs = 1'000'000'000;
constexpr int64_t kStartNs = 5 * kSecondNs;

TEST(AddressGuard, TenConnectionsAtOnceAndTenASecond) {
  AddressGuard guard({});
  for (int i = 0; i < 10; ++i) EXPECT_EQ(guard.on_connection("a", kStartNs), Verdict::Welcome) << i;
  EXPECT_EQ(guard.on_connection("a", kStartNs), Verdict::TooFast) << "one over";
  EXPECT_EQ(guard.on_connection("b", kStartNs), Verdict::Welcome) << "others are not affected";
  EXPECT_EQ(guard.on_connection("a", kStartNs + kSecondNs / 10 + 1'000), Verdict::Welcome);
  EXPECT_EQ(guard.on_connection("a", kStartNs + kSecondNs / 10 + 1'000), Verdict::TooFast);
}

TEST(AddressGuard, FiveWrongTokensInAMinuteAreForgivenAndTheSixthBlocksForAMinute) {
  AddressGuard guard({});
  for (int i = 0; i < 5; ++i) guard.on_wrong_token("a", kStartNs + i);
  EXPECT_EQ(guard.on_connection("a", kStartNs + 5), Verdict::Welcome) << "at the limit";
  guard.on_wrong_token("a", kStartNs + 6);
  EXPECT_EQ(guard.on_connection("a", kStartNs + 7), Verdict::Blocked) << "one over";
  EXPECT_EQ(guard.on_connection("b", kStartNs + 7), Verdict::Welcome);
  EXPECT_EQ(guard.on_connection("a", kStartNs + 6 + 60 * kSecondNs - 1), Verdict::Blocked);
  EXPECT_EQ(guard.on_connection("a", kStartNs + 6 + 60 * kSecondNs), Verdict::Welcome);
}

TEST(AddressGuard, WrongTokensOlderThanTheWindowDoNotCount) {
  AddressGuard guard({});
  for (int i = 0; i < 100; ++i) {
    // Five in any minute, for twenty minutes.
    const int64_t time_ns = kStartNs + i * 12 * kSecondNs;
    guard.on_wrong_token("a", time_ns);
    EXPECT_EQ(guard.on_connection("a", time_ns), Verdict::Welcome) << i;
  }
}

TEST(AddressGuard, TheTableIsBoundedAndKeepsThoseThatAreBlocked) {
  GuardLimits limits;
  limits.addresses = 8;
  AddressGuard guard(limits);
  for (int i = 0; i < 6; ++i) guard.on_wrong_token("bad", kStartNs);
  for (int i = 0; i < 1'000; ++i) {
    EXPECT_EQ(guard.on_connection(std::to_string(i), kStartNs + i), Verdict::Welcome);
    EXPECT_LE(guard.size(), 8u);
  }
  EXPECT_EQ(guard.size(), 8u);
  EXPECT_EQ(guard.on_connection("bad", kStartNs + 1'000), Verdict::Blocked);
  // Even when all of them are blocked there is a bound.
  for (int address = 0; address < 20; ++address)
    for (int i = 0; i < 6; ++i) guard.on_wrong_token("bad" + std::to_string(address), kStartNs + 2'000);
  EXPECT_EQ(guard.size(), 8u);
}

}  // namespace
}  // namespace strandcast
