// Laws of how much may be on its way.
#include "server/net/send_gate.h"
#include "common/base/units.h"

#include <random>

namespace strandcast::send_gate_test {
namespace {

constexpr int64_t kBeginNs = 1'000'000 * kMsInNs;
constexpr auto kUsual = SendGate::Delay::Usual;

FrameHeader frame(uint32_t sequence, Opcode opcode = Opcode::StrandDelta) {
  FrameHeader header;
  header.opcode = opcode;
  header.sequence = sequence;
  header.base_sequence = sequence - 1;
  return header;
}

TEST(SendGate, AnAssetGoesAlone) {
  LinkEstimate link;
  SendGate gate(link);
  EXPECT_TRUE(gate.may_send(kUsual, kBeginNs));
  gate.on_sent(frame(1, Opcode::Asset), 10, kBeginNs);
  EXPECT_FALSE(gate.may_send(kUsual, kBeginNs + 10 * kAskAgainNs)) << "however long it takes";
  EXPECT_TRUE(gate.take_acked(0, 1).has_value());
  EXPECT_TRUE(gate.may_send(kUsual, kBeginNs));
}

TEST(SendGate, BeforeTheFirstAcknowledgementAFewBytesGo) {
  LinkEstimate link;
  SendGate gate(link);
  size_t bytes = 0;
  for (uint32_t i = 1; gate.may_send(kUsual, kBeginNs) && i < 1'000; ++i) {
    gate.on_sent(frame(i), 1'000, kBeginNs);
    bytes += 1'000;
  }
  EXPECT_LE(bytes, kFirstBytes + 1'000);
  EXPECT_FALSE(gate.may_send(kUsual, kBeginNs + kAskAgainNs)) << "however long it takes";
}

TEST(SendGate, WhatIsOnItsWayIsBoundedWhateverTheLinkSeemed) {
  LinkEstimate link;
  link.on_acked({1'000'000, kBeginNs - 2 * kMsInNs, true, true}, kBeginNs);  // without end
  // 512 frames, and no other once there are 4 MiB.
  constexpr size_t kFourMiB = 4'194'304;
  for (const auto& [bytes, most] : std::vector<std::pair<size_t, uint32_t>>{{1, 512},
                                                                            {8'192, 512},
                                                                            {8'193, 512},
                                                                            {8'209, 511},
                                                                            {100'000, 42},
                                                                            {kFourMiB, 1},
                                                                            {10 * kFourMiB, 1}}) {
    SendGate gate(link);
    uint32_t count = 0;
    while (count < 2'000 && gate.may_send(kUsual, kBeginNs)) gate.on_sent(frame(++count), bytes, kBeginNs);
    EXPECT_EQ(count, most) << bytes;
    EXPECT_EQ(gate.in_flight_bytes(), count * bytes);
  }
}

TEST(SendGate, AnAcknowledgementTakesEverythingBeforeItAndOthersTakeNothing) {
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    LinkEstimate link;
    SendGate gate(link);
    const uint32_t count = 1 + random() % 20;
    size_t bytes = 0;
    for (uint32_t i = 1; i <= count; ++i) {
      gate.on_sent(frame(i), i, kBeginNs + i);
      bytes += i;
    }
    EXPECT_FALSE(gate.take_acked(0, count + 1).has_value());
    EXPECT_FALSE(gate.take_acked(1, 1).has_value()) << "of another stream";
    EXPECT_EQ(gate.in_flight_bytes(), bytes);
    const uint32_t acked = 1 + random() % count;
    const auto taken = gate.take_acked(0, acked);
    ASSERT_TRUE(taken.has_value());
    EXPECT_EQ(taken->bytes, acked);
    EXPECT_EQ(taken->sent_ns, kBeginNs + acked);
    EXPECT_EQ(taken->was_alone, acked == 1);
    EXPECT_EQ(gate.in_flight_bytes(), bytes - size_t{acked} * (acked + 1) / 2);
    EXPECT_FALSE(gate.take_acked(0, acked).has_value()) << "twice";
  }
}

TEST(SendGate, ALateFrameHoldsTheNextOnesAndSoonerWhileABetterClassIsTried) {
  LinkEstimate link;
  link.on_round_trip(20 * kMsInNs, kBeginNs);
  link.on_acked({100, kBeginNs - 20 * kMsInNs, false, true}, kBeginNs);
  SendGate gate(link);
  for (uint32_t i = 1; i <= kFreeFrames; ++i) gate.on_sent(frame(i), 100, kBeginNs);
  const int64_t late_ns = kBeginNs + 20 * kMsInNs + kGateDelayNs;
  EXPECT_TRUE(gate.may_send(kUsual, late_ns));
  EXPECT_FALSE(gate.may_send(kUsual, late_ns + 1));
  const int64_t tried_ns = kBeginNs + 20 * kMsInNs + kStartDelayNs;
  EXPECT_TRUE(gate.may_send(SendGate::Delay::Short, tried_ns));
  EXPECT_FALSE(gate.may_send(SendGate::Delay::Short, tried_ns + 1));
}

TEST(SendGate, AnAnswerIsDueWhenTheOldestFrameCanHaveArrived) {
  LinkEstimate link;
  link.on_round_trip(20 * kMsInNs, kBeginNs - 5'000 * kMsInNs);
  SendGate gate(link);
  EXPECT_EQ(gate.oldest_due_ns(kBeginNs), 0) << "none waits";
  gate.on_sent(frame(1), 100, kBeginNs);
  EXPECT_EQ(gate.oldest_due_ns(kBeginNs), kBeginNs + 20 * kMsInNs);
  gate.on_written(frame(1), kBeginNs + 300 * kMsInNs);
  EXPECT_EQ(gate.oldest_due_ns(kBeginNs), kBeginNs + 320 * kMsInNs) << "the link has taken it only now";
  gate.on_written(frame(2), kBeginNs + 900 * kMsInNs);
  EXPECT_EQ(gate.oldest_due_ns(kBeginNs), kBeginNs + 320 * kMsInNs) << "others are no sign of it";
  gate.forget();
  EXPECT_EQ(gate.oldest_due_ns(kBeginNs), 0);
  EXPECT_EQ(gate.in_flight_bytes(), 0u);
}

}  // namespace
}  // namespace strandcast::send_gate_test
