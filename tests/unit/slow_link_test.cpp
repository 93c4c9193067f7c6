// The built-in scene over slow links, on paper (tests/support/simulated_viewer.h): how late frames may be,
// and how coarse.
#include "common/base/units.h"
#include "server/net/strand_class.h"
#include "tests/support/simulated_viewer.h"

namespace strandcast::slow_link_test {
namespace {

using namespace simulated;

constexpr int64_t kLatestNs = 250 * kMsInNs;
constexpr int64_t kAdaptedNs = 3 * kSInNs;

/// A viewer that has had time to adapt to its link.
class AdaptedViewer : public Viewer {
 public:
  AdaptedViewer(double mbit_per_s, int64_t round_trip_ms, int64_t reader_ms, Content what = turning_head())
      : Viewer({.bytes_per_s = mbit_per_s * 125e3,
                .round_trip_ns = round_trip_ms * kMsInNs,
                .jitter_ns = 10 * kMsInNs,
                .reader_ns = reader_ms * kMsInNs},
               std::move(what)) {
    while (arrivals.empty()) run(10 * kMsInNs);
    run(kAdaptedNs);
  }
};

// Three seconds after the first frame the class is found, and nothing that the hair does changes it any more.
TEST(SlowLink, TheClassIsSettledWithinThreeSecondsAndStays) {
  const std::vector<Content> contents = {Content{}, turning_head()};
  for (size_t content = 0; content < contents.size(); ++content)
    for (const double mbit_per_s : {1.0, 1.5, 2.0, 3.0, 5.0, 10.0})
      for (const int64_t round_trip_ms : {20, 100, 300})
        for (const int64_t reader_ms : {1, 20, 40}) {
          SCOPED_TRACE(fmt::format("content {}, {} Mbit/s, {} ms, read every {} ms", content, mbit_per_s,
                                   round_trip_ms, reader_ms));
          AdaptedViewer viewer(mbit_per_s, round_trip_ms, reader_ms, contents[content]);
          const int64_t adapted_ns = viewer.time_ns;
          const size_t changes = viewer.changes;
          viewer.run(20 * kSInNs - kAdaptedNs);
          EXPECT_EQ(viewer.changes, changes);
          EXPECT_GE(viewer.rate_hz(adapted_ns), 10.0);
          EXPECT_LE(viewer.worst_age_ns(adapted_ns), kLatestNs);
        }
}

// Quick turns of the head, tries of better classes and the keyframes that both cost are all in this time.
TEST(SlowLink, NoFrameIsLaterThanAQuarterOfASecond) {
  for (const double mbit_per_s : {1.0, 2.0, 3.0, 5.0})
    for (const int64_t round_trip_ms : {20, 100})
      for (const int64_t reader_ms : {1, 20}) {
        SCOPED_TRACE(fmt::format("{} Mbit/s, {} ms, read every {} ms", mbit_per_s, round_trip_ms, reader_ms));
        AdaptedViewer viewer(mbit_per_s, round_trip_ms, reader_ms);
        const int64_t adapted_ns = viewer.time_ns;
        viewer.run(40 * kSInNs);
        EXPECT_LE(viewer.worst_age_ns(adapted_ns), kLatestNs);
        EXPECT_GE(viewer.rate_hz(adapted_ns), 10.0);
      }
}

TEST(SlowLink, StrandsAreNoCoarserThanTheyMustBe) {
  const auto classes = make_strand_classes(built_in_plan());
  for (const double mbit_per_s : {2.0, 5.0, 10.0}) {
    SCOPED_TRACE(mbit_per_s);
    size_t fitting = 0;
    while (relative_cost(classes[fitting]) * turning_head().bytes_per_s > kUsableShare * mbit_per_s * 125e3)
      ++fitting;
    AdaptedViewer viewer(mbit_per_s, 20, 1);
    const int64_t adapted_ns = viewer.time_ns;
    viewer.run(60 * kSInNs);
    size_t coarser = 0;
    const auto arrivals = viewer.arrivals_since(adapted_ns);
    for (const auto& arrival : arrivals) coarser += arrival.stream > fitting ? 1 : 0;
    // A quick turn may cost a class for the quiet time that a try needs, once in twelve seconds.
    EXPECT_LE(coarser, arrivals.size() / 2);
  }
}

// What came at the end of a try was 412 ms old: its queue was still there when the keyframe of the class
// below came.
TEST(SlowLink, KeyframeWaitsForTheQueueToDrain) {
  FlowControl flow;
  flow.expect_acks();
  flow.on_round_trip(20 * kMsInNs, kSInNs);
  FrameHeader header;
  header.opcode = Opcode::Asset;
  header.sequence = 1;
  flow.on_sent(header, 250'000, kSInNs);
  flow.on_ack(0, 1, 2 * kSInNs + 20 * kMsInNs);  // so the link carries 250 bytes per ms
  header.opcode = Opcode::StrandDelta;
  for (header.sequence = 2; header.sequence < 22; ++header.sequence) flow.on_sent(header, 1'500, 3 * kSInNs);
  // 30,000 bytes take 120 ms.
  EXPECT_TRUE(flow.may_send(3 * kSInNs));
  EXPECT_FALSE(flow.may_start(3 * kSInNs));
  EXPECT_FALSE(flow.may_start(3 * kSInNs + 119 * kMsInNs - kStartDelayNs));
  EXPECT_TRUE(flow.may_start(3 * kSInNs + 121 * kMsInNs - kStartDelayNs));
  // And 60,000 take 240, which is too much for any frame.
  for (; header.sequence < 42; ++header.sequence) flow.on_sent(header, 1'500, 3 * kSInNs);
  EXPECT_FALSE(flow.may_send(3 * kSInNs + 239 * kMsInNs - kGateQueueNs));
  EXPECT_TRUE(flow.may_send(3 * kSInNs + 241 * kMsInNs - kGateQueueNs));
}

// A client that happened to look at once, or late, would make the link seem fast, or slow, for half a minute.
TEST(SlowLink, AShortKeyframeSaysNothingAgainstTheAsset) {
  FlowControl flow;
  flow.expect_acks();
  constexpr int64_t kRoundTripNs = 20 * kMsInNs;
  flow.on_round_trip(kRoundTripNs, kSInNs);
  int64_t time_ns = kSInNs;
  FrameHeader header;
  const auto deliver = [&](Opcode opcode, size_t bytes, int64_t transfer_ns) {
    header.opcode = opcode;
    ++header.sequence;
    flow.on_sent(header, bytes, time_ns);
    time_ns += kRoundTripNs + transfer_ns;
    flow.on_ack(0, header.sequence, time_ns);
    return flow.capacity_bytes_per_s(time_ns);
  };
  EXPECT_DOUBLE_EQ(deliver(Opcode::Asset, 250'000, kSInNs), 250'000.0);
  EXPECT_DOUBLE_EQ(deliver(Opcode::StrandKeyframe, 5'000, 12 * kMsInNs), 250'000.0) << "20 ms are due";
  EXPECT_DOUBLE_EQ(deliver(Opcode::StrandKeyframe, 5'000, 60 * kMsInNs), 250'000.0);
  EXPECT_GT(deliver(Opcode::StrandKeyframe, 50'000, 20 * kMsInNs), 1'000'000.0) << "200 ms were due";
  EXPECT_LT(deliver(Opcode::StrandKeyframe, 50'000, 500 * kMsInNs), 110'000.0) << "20 to 50 were due";
}

}  // namespace
}  // namespace strandcast::slow_link_test
