// Laws of which class a viewer gets.
#include "server/net/class_choice.h"
#include "common/base/units.h"

#include <random>
#include <vector>

namespace strandcast::class_choice_test {
namespace {

constexpr int64_t kBeginNs = 1'000'000 * kMsInNs;
const std::vector<double> kCosts = {800e3, 400e3, 200e3, 100e3};

ClassChoice::Question at(size_t present, double allowed_bytes_per_s) {
  return {present, kCosts, allowed_bytes_per_s, 0.0, true};
}

/// A choice that has made its first decision long ago.
ClassChoice settled() {
  ClassChoice choice;
  choice.start_over(kBeginNs - kLongestProbeNs);
  return choice;
}

TEST(ClassChoice, TheFirstOneIsTheBestThatIsAffordable) {
  for (const auto& [allowed, expected] : std::vector<std::pair<double, size_t>>{
           {0.0, 0}, {900e3, 0}, {800e3, 0}, {799e3, 1}, {150e3, 3}, {1.0, 3}}) {
    ClassChoice choice;
    EXPECT_EQ(choice.choose(at(0, allowed), kBeginNs), expected) << allowed;
  }
}

// Its knowledge of the link may be forgotten sooner.
TEST(ClassChoice, WhatTheFirstLookRulesOutIsTriedAfterTheLongestTime) {
  ClassChoice choice;
  const size_t begun = choice.choose(at(0, 50e3), kSInNs);
  ASSERT_GT(begun, 0u);
  int64_t time_ns = kSInNs;
  while (choice.choose(at(begun, 0.0), time_ns) == begun) time_ns += 100 * kMsInNs;
  EXPECT_EQ(time_ns - kSInNs, kLongestProbeNs);
  ClassChoice free;
  ASSERT_EQ(free.choose(at(begun, 0.0), kSInNs), begun) << "nothing is known, and nothing ruled out";
  for (time_ns = kSInNs; free.choose(at(begun, 0.0), time_ns) == begun;) time_ns += 100 * kMsInNs;
  EXPECT_EQ(time_ns - kSInNs, kFirstProbeNs);
}

TEST(ClassChoice, OneLossIsNoTroubleAndTwoAre) {
  ClassChoice choice = settled();
  choice.on_chain_loss(kBeginNs);
  EXPECT_EQ(choice.choose(at(0, 0.0), kBeginNs), 0u);
  choice.on_chain_loss(kBeginNs + kLossWindowNs / 2);
  EXPECT_EQ(choice.choose(at(0, 0.0), kBeginNs + kLossWindowNs / 2), 1u);
  ClassChoice patient = settled();
  patient.on_chain_loss(kBeginNs);
  patient.on_chain_loss(kBeginNs + kLossWindowNs + 1);
  EXPECT_EQ(patient.choose(at(0, 0.0), kBeginNs + kLossWindowNs + 1), 0u) << "too far apart";
}

TEST(ClassChoice, TroubleLeadsToWhatTheLinkCarries) {
  ClassChoice choice = settled();
  choice.on_chain_loss(kBeginNs);
  choice.on_chain_loss(kBeginNs + 1);
  EXPECT_EQ(choice.choose(at(0, 150e3), kBeginNs + 1), 3u) << "several classes at once";
}

TEST(ClassChoice, AStandingQueueIsTroubleAndOneThatDrainsIsNot) {
  const auto after_delays = [](auto delay_ms_at) {
    ClassChoice choice = settled();
    int64_t time_ns = kBeginNs;
    for (int i = 0; i <= 10; ++i) {
      time_ns = kBeginNs + i * 50 * kMsInNs;
      const auto delay_ns = static_cast<int64_t>(delay_ms_at(i) * static_cast<double>(kMsInNs));
      choice.on_delay({delay_ns, delay_ns}, time_ns);
    }
    return choice.choose(at(0, 0.0), time_ns);
  };
  EXPECT_EQ(after_delays([](int) { return 300.0; }), 1u);
  EXPECT_EQ(after_delays([](int i) { return 300.0 - 15.0 * i; }), 0u);
  EXPECT_EQ(after_delays([](int i) { return i == 5 ? 90.0 : 300.0; }), 0u) << "it was not high throughout";
}

TEST(ClassChoice, WhatACheaperClassDoesNotCureIsNoTrouble) {
  struct Case {
    int64_t link_ms, all_ms;
    double decode_share;
    size_t expected;
  };
  for (const Case& one : {Case{0, 300, 0.33, 0}, Case{300, 300, 0.33, 1}, Case{0, 300, 1.2, 1}}) {
    ClassChoice choice = settled();
    const std::vector<double> shares = {one.decode_share, one.decode_share / 2, one.decode_share / 4,
                                        one.decode_share / 8};
    size_t chosen = 0;
    for (int i = 0; i <= 10 && chosen == 0; ++i) {
      const int64_t time_ns = kBeginNs + i * 50 * kMsInNs;
      choice.on_delay({one.link_ms * kMsInNs, one.all_ms * kMsInNs}, time_ns);
      ClassChoice::Question question = at(0, 0.0);
      question.decode_shares = shares;
      chosen = choice.choose(question, time_ns);
    }
    EXPECT_EQ(chosen, one.expected) << one.link_ms << " ms on the link, decodes " << one.decode_share;
  }
}

TEST(ClassChoice, WhatIsTooMuchToDecodeIsNotTried) {
  for (const double better : {0.7, 0.9}) {
    ClassChoice choice;
    choice.start_over(kBeginNs);
    const std::vector<double> shares = {2 * better, better, better / 2, better / 4};
    ClassChoice::Question question = at(2, 0.0);
    question.decode_shares = shares;
    EXPECT_EQ(choice.choose(question, kBeginNs + kFirstProbeNs), better > kBusyDecodeShare ? 2u : 1u);
  }
}

TEST(ClassChoice, AfterQuietTimeOneBetterIsTriedIfTheLinkAllows) {
  ClassChoice choice;
  choice.start_over(kBeginNs);
  EXPECT_EQ(choice.choose(at(2, 0.0), kBeginNs + kFirstProbeNs - 1), 2u);
  EXPECT_FALSE(choice.is_trying(kBeginNs + kFirstProbeNs));
  EXPECT_EQ(choice.choose(at(2, 0.0), kBeginNs + kFirstProbeNs), 1u) << "one, not two";
  EXPECT_TRUE(choice.is_trying(kBeginNs + kFirstProbeNs));
  ClassChoice poor;
  poor.start_over(kBeginNs);
  EXPECT_EQ(poor.choose(at(2, 399e3), kBeginNs + 10 * kFirstProbeNs), 2u);
}

TEST(ClassChoice, ATryThatFailsIsTakenBackAtOnceAndRepeatedLater) {
  ClassChoice choice;
  choice.start_over(kBeginNs);
  int64_t time_ns = kBeginNs + kFirstProbeNs;
  ASSERT_EQ(choice.choose(at(1, 0.0), time_ns), 0u);
  choice.on_chain_loss(++time_ns);
  ASSERT_EQ(choice.choose(at(0, 0.0), time_ns), 1u) << "one loss is enough on probation";
  EXPECT_EQ(choice.choose(at(1, 0.0), time_ns + 2 * kFirstProbeNs - 1), 1u);
  EXPECT_EQ(choice.choose(at(1, 0.0), time_ns + 2 * kFirstProbeNs), 0u) << "after twice the time";
}

TEST(ClassChoice, WithoutAcknowledgementsTheClassStays) {
  ClassChoice choice = settled();
  ClassChoice::Question blind = at(1, 50e3);
  blind.has_acks = false;
  choice.on_chain_loss(kBeginNs);
  choice.on_chain_loss(kBeginNs);
  EXPECT_EQ(choice.choose(blind, kBeginNs), 1u);
}

TEST(ClassChoice, WhateverHappensItIsOneOfTheClassesAndAtMostOneBetter) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    ClassChoice choice;
    size_t present = 0;
    int64_t time_ns = kBeginNs;
    for (int i = 0; i < 500; ++i) {
      time_ns += static_cast<int64_t>(random() % 500) * kMsInNs;
      if (random() % 8 == 0) choice.on_chain_loss(time_ns);
      const auto all_ms = static_cast<int64_t>(random() % 300);
      choice.on_delay({all_ms / 2 * kMsInNs, all_ms * kMsInNs}, time_ns);
      ClassChoice::Question question = at(present, random() % 3 == 0 ? 0.0 : 1e3 * (random() % 1'000));
      if (random() % 4 == 0) question.cap_bytes_per_s = 300e3;
      const size_t chosen = choice.choose(question, time_ns);
      ASSERT_LT(chosen, kCosts.size());
      ASSERT_GE(chosen + 1, present);
      present = chosen;
    }
  }
}

}  // namespace
}  // namespace strandcast::class_choice_test
