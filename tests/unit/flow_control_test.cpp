// Flow control against a link on paper (tests/support/simulated_viewer.h): the laws are exact and the tests
// take no time.
#include "server/net/flow_control.h"
#include "common/base/units.h"

#include <algorithm>

#include "server/net/strand_class.h"
#include "tests/support/simulated_viewer.h"

namespace strandcast::flow_control_test {
namespace {

using namespace simulated;

double share_of_full_rate(const Viewer& viewer, int64_t from_ns) {
  return viewer.rate_hz(from_ns) / 60.0;
}

TEST(FlowControl, FastLinkKeepsFullRateAtEveryRoundTrip) {
  for (const int64_t round_trip_ms : {1, 20, 50, 150, 300}) {
    Viewer viewer({.round_trip_ns = round_trip_ms * kMsInNs, .jitter_ns = 10 * kMsInNs});
    viewer.run(3 * kSInNs);
    const int64_t from_ns = viewer.time_ns;
    viewer.run(20 * kSInNs);
    EXPECT_GE(share_of_full_rate(viewer, from_ns), 0.99) << round_trip_ms;
    EXPECT_EQ(viewer.changes, 0u) << round_trip_ms << " ms of delay say nothing about the rate";
    EXPECT_EQ(viewer.keyframes, 1u) << round_trip_ms;
  }
}

TEST(FlowControl, SlowLinksSettleWithinThreeSecondsAndStay) {
  for (const double mbit : {2.0, 5.0, 10.0}) {
    for (const int64_t round_trip_ms : {10, 100, 300}) {
      SCOPED_TRACE(fmt::format("{} Mbit/s, {} ms", mbit, round_trip_ms));
      Viewer viewer(
          {.bytes_per_s = mbit * 125e3, .round_trip_ns = round_trip_ms * kMsInNs, .jitter_ns = 5 * kMsInNs});
      viewer.run(static_cast<int64_t>(kAssetBytes / (mbit * 125e3) * 1e9) +
                 3 * kSInNs);  // the asset takes its time
      const int64_t settled_ns = viewer.time_ns;
      const size_t changes = viewer.changes;
      viewer.run(20 * kSInNs);
      EXPECT_LE(viewer.worst_age_ns(settled_ns), 250 * kMsInNs);
      EXPECT_GE(viewer.rate_hz(settled_ns), 10.0 * 0.98);
      EXPECT_LE(viewer.changes, changes + 1) << "what the link showed is remembered";
    }
  }
}

TEST(FlowControl, LinkThatGetsSlowIsFollowedWithinThreeSeconds) {
  for (const double mbit : {1.0, 2.0, 5.0})
    for (const int64_t reader_ms : {1, 40}) {
      SCOPED_TRACE(fmt::format("{} Mbit/s, read every {} ms", mbit, reader_ms));
      Viewer viewer(
          {.round_trip_ns = 30 * kMsInNs, .jitter_ns = 5 * kMsInNs, .reader_ns = reader_ms * kMsInNs});
      viewer.run(10 * kSInNs);
      ASSERT_EQ(viewer.present, 0u);
      viewer.link.bytes_per_s = mbit * 125e3;
      viewer.run(3 * kSInNs);
      const int64_t settled_ns = viewer.time_ns;
      viewer.run(15 * kSInNs);
      EXPECT_LE(viewer.worst_age_ns(settled_ns), 250 * kMsInNs);
      EXPECT_GE(viewer.rate_hz(settled_ns), 10.0 * 0.98);
      // And back: up step by step, since a better class is tried only after quiet time.
      viewer.link.bytes_per_s = 1e9;
      viewer.run(180 * kSInNs);
      EXPECT_EQ(viewer.present, 0u);
    }
}

TEST(FlowControl, FreezesCostNoClass) {
  Viewer viewer({.round_trip_ns = 20 * kMsInNs,
                 .is_frozen = [](int64_t time_ns) { return time_ns % (5 * kSInNs) < 200 * kMsInNs; }});
  viewer.run(30 * kSInNs);
  EXPECT_EQ(viewer.present, 0u);
  EXPECT_EQ(viewer.changes, 0u);
  // Live again one round trip and one frame after each freeze.
  for (const auto& arrival : viewer.arrivals_since(6 * kSInNs)) {
    if (arrival.arrived_ns % (5 * kSInNs) < 300 * kMsInNs) continue;
    EXPECT_LE(arrival.arrived_ns - arrival.made_ns, 20 * kMsInNs + kStepNs)
        << "at " << arrival.arrived_ns / kMsInNs;
  }
}

// Fewer strands would bring nothing: the link carries ten times what all take, and decoding takes a third of
// the time, on a machine that does other things as well.
TEST(FlowControl, AViewerThatLacksItsProcessorKeepsItsStrands) {
  struct Absence {
    int64_t period_ns, away_ns;
  };
  for (const double decode_share : {0.0, 0.33})
    for (const Absence& absence : {Absence{kSInNs, 0}, Absence{100 * kMsInNs, 30 * kMsInNs},
                                   Absence{400 * kMsInNs, 200 * kMsInNs}, Absence{kSInNs, 300 * kMsInNs},
                                   Absence{2 * kSInNs, 1'000 * kMsInNs}, Absence{7 * kSInNs, 3 * kSInNs}})
      for (const int64_t round_trip_ms : {1, 40}) {
        SCOPED_TRACE(fmt::format("decodes {} of the time, away {} of {} ms, {} ms", decode_share,
                                 absence.away_ns / kMsInNs, absence.period_ns / kMsInNs, round_trip_ms));
        Viewer viewer({.bytes_per_s = 10.0 * kFullBytesPerS,
                       .round_trip_ns = round_trip_ms * kMsInNs,
                       .jitter_ns = 5 * kMsInNs});
        viewer.machine.decode_ns = static_cast<int64_t>(decode_share * kStepNs);
        viewer.machine.is_away = [&](int64_t time_ns) {
          // Present at first: the asset shows the link.
          return (time_ns - kSInNs) % absence.period_ns >= absence.period_ns - absence.away_ns;
        };
        viewer.run(40 * kSInNs);
        EXPECT_EQ(viewer.changes, 0u);
      }
}

// Nor does a link that is too slow hide behind a viewer that is away now and then.
TEST(FlowControl, ASlowLinkToAViewerThatIsAwayIsFollowed) {
  for (const double mbit : {1.0, 3.0}) {
    SCOPED_TRACE(mbit);
    Viewer viewer({.bytes_per_s = mbit * 125e3, .round_trip_ns = 30 * kMsInNs, .jitter_ns = 5 * kMsInNs});
    viewer.machine.is_away = [](int64_t time_ns) { return time_ns % kSInNs < 100 * kMsInNs; };
    viewer.run(20 * kSInNs);
    EXPECT_LE(relative_cost(make_strand_classes(built_in_plan())[viewer.present]) * kFullBytesPerS,
              mbit * 125e3);
  }
}

TEST(FlowControl, AViewerThatDecodesForLongerThanAFrameGetsFewerStrands) {
  for (const double decode_share : {1.2, 2.5, 5.0}) {
    SCOPED_TRACE(decode_share);
    Viewer viewer(
        {.bytes_per_s = 10.0 * kFullBytesPerS, .round_trip_ns = 20 * kMsInNs, .jitter_ns = 5 * kMsInNs});
    viewer.machine.decode_ns = static_cast<int64_t>(decode_share * kStepNs);
    viewer.run(15 * kSInNs);
    const size_t changes = viewer.changes;
    const int64_t from_ns = viewer.time_ns;
    viewer.run(60 * kSInNs);
    const std::vector<StrandClass> classes = make_strand_classes(built_in_plan());
    EXPECT_LE(decode_share * classes[viewer.present].strand_share, kBusyDecodeShare);
    EXPECT_GT(decode_share * classes[viewer.present - 1].strand_share, kBusyDecodeShare) << "no fewer";
    EXPECT_EQ(viewer.changes, changes) << "what it cannot decode is not tried";
    EXPECT_GE(share_of_full_rate(viewer, from_ns), 0.99);
  }
}

// Who tells no times is believed to be slow, as before.
TEST(FlowControl, OfAViewerThatTellsNoTimesEveryDelayCounts) {
  Viewer viewer({.bytes_per_s = 10.0 * kFullBytesPerS, .round_trip_ns = 20 * kMsInNs});
  viewer.machine = {.decode_ns = 2 * kStepNs, .tells_times = false};
  viewer.run(20 * kSInNs);
  EXPECT_GT(viewer.present, 0u);
}

TEST(FlowControl, LongerPathIsNoQueue) {
  Viewer viewer({.round_trip_ns = 20 * kMsInNs});
  viewer.run(10 * kSInNs);
  viewer.link.round_trip_ns = 320 * kMsInNs;  // another route
  viewer.run(60 * kSInNs);
  const int64_t from_ns = viewer.time_ns;
  viewer.run(10 * kSInNs);
  EXPECT_GE(share_of_full_rate(viewer, from_ns), 0.9);
}

TEST(FlowControl, StalledViewerGetsNothingButAKnockNowAndThen) {
  Viewer viewer({.round_trip_ns = 5 * kMsInNs});
  viewer.run(5 * kSInNs);
  viewer.reads = false;
  viewer.run(1 * kSInNs);
  const size_t held = viewer.flow.in_flight_bytes();
  viewer.run(5 * kSInNs);
  EXPECT_LE(viewer.flow.in_flight_bytes(), held + 6 * kKeyframeBytes);
  EXPECT_NE(viewer.flow.oldest_due_ns(viewer.time_ns), 0);
  viewer.reads = true;
  viewer.run(2 * kSInNs);
  const int64_t from_ns = viewer.time_ns;
  viewer.run(2 * kSInNs);
  EXPECT_GE(viewer.rate_hz(from_ns), 9.0) << "and goes on when it reads again";
}

// A class that the link cannot carry is tried more and more rarely; what it can is found again soon.
TEST(FlowControl, TriesThatFailAreRepeatedAtDoubledTimes) {
  Viewer viewer({.round_trip_ns = 20 * kMsInNs});
  viewer.run(5 * kSInNs);
  const auto classes = make_strand_classes(built_in_plan());
  constexpr size_t kTooMuch = 1;
  ASSERT_GT(relative_cost(classes[kTooMuch]), 0.45);
  ASSERT_LT(relative_cost(classes[kTooMuch + 1]), 0.35);
  viewer.link.bytes_per_s = 0.4 * kFullBytesPerS;
  viewer.run(30 * kSInNs);
  viewer.tries.clear();
  viewer.run(1'200 * kSInNs);
  const std::vector<int64_t> tries_ns = viewer.tries[kTooMuch];
  ASSERT_GE(tries_ns.size(), 6u) << "it never gives up";
  EXPECT_TRUE(viewer.tries[0].empty()) << "no try lasted";
  int64_t least_ns = kFirstProbeNs;
  for (size_t i = 1; i < tries_ns.size(); ++i) {
    least_ns = std::min(2 * least_ns, kLongestProbeNs);
    EXPECT_GE(tries_ns[i] - tries_ns[i - 1], least_ns) << "after " << i << " failures";
  }
  EXPECT_EQ(least_ns, kLongestProbeNs);
  // Once it lasts, the next failure counts as the first.
  viewer.link.bytes_per_s = 1e9;
  viewer.run(3 * kLongestProbeNs);
  ASSERT_EQ(viewer.present, 0u);
  viewer.link.bytes_per_s = 0.4 * kFullBytesPerS;
  viewer.run(kCapacityAgeNs);
  viewer.link.bytes_per_s = 1e9;
  viewer.run(kCapacityAgeNs + 6 * kFirstProbeNs);
  EXPECT_EQ(viewer.present, 0u);
}

// From the worst class it would take a probe for each better one.
TEST(FlowControl, AnotherCodecBeginsWithTheBestClassThatTheLinkCarries) {
  Viewer viewer({.bytes_per_s = 0.25 * kFullBytesPerS, .round_trip_ns = 80 * kMsInNs});
  viewer.run(20 * kSInNs);
  ASSERT_GT(viewer.present, 1u);
  const std::vector<StrandClass> classes = make_strand_classes(built_in_plan());
  const auto begun_with = [&](double bytes_per_s) {
    std::vector<double> costs;
    for (const StrandClass& row : classes) costs.push_back(bytes_per_s * relative_cost(row));
    return viewer.flow.begin_codec({viewer.present, costs, 0.0, classes}, viewer.time_ns);
  };
  EXPECT_EQ(begun_with(0.05 * kFullBytesPerS), 0u);
  const size_t carried = begun_with(kFullBytesPerS);
  EXPECT_LE(relative_cost(classes[carried]), 0.25);
  EXPECT_GT(relative_cost(classes[carried - 1]), 0.2);
  EXPECT_EQ(viewer.flow.begin_codec({viewer.present, {}, 0.0, classes}, viewer.time_ns), 0u) << "not known";

  // As for the first codec: what the link could not carry is seldom tried, also when that is forgotten.
  viewer.present = begun_with(kFullBytesPerS);
  viewer.tries.clear();
  viewer.run(kCapacityAgeNs + 6 * kFirstProbeNs);
  for (size_t better = 0; better < carried; ++better) EXPECT_TRUE(viewer.tries[better].empty()) << better;
}

TEST(FlowControl, CapIsKept) {
  Viewer viewer({.round_trip_ns = 5 * kMsInNs});
  viewer.cap_bytes_per_s = 0.5 * kFullBytesPerS;
  viewer.run(60 * kSInNs);
  const auto classes = make_strand_classes(built_in_plan());
  EXPECT_LE(relative_cost(classes[viewer.present]), 0.5);
  EXPECT_GT(relative_cost(classes[viewer.present - 1]), 0.5) << "no lower than the cap asks for";
}

TEST(FlowControl, WithoutAcknowledgementsNothingIsHeld) {
  FlowControl flow;
  FrameHeader header;
  for (uint32_t i = 1; i < 1'000; ++i) {
    header.sequence = i;
    flow.on_sent(header, 100'000, i);
    EXPECT_TRUE(flow.may_send(i));
  }
  EXPECT_EQ(flow.in_flight_bytes(), 0u);
  EXPECT_EQ(flow.oldest_due_ns(1'000), 0);
}

TEST(FlowControl, ALinkIsNotFloodedBeforeItsFirstAcknowledgement) {
  for (const size_t bytes : {size_t{4} << 10, kFirstBytes, 2 * kFirstBytes}) {
    FlowControl flow;
    flow.expect_acks();
    FrameHeader header;
    header.opcode = Opcode::JpegTiles;
    int64_t time_ns = kSInNs;
    for (; flow.may_send(time_ns) && header.sequence < 1'000; time_ns += kMsInNs) {
      ++header.sequence;
      flow.on_sent(header, bytes, time_ns);
    }
    EXPECT_EQ(flow.in_flight_bytes(), std::max(kFirstBytes, bytes));
    EXPECT_FALSE(flow.may_send(time_ns + 10 * kSInNs));
    flow.on_ack(header.stream_id, header.sequence, time_ns + 10 * kSInNs);
    EXPECT_TRUE(flow.may_send(time_ns + 10 * kSInNs));
  }
}

TEST(FlowControl, AnAcknowledgementIsDueWhenTheLinkCanHaveCarriedItsFrame) {
  FlowControl flow;
  flow.expect_acks();
  flow.on_round_trip(20 * kMsInNs, 1 * kSInNs);
  FrameHeader asset;
  asset.opcode = Opcode::Asset;
  asset.sequence = 1;
  flow.on_sent(asset, 20'000, 1 * kSInNs);
  EXPECT_EQ(flow.oldest_due_ns(2 * kSInNs), 1 * kSInNs + 20 * kMsInNs) << "nothing is known of the rate";
  flow.on_written(asset, 3 * kSInNs);
  EXPECT_EQ(flow.oldest_due_ns(3 * kSInNs), 3 * kSInNs + 20 * kMsInNs) << "it gets on";

  flow.on_ack(asset.stream_id, asset.sequence, 3 * kSInNs + 20 * kMsInNs);  // 20 kB in 2 s
  FrameHeader first = asset, second = asset;
  first.opcode = second.opcode = Opcode::StrandKeyframe;
  first.sequence = 2;
  second.sequence = 3;
  flow.on_sent(first, 50'000, 4 * kSInNs);
  EXPECT_NEAR(static_cast<double>(flow.oldest_due_ns(4 * kSInNs)), 9.02 * kSInNs, 1.0 * kMsInNs);
  flow.on_sent(second, 50'000, 5 * kSInNs);
  flow.on_written(second, 6 * kSInNs);
  EXPECT_NEAR(static_cast<double>(flow.oldest_due_ns(6 * kSInNs)), 9.02 * kSInNs, 1.0 * kMsInNs)
      << "what follows may lie in a kernel's buffer, of a client that sleeps";

  flow.on_ack(second.stream_id, second.sequence, 14 * kSInNs);
  second.sequence = 4;
  flow.on_sent(second, 60'000'000, 20 * kSInNs);
  EXPECT_EQ(flow.oldest_due_ns(20 * kSInNs), 20 * kSInNs + flow.base_ns() + kLongestTransferNs)
      << "but not for ever";
}

/// A viewer whose asset of 100 kB is on its way over a link, since 1 s.
struct AssetOnItsWay {
  static constexpr size_t kBytes = 100'000;
  AssetOnItsWay() {
    flow.expect_acks();
    flow.on_round_trip(80 * kMsInNs, 1 * kSInNs);
    asset.opcode = Opcode::Asset;
    asset.sequence = 1;
    flow.on_sent(asset, kBytes, 1 * kSInNs);
  }
  /// TCP's acknowledgements until a time, each a round trip after its bytes went out.
  void watch(double bytes_per_ms, int64_t until_ms) {
    for (int64_t ms = 0; ms <= until_ms; ms += 50) {
      const auto taken = bytes_per_ms * static_cast<double>(std::max<int64_t>(ms - 80, 0));
      flow.on_asset_left(kBytes - std::min(kBytes, static_cast<size_t>(taken)), 1 * kSInNs + ms * kMsInNs);
    }
  }
  FlowControl flow;
  FrameHeader asset;
};

TEST(FlowControl, ASlowAssetShowsTheLinkBeforeAllOfItIsThere) {
  AssetOnItsWay slow;
  slow.watch(250.0, 250);  // 2 Mbit/s: 42 kB are there
  EXPECT_TRUE(slow.flow.awaits_asset());
  EXPECT_FALSE(slow.flow.may_start(1 * kSInNs + 250 * kMsInNs));
  slow.watch(250.0, 300);
  EXPECT_FALSE(slow.flow.awaits_asset());
  EXPECT_NEAR(slow.flow.capacity_bytes_per_s(1 * kSInNs + 300 * kMsInNs), 250e3, 10e3);
  const std::vector<double> costs = {600e3, 300e3, 150e3, 20e3};
  EXPECT_EQ(slow.flow.choose_class({0, costs}, 1 * kSInNs + 300 * kMsInNs), 2u) << "the first frame fits";
  EXPECT_EQ(AssetOnItsWay().flow.choose_class({0, costs}, 1 * kSInNs + 300 * kMsInNs), 0u);
  EXPECT_FALSE(slow.flow.may_start(1 * kSInNs + 300 * kMsInNs)) << "the link has enough to do";
  EXPECT_TRUE(slow.flow.may_start(1 * kSInNs + 360 * kMsInNs))
      << "the link would stand idle for a round trip";
  FrameHeader first = slow.asset;
  first.opcode = Opcode::StrandKeyframe;
  first.sequence = 2;
  slow.flow.on_sent(first, 5'000, 1 * kSInNs + 360 * kMsInNs);
  EXPECT_FALSE(slow.flow.may_start(1 * kSInNs + 365 * kMsInNs));
  EXPECT_TRUE(slow.flow.may_start(1 * kSInNs + 400 * kMsInNs));
  slow.flow.on_ack(slow.asset.stream_id, slow.asset.sequence, 1 * kSInNs + 480 * kMsInNs);
  EXPECT_EQ(slow.flow.in_flight_bytes(), 5'000u);
  EXPECT_NEAR(slow.flow.capacity_bytes_per_s(1 * kSInNs + 480 * kMsInNs), 250e3, 10e3);
}

TEST(FlowControl, WhatIsNotKnownIsNotGuessedFromPartsOfAnAsset) {
  AssetOnItsWay fast;
  fast.watch(2'000.0, 100);  // all but 60 kB within 20 ms: TCP has only begun
  EXPECT_TRUE(fast.flow.awaits_asset());
  AssetOnItsWay buffered;
  for (int64_t ms = 0; ms <= 400; ms += 50)  // a proxy has taken 60 kB at once, and passes 50 kB a second on
    buffered.flow.on_asset_left(40'000 - static_cast<size_t>(50 * ms), 1 * kSInNs + ms * kMsInNs);
  EXPECT_NEAR(buffered.flow.capacity_bytes_per_s(1 * kSInNs + 400 * kMsInNs), 50e3, 1e3);
  AssetOnItsWay taken;
  taken.watch(5'000.0, 400);
  EXPECT_TRUE(taken.flow.awaits_asset()) << "a proxy has all of it, and passes it on as the link beyond can";
  AssetOnItsWay still;
  still.watch(0.0, 10'000);
  EXPECT_TRUE(still.flow.awaits_asset()) << "nothing came, however long it takes";
  FlowControl others;
  others.on_asset_left(0, 1 * kSInNs);
  EXPECT_FALSE(others.awaits_asset()) << "a client without acknowledgements";
}

TEST(FlowControl, UnknownAndRepeatedAcknowledgementsChangeNothing) {
  FlowControl flow;
  flow.expect_acks();
  FrameHeader header;
  header.stream_id = 2;
  for (uint32_t i = 1; i <= 5; ++i) {
    header.sequence = i;
    flow.on_sent(header, 1'000, i * kMsInNs);
  }
  flow.on_ack(2, 9, 10 * kMsInNs);
  flow.on_ack(1, 3, 10 * kMsInNs);
  EXPECT_EQ(flow.in_flight_bytes(), 5'000u);
  flow.on_ack(2, 3, 10 * kMsInNs);
  EXPECT_EQ(flow.in_flight_bytes(), 2'000u) << "those before it arrived too";
  flow.on_ack(2, 3, 11 * kMsInNs);
  EXPECT_EQ(flow.in_flight_bytes(), 2'000u);
}

TEST(StrandClasses, GetCheaperAndKeepTheirBounds) {
  for (const float bound_m : {1e-6f, 2e-5f, 5e-5f, 1e-4f, 5e-4f})
    for (const double step_rate_hz : {10.0, 30.0, 60.0, 240.0}) {
      const auto classes = make_strand_classes({step_rate_hz, 0.0, bound_m, 10'000});
      ASSERT_FALSE(classes.empty());
      EXPECT_EQ(classes[0].rate_divisor, 1u);
      EXPECT_EQ(classes[0].bound_m, bound_m);
      for (size_t i = 1; i < classes.size(); ++i) {
        for (const StrandCodecInfo& codec : strand_codecs())
          for (const double bytes : {50.0, 500.0, 50'000.0})
            EXPECT_LT(expected_bytes_per_s(codec.bytes, {classes[0], bytes}, classes[i]),
                      expected_bytes_per_s(codec.bytes, {classes[0], bytes}, classes[i - 1]) * (1.0 + 1e-9))
                << codec.name;
        EXPECT_GE(classes[i].frame_rate_hz, kLeastFrameRateHz);
        EXPECT_LE(classes[i].bound_m, kCoarsestBoundM * 1.0001f);
        // The published lattice is within `bound`; a lattice k times coarser adds at most k times as much.
        EXPECT_GE(classes[i].bound_m,
                  bound_m * static_cast<float>(classes[i].coarsening > 1 ? 1 + classes[i].coarsening : 1) *
                      0.9999f);
      }
    }
}

TEST(StrandClasses, FirstHaveFewerStrandsThenALowerRateThenACoarserBound) {
  const auto classes = make_strand_classes({60.0, 0.0, 1e-4f, 10'000});
  for (size_t i = 1; i < classes.size(); ++i) {
    const StrandClass& worse = classes[i];
    const StrandClass& better = classes[i - 1];
    EXPECT_LE(worse.strand_share, better.strand_share);
    EXPECT_GE(worse.rate_divisor, better.rate_divisor);
    EXPECT_GE(worse.coarsening, better.coarsening);
    EXPECT_TRUE(worse.rate_divisor == 1 || worse.strand_share == classes.back().strand_share) << i;
    EXPECT_TRUE(worse.rate_divisor == better.rate_divisor || better.rate_divisor > 1 || worse.coarsening == 1)
        << i;
  }
  EXPECT_EQ(classes[1].strand_share, 0.5f);
  EXPECT_EQ(classes.back().strand_share, 0.125f);
  EXPECT_GT(classes.back().coarsening, 1u);
}

TEST(StrandClasses, KeepEnoughStrands) {
  for (const uint32_t strands : {1u, kLeastPrefixStrands, 2 * kLeastPrefixStrands - 1,
                                 2 * kLeastPrefixStrands, 4 * kLeastPrefixStrands, 200'000u})
    for (const StrandClass& row : make_strand_classes({60.0, 0.0, 1e-4f, strands})) {
      const auto left = static_cast<uint32_t>(row.strand_share * static_cast<float>(strands));
      EXPECT_TRUE(row.strand_share == 1.0f || left >= kLeastPrefixStrands) << strands;
    }
  EXPECT_EQ(make_strand_classes({60.0, 0.0, 1e-4f, 2 * kLeastPrefixStrands})[1].strand_share, 0.5f);
}

TEST(StrandClasses, KeepTheRateThatIsSet) {
  for (const double rate_hz : {0.0, 0.5, 7.0, 20.0, 30.0, 59.9, 60.0, 1'000.0})
    for (const StrandClass& row : make_strand_classes({60.0, rate_hz, 1e-4f, 2'000})) {
      EXPECT_TRUE(rate_hz < 1.0 || row.frame_rate_hz <= rate_hz + 1e-9) << rate_hz;
      EXPECT_LE(row.rate_divisor, kMaxRateDivisor);
    }
  EXPECT_EQ(make_strand_classes({60.0, 20.0, 1e-4f, 2'000})[0].rate_divisor, 3u);
  EXPECT_EQ(make_strand_classes({60.0, 0.0, 1e-4f, 2'000})[0].rate_divisor, 1u);
}

TEST(StrandClasses, AreToldInWords) {
  const auto classes = make_strand_classes({60.0, 0.0, 1e-4f, 10'000});
  EXPECT_EQ(to_string(classes[0]), "all strands, 60 Hz, 0.1 mm");
  EXPECT_EQ(to_string(classes[2]), "1/4 of the strands, 60 Hz, 0.1 mm");
}

}  // namespace
}  // namespace strandcast::flow_control_test
