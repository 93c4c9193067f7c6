// The relay's link model on given times: what goes in comes out, when and how the plan says.
#include "common/chaos/chaos_pipe.h"
#include "common/base/units.h"

#include <numeric>

namespace strandcast::chaos::chaos_pipe_test {
namespace {

constexpr uint64_t kSeed = 7;

std::vector<std::byte> numbers(size_t count) {
  std::vector<std::byte> bytes(count);
  for (size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::byte>(i * 131 >> 3);
  return bytes;
}

struct Written {
  std::vector<std::byte> bytes;
  std::vector<size_t> sizes;
  std::vector<int64_t> times_us;  // of every write
};

/// Writes all that is due, jumping from due time to due time.
Written drain(ChaosPipe& pipe, int64_t time_us) {
  Written written;
  while (!pipe.is_empty()) {
    time_us = std::max(time_us, pipe.next_due_us(time_us));
    const auto piece = pipe.front(time_us);
    if (piece.empty()) continue;
    written.bytes.insert(written.bytes.end(), piece.begin(), piece.end());
    written.sizes.push_back(piece.size());
    written.times_us.push_back(time_us);
    pipe.pop(piece.size());
  }
  return written;
}

TEST(ChaosPipe, PassesEveryByteInOrderWhateverThePlan) {
  for (const Writes writes : {Writes::AsRead, Writes::OneByte, Writes::Split, Writes::Merged}) {
    LinkPlan plan;
    plan.delay_us = 3'000;
    plan.jitter_us = 20'000;
    plan.bytes_per_s = 1'000'000;
    plan.freeze_every_us = 50'000;
    plan.freeze_us = 20'000;
    plan.writes = writes;
    ChaosPipe pipe(plan, kSeed);
    const auto sent = numbers(50'000);
    pipe.push(sent, 0);
    const Written written = drain(pipe, 0);
    EXPECT_EQ(written.bytes, sent);
    EXPECT_EQ(pipe.held_bytes(), 0u);
    EXPECT_TRUE(std::is_sorted(written.times_us.begin(), written.times_us.end()));
    for (const int64_t time_us : written.times_us)
      EXPECT_LT(time_us % 50'000, 30'000) << "written in a freeze";
    const size_t longest = *std::max_element(written.sizes.begin(), written.sizes.end());
    const size_t most = writes == Writes::OneByte ? 1
                        : writes == Writes::Split ? kMaxSplitBytes
                                                  : sent.size();
    EXPECT_LE(longest, most);
    EXPECT_GT(longest, writes == Writes::Merged ? kSegmentBytes : 0u);
  }
}

TEST(ChaosPipe, RateAndQueueBoundWhatPasses) {
  LinkPlan plan;
  plan.bytes_per_s = 250'000;
  plan.queue_bytes = 64'000;
  ChaosPipe pipe(plan, kSeed);
  // A sender that always fills the queue for one second, looked at every millisecond.
  const auto bytes = numbers(64'000);
  size_t passed = 0;
  size_t most_held = 0;
  for (int64_t time_us = 0; time_us < kSInUs; time_us += 1'000) {
    pipe.push(std::span(bytes).first(std::min(pipe.room(time_us), bytes.size())), time_us);
    most_held = std::max(most_held, pipe.held_bytes());
    for (auto piece = pipe.front(time_us); !piece.empty(); piece = pipe.front(time_us)) {
      passed += piece.size();
      pipe.pop(piece.size());
    }
  }
  EXPECT_LE(passed, 250'000u);
  EXPECT_GE(passed, 250'000u - 2 * kSegmentBytes);
  EXPECT_LE(most_held, 64'000u + kSegmentBytes);
}

TEST(ChaosPipe, DelayAndJitterStayWithinTheirBounds) {
  LinkPlan plan;
  plan.delay_us = 50'000;
  plan.jitter_us = 10'000;
  ChaosPipe pipe(plan, kSeed);
  std::vector<int64_t> delays_us;
  for (int64_t i = 0; i < 200; ++i) {
    const int64_t sent_us =
        i * 20'000;  // farther apart than the jitter, so that none waits for the one before
    pipe.push(numbers(100), sent_us);
    delays_us.push_back(drain(pipe, sent_us).times_us.front() - sent_us);
  }
  const auto [shortest, longest] = std::minmax_element(delays_us.begin(), delays_us.end());
  EXPECT_GE(*shortest, 50'000);
  EXPECT_LE(*longest, 60'000);
  const double mean = std::accumulate(delays_us.begin(), delays_us.end(), 0.0) / 200.0;
  EXPECT_NEAR(mean, 55'000.0, 4.0 * 10'000.0 / std::sqrt(12.0 * 200.0)) << "four standard errors";
}

TEST(ChaosPipe, WhatIsLostComesARoundTripLater) {
  constexpr int kSegments = 2'000;
  LinkPlan plan;
  plan.delay_us = 5'000;
  const auto late_of = [&](double loss) {
    plan.loss = loss;
    ChaosPipe pipe(plan, kSeed);
    int late = 0;
    for (int64_t i = 0; i < kSegments; ++i) {
      const int64_t sent_us = i * kSInUs;  // none waits for one before
      pipe.push(numbers(100), sent_us);
      const int64_t more_us = drain(pipe, sent_us).times_us.front() - sent_us - plan.delay_us;
      EXPECT_EQ(more_us % (2 * plan.delay_us + kResendUs), 0);
      late += more_us > 0 ? 1 : 0;
    }
    return late;
  };
  EXPECT_EQ(late_of(0.0), 0);
  EXPECT_NEAR(late_of(0.05), 0.05 * kSegments, 4.0 * std::sqrt(0.05 * 0.95 * kSegments)) << "four deviations";
  // Those behind it wait: a second of segments 1 ms apart comes in order.
  plan.loss = 0.05;
  ChaosPipe pipe(plan, kSeed);
  const auto sent = numbers(100'000);
  for (size_t i = 0; i < 1'000; ++i)
    pipe.push(std::span(sent).subspan(i * 100, 100), static_cast<int64_t>(i) * 1'000);
  EXPECT_EQ(drain(pipe, kSInUs).bytes, sent);
}

TEST(ChaosPipe, CorruptionDependsOnSeedAndPlaceOnly) {
  LinkPlan plan;
  plan.corrupt_per_byte = 1e-3;
  const auto sent = numbers(100'000);
  const auto received = [&](uint64_t seed, size_t chunk) {
    ChaosPipe pipe(plan, seed);
    for (size_t begin = 0; begin < sent.size(); begin += chunk)
      pipe.push(std::span(sent).subspan(begin, std::min(chunk, sent.size() - begin)), 0);
    return drain(pipe, 0).bytes;
  };
  const auto whole = received(kSeed, sent.size());
  EXPECT_EQ(whole, received(kSeed, 77));
  EXPECT_NE(whole, received(kSeed + 1, 77));
  size_t wrong = 0;
  for (size_t i = 0; i < sent.size(); ++i) {
    const auto difference = std::to_integer<unsigned>(sent[i] ^ whole[i]);
    EXPECT_LE(std::popcount(difference), 1);
    wrong += difference != 0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(wrong), 100.0, 5.0 * std::sqrt(100.0)) << "five standard deviations";
}

}  // namespace
}  // namespace strandcast::chaos::chaos_pipe_test
