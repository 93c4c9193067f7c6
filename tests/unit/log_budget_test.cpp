// How much others may write into the log.
#include "common/base/units.h"
#include "server/net/address_guard.h"

#include <gtest/gtest.h>

namespace strandcast::log_budget_test {
namespace {
constexpr int64_t kStartNs = 5 * kSInNs;

TEST(LogBudget, TenLinesAMinuteForAnAddress) {
  LogBudget budget({});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(budget.take("a", kStartNs + i).is_written) << i;
  EXPECT_FALSE(budget.take("a", kStartNs + 10).is_written) << "one over";
  EXPECT_TRUE(budget.take("b", kStartNs + 10).is_written) << "others have theirs";
  EXPECT_FALSE(budget.take("a", kStartNs + 60 * kSInNs - 1).is_written);
  const LogBudget::Verdict next = budget.take("a", kStartNs + 60 * kSInNs);
  EXPECT_TRUE(next.is_written);
  EXPECT_EQ(next.left_out, 2u) << "it is told how many there were";
  EXPECT_EQ(budget.take("a", kStartNs + 60 * kSInNs + 1).left_out, 0u) << "once";
}

TEST(LogBudget, ThreeHundredLinesAMinuteForAllAndNoMoreAddressesInMemory) {
  LogBudget budget({});
  int written = 0;
  for (int i = 0; i < 100'000; ++i)
    written += budget.take(std::to_string(i), kStartNs + i).is_written ? 1 : 0;
  EXPECT_EQ(written, 300);
  EXPECT_LE(budget.size(), 300u);
  const LogBudget::Verdict next = budget.take("new", kStartNs + 61 * kSInNs);
  EXPECT_TRUE(next.is_written);
  EXPECT_EQ(next.left_out, 100'000u - 300u);
  EXPECT_EQ(budget.size(), 1u);
}

TEST(RepeatBudget, NoKindTakesTheLinesOfAnother) {
  RepeatBudget budget({});
  int written = 0;
  for (int i = 0; i < 1'000; ++i) written += budget.take("malformed", "cut") ? 1 : 0;
  EXPECT_EQ(written, 4);
  EXPECT_TRUE(budget.take("sender", "stopped"));
  // All kinds together are bounded, too.
  written = 0;
  for (int i = 0; i < 1'000; ++i) written += budget.take(std::to_string(i), "one") ? 1 : 0;
  EXPECT_EQ(written, 15);
}

TEST(RepeatBudget, WhatComesAgainIsSummedUpUntilItEnds) {
  RepeatBudget budget({});
  EXPECT_TRUE(budget.take_sums(kStartNs).empty());
  for (int i = 0; i < 41; ++i) (void)budget.take("malformed", std::to_string(i));
  EXPECT_TRUE(budget.take_sums(kStartNs + 10 * kSInNs - 1).empty());
  const auto sums = budget.take_sums(kStartNs + 10 * kSInNs);
  ASSERT_EQ(sums.size(), 1u);
  EXPECT_EQ(sums[0].count, 37u);
  EXPECT_EQ(sums[0].newest, "40");
  EXPECT_FALSE(budget.take("malformed", "again")) << "sums alone, while it goes on";
  ASSERT_EQ(budget.take_sums(kStartNs + 20 * kSInNs).size(), 1u);
  EXPECT_TRUE(budget.take_sums(kStartNs + 30 * kSInNs).empty());
  EXPECT_TRUE(budget.take("malformed", "anew"));
}

}  // namespace
}  // namespace strandcast::log_budget_test
