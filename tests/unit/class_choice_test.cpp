// Laws of which class a viewer gets.
#include "server/net/class_choice.h"

#include <random>
#include <vector>

namespace strandcast {
namespace {

constexpr int64_t kBeginNs = 1'000'000 * kNsPerMs;
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
      time_ns = kBeginNs + i * 50 * kNsPerMs;
      choice.on_delay(static_cast<int64_t>(delay_ms_at(i) * static_cast<double>(kNsPerMs)), time_ns);
    }
    return choice.choose(at(0, 0.0), time_ns);
  };
  EXPECT_EQ(after_delays([](int) { return 300.0; }), 1u);
  EXPECT_EQ(after_delays([](int i) { return 300.0 - 15.0 * i; }), 0u);
  EXPECT_EQ(after_delays([](int i) { return i == 5 ? 90.0 : 300.0; }), 0u) << "it was not high throughout";
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
      time_ns += static_cast<int64_t>(random() % 500) * kNsPerMs;
      if (random() % 8 == 0) choice.on_chain_loss(time_ns);
      choice.on_delay(static_cast<int64_t>(random() % 300) * kNsPerMs, time_ns);
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
}  // namespace strandcast
