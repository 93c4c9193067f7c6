// What ModePolicy predicts and chooses, against numbers worked out by hand from its rules: rate is the least
// of what stream, link, server and viewer allow; a picture 250 ms late is worth half.
#include "server/app/mode_policy.h"
#include "common/base/units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/net/flow_control.h"

namespace strandcast::mode_policy_test {
namespace {

using testing::HasSubstr;
using Limit = ModePrediction::Limit;

/// Strands of 1 MB/s at 60 Hz or 0.2 MB/s at 10 Hz; pictures of 10 kB, 15 a second, drawn in 20 ms.
ModeFacts facts() {
  ModeFacts known;
  known.strand_classes = {{1e6, 60.0}, {0.2e6, 10.0}};
  known.paint_ms = 20.0;
  known.picture_bytes = 10e3;
  known.picture_rate_hz = 15.0;
  return known;
}
/// The link whose usable share is so many bytes per second.
double link_of(double usable_bytes_per_s) {
  return usable_bytes_per_s / kUsableShare;
}

TEST(ModePrediction, NothingKnownLimitsNothing) {
  const ModePrediction strands = predict_strands(facts());
  EXPECT_EQ(strands.rate_hz, 60.0);
  EXPECT_EQ(strands.limit, Limit::Stream);
  EXPECT_EQ(strands.strand_class, 0u);
  EXPECT_EQ(strands.latency_ms, 0.0);
  const ModePrediction frames = predict_frames(facts());
  EXPECT_EQ(frames.rate_hz, 15.0);
  EXPECT_EQ(frames.latency_ms, 20.0);
}

TEST(ModePrediction, TheLinkChoosesTheClassThenTheRate) {
  ModeFacts known = facts();
  known.capacity_bytes_per_s = link_of(0.5e6);  // between the two classes
  ModePrediction strands = predict_strands(known);
  EXPECT_EQ(strands.strand_class, 1u);
  EXPECT_EQ(strands.rate_hz, 10.0);
  EXPECT_EQ(strands.limit, Limit::Stream);
  known.capacity_bytes_per_s = link_of(0.05e6);  // a quarter of the least class
  strands = predict_strands(known);
  EXPECT_DOUBLE_EQ(strands.rate_hz, 2.5);
  EXPECT_EQ(strands.limit, Limit::Link);
  // 20 kB of a frame over 58.8 kB/s, and 200 ms that wait on a full link.
  EXPECT_NEAR(strands.latency_ms, 20e3 / link_of(0.05e6) * 1e3 + 200.0, 1e-9);
  const ModePrediction frames = predict_frames(known);
  EXPECT_DOUBLE_EQ(frames.rate_hz, 5.0);
  EXPECT_EQ(frames.limit, Limit::Link);
}

TEST(ModePrediction, TheSlowerOfDecodingAndDrawingLimitsTheViewer) {
  ModeFacts known = facts();
  known.strand_decode_ms = 50.0;
  known.strand_draw_ms = 250.0;
  known.round_trip_ms = 40.0;
  const ModePrediction strands = predict_strands(known);
  EXPECT_EQ(strands.rate_hz, 4.0);
  EXPECT_EQ(strands.limit, Limit::Viewer);
  EXPECT_EQ(strands.latency_ms, 20.0 + 50.0 + 250.0);
  known.paint_ms = 100.0;
  EXPECT_EQ(predict_frames(known).rate_hz, 10.0);
  EXPECT_EQ(predict_frames(known).limit, Limit::Server);
}

TEST(ModePrediction, WorthCountsUsefulPicturesAndHalvesLateOnes) {
  EXPECT_EQ((ModePrediction{60.0, 0.0}).worth(), 60.0);
  EXPECT_EQ((ModePrediction{120.0, 0.0}).worth(), kMostUsefulHz);
  EXPECT_EQ((ModePrediction{30.0, kHalfWorthMs}).worth(), 15.0);
}

/// Choices with these facts from `begin_s` on, a look each 250 ms for so long; the last one.
ModeChoice choose_for(ModePolicy& policy, StreamMode present, const ModeFacts& known, double begin_s,
                      double seconds) {
  ModeChoice choice;
  for (double t_s = begin_s; t_s <= begin_s + seconds; t_s += 0.25)
    choice = policy.choose(present, known, static_cast<int64_t>(t_s * 1e9));
  return choice;
}

struct Case {
  const char* name;
  ModeFacts known;
  StreamMode from_strands, from_frames;  // what is chosen after long enough
  const char* reason;                    // part of it, from strands
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&](const char* name, auto change, StreamMode from_strands, StreamMode from_frames,
                       const char* reason) {
    ModeFacts known = facts();
    change(known);
    all.push_back({name, known, from_strands, from_frames, reason});
  };
  constexpr StreamMode kStrands = StreamMode::Strands, kFrames = StreamMode::Frames;
  add(
      "all is well", [](ModeFacts&) {}, kStrands, kStrands, "60.0 pictures per second drawn here");
  // 3 Hz at 333 ms is worth 1.3, 15 Hz at 20 ms 13.9.
  add(
      "slow drawing", [](ModeFacts& f) { f.strand_draw_ms = 333.3; }, kFrames, kFrames,
      "this machine draws 3.0 pictures per second of these strands, the server 15.0");
  // Both draw in 200 ms: equal worth is no reason to leave strands, nor to go back.
  add(
      "both slow", [](ModeFacts& f) { f.strand_draw_ms = f.paint_ms = 200.0; }, kStrands, kFrames, "5.0");
  // Worth 7.1 against 13.9: nearly twice.
  add(
      "rather slow drawing", [](ModeFacts& f) { f.strand_draw_ms = 100.0; }, kFrames, kFrames, "10.0");
  // 12.5 Hz at 80 ms: 9.5; 13.9 is less than 1.5 times that, but still more.
  add(
      "between", [](ModeFacts& f) { f.strand_draw_ms = 80.0; }, kStrands, kFrames, "12.5");
  // 2.5 Hz against 5 Hz, on a full link both.
  add(
      "slow link", [](ModeFacts& f) { f.capacity_bytes_per_s = link_of(0.05e6); }, kFrames, kFrames,
      "the link takes 0.47 Mbit/s and strands at 10 Hz need one of 1.88");
  // 10 Hz of strands fit and 15 Hz of pictures: 10 x 250 / (250 + 68) = 7.9 against 15 x 250 / (250 + 54)
  // = 12.3.
  add(
      "link for the least class", [](ModeFacts& f) { f.capacity_bytes_per_s = link_of(0.25e6); }, kFrames,
      kFrames, "strands come at 10.0 Hz");
  add(
      "slow pictures", [](ModeFacts& f) { f.paint_ms = 1e3; }, kStrands, kStrands, "60.0");
  add(
      "no strands here", [](ModeFacts& f) { f.device = DrawingDevice::None; }, kFrames, kFrames,
      "cannot draw strands");
  add(
      "no pictures there",
      [](ModeFacts& f) {
        f.paint_trouble = "no GL";
        f.strand_draw_ms = 1e3;
      },
      kStrands, kStrands, "no GL");
  return all;
}

TEST(ModePolicy, ChoosesByTheTable) {
  for (const Case& row : cases()) {
    ModePolicy policy;
    const ModeChoice choice = choose_for(policy, StreamMode::Strands, row.known, 1.0, 2.0);
    EXPECT_EQ(choice.mode, row.from_strands) << row.name << ": " << choice.reason;
    EXPECT_THAT(choice.reason, HasSubstr(row.reason)) << row.name;
    EXPECT_EQ(choose_for(policy, StreamMode::Frames, row.known, 11.0, 2.0).mode, row.from_frames) << row.name;
  }
}

/// What a person is told next to the numbers, of a viewer that has just asked the server to choose.
TEST(ModePolicy, AReasonSaysWhyItsNumbersDoNotDecide) {
  const auto reason = [](StreamMode present, double draw_ms, double paint_ms, bool is_guessed = false) {
    ModeFacts known = facts();
    known.strand_draw_ms = draw_ms;
    known.paint_ms = paint_ms;
    known.is_paint_guessed = is_guessed;
    ModePolicy policy;
    const ModeChoice choice = policy.choose(present, known, kSInNs);
    EXPECT_EQ(choice.mode, present) << "a wish must last";
    return choice.reason;
  };
  // 2 Hz here, 0.6 Hz there.
  EXPECT_THAT(reason(StreamMode::Frames, 500.0, 1666.7),
              testing::EndsWith("2.0 pictures per second of these strands, the server 0.6; strands come when "
                                "that has lasted"));
  EXPECT_THAT(reason(StreamMode::Strands, 500.0, 20.0),
              testing::EndsWith("; pictures come when that has lasted"));
  // As in "between" above.
  EXPECT_THAT(reason(StreamMode::Strands, 80.0, 20.0),
              testing::EndsWith("; pictures would have to be worth 1.5 times as much"));
  EXPECT_THAT(reason(StreamMode::Strands, 100.0, 20.0, true), testing::EndsWith("worth 8 times as much"));
  // Where the numbers decide, nothing is added.
  EXPECT_THAT(reason(StreamMode::Frames, 333.3, 20.0), testing::EndsWith("the server 15.0"));
  EXPECT_THAT(reason(StreamMode::Strands, 20.0, 1666.7), testing::EndsWith("0.6 from the server"));
  // More pictures, so late that they are worth less: 10 Hz at 100 ms against 10.5 Hz at 315 ms, nobody's
  // limit.
  ModeFacts late = facts();
  late.strand_draw_ms = 100.0;
  late.paint_ms = 95.0;
  late.picture_bytes = 120e3;
  late.capacity_bytes_per_s = link_of(1.5e6);
  EXPECT_THAT(ModePolicy().choose(StreamMode::Strands, late, kSInNs).reason,
              testing::ContainsRegex("strands are [0-9]+ ms late, pictures [0-9]+$"));
}

TEST(ModePolicy, AGlitchChangesNothing) {
  ModeFacts slow = facts();
  slow.strand_draw_ms = 500.0;
  ModePolicy policy;
  for (int second = 1; second < 20; second += 2) {
    // Three quarters of a second of trouble, then none.
    EXPECT_EQ(choose_for(policy, StreamMode::Strands, slow, second, 0.75).mode, StreamMode::Strands);
    EXPECT_EQ(choose_for(policy, StreamMode::Strands, facts(), second + 1.0, 0.75).mode, StreamMode::Strands);
  }
  EXPECT_EQ(choose_for(policy, StreamMode::Strands, slow, 30.0, 1.0).mode, StreamMode::Frames);
}

TEST(ModePolicy, DwellsAndDoublesWhenAChangeIsUndone) {
  ModeFacts slow = facts();
  slow.strand_draw_ms = 500.0;
  ModePolicy policy;
  EXPECT_EQ(choose_for(policy, StreamMode::Strands, slow, 1.0, 1.0).mode, StreamMode::Frames);
  policy.note_change(2 * kSInNs);
  // Better at once, but the dwell of 5 s holds.
  EXPECT_EQ(choose_for(policy, StreamMode::Frames, facts(), 2.0, 4.75).mode, StreamMode::Frames);
  EXPECT_EQ(choose_for(policy, StreamMode::Frames, facts(), 7.0, 0.0).mode, StreamMode::Strands);
  policy.note_change(7 * kSInNs);
  EXPECT_EQ(policy.dwell_ns(), 2 * kFirstDwellNs) << "undone after 5 s";
  EXPECT_EQ(choose_for(policy, StreamMode::Strands, slow, 7.0, 9.75).mode, StreamMode::Strands);
  EXPECT_EQ(choose_for(policy, StreamMode::Strands, slow, 17.0, 0.0).mode, StreamMode::Frames);
  policy.note_change(17 * kSInNs);
  EXPECT_EQ(policy.dwell_ns(), 4 * kFirstDwellNs);
  policy.note_change(60 * kSInNs);
  EXPECT_EQ(policy.dwell_ns(), kFirstDwellNs) << "it had lasted for more than twice 20 s";
  for (int i = 0; i < 10; ++i) policy.note_change((61 + i) * kSInNs);
  EXPECT_EQ(policy.dwell_ns(), kLongestDwellNs);
}

/// A viewer and a server whose times never change: what it says of itself, what drawing there is guessed to
/// take, and what it takes, which is known once it was done.
struct SteadyWorld {
  double draw_ms, guessed_paint_ms, paint_ms;
};

/// The times of all changes in ten minutes of this world, with a look each 250 ms.
std::vector<double> changes_in(const SteadyWorld& world) {
  ModePolicy policy;
  StreamMode present = StreamMode::Strands;
  bool was_painted = false;
  std::vector<double> changed_s;
  for (double t_s = 1.0; t_s < 600.0; t_s += 0.25) {
    ModeFacts known = facts();
    known.strand_draw_ms = world.draw_ms;
    known.is_paint_guessed = !was_painted;
    known.paint_ms = was_painted ? world.paint_ms : world.guessed_paint_ms;
    const auto time_ns = static_cast<int64_t>(t_s * 1e9);
    const StreamMode chosen = policy.choose(present, known, time_ns).mode;
    if (chosen == present) continue;
    present = chosen;
    was_painted = was_painted || present == StreamMode::Frames;
    policy.note_change(time_ns);
    changed_s.push_back(t_s);
  }
  return changed_s;
}

TEST(ModePolicy, UnderSteadyConditionsItChangesOnceAndOnceBackWhenTheGuessWasWrong) {
  const std::vector<double> times_ms{5.0, 20.0, 70.0, 150.0, 300.0, 600.0, 1200.0, 2500.0, 10'000.0};
  for (const double draw_ms : times_ms)
    for (const double guessed_ms : times_ms)
      for (const double paint_ms : times_ms) {
        const auto changes = changes_in({draw_ms, guessed_ms, paint_ms});
        const std::string world =
            fmt::format("drawn here {} ms, guessed {}, there {}", draw_ms, guessed_ms, paint_ms);
        ASSERT_LE(changes.size(), 2u) << world;
        if (changes.size() < 2) continue;
        EXPECT_GE(changes[1] - changes[0], 5.0) << world;
        EXPECT_GT(paint_ms, guessed_ms) << world << ": the guess was right";
      }
}

TEST(ModePolicy, AGuessThatIsNotMuchBetterIsNotTried) {
  // A processor that draws 1.4 pictures a second, and a server on the same processor: guessed 2.2, really
  // 0.5.
  EXPECT_TRUE(changes_in({700.0, 450.0, 2000.0}).empty());
  // The same viewer and a server that is guessed to have a GPU, and has.
  EXPECT_EQ(changes_in({700.0, 10.0, 12.0}).size(), 1u);
}

TEST(ModePolicy, WhatIsImpossibleWaitsForNoDwellButAFailureDoes) {
  ModeFacts blind = facts();
  blind.device = DrawingDevice::None;
  ModePolicy policy;
  policy.note_change(kSInNs);
  EXPECT_EQ(policy.choose(StreamMode::Strands, blind, kSInNs + 1).mode, StreamMode::Frames);
  policy.note_failure(2 * kSInNs);
  EXPECT_EQ(policy.choose(StreamMode::Strands, blind, 2 * kSInNs + 1).mode, StreamMode::Strands);
  EXPECT_EQ(policy.choose(StreamMode::Strands, blind, 2 * kSInNs + policy.dwell_ns()).mode,
            StreamMode::Frames);
}

TEST(ModeFacts, GuessesUntilSomethingWasMeasured) {
  const std::vector<StrandClass> classes = make_strand_classes({60.0, 0.0, 1e-4f, 1});
  LinkState link;
  link.strand_bytes_per_s = {10.0, 9.0, 8.0};
  ModeSources sources{.strand_classes = classes,
                      .link = link,
                      .report = {1.0, 2.0, 3.0, 4.0, DrawingDevice::Software},
                      .pictures = {},
                      .paint_trouble = {},
                      .is_software = true,
                      .picture_size = {640, 360},
                      .view_count = 2,
                      .picture_rate_hz = 12.0};
  ModeFacts known = gather_mode_facts(sources);
  ASSERT_EQ(known.strand_classes.size(), classes.size());
  EXPECT_EQ(known.strand_classes[2].bytes_per_s, 8.0);
  EXPECT_EQ(known.strand_classes[3].bytes_per_s, 0.0) << "unknown";
  EXPECT_EQ(known.strand_classes[1].rate_hz, 30.0);
  EXPECT_EQ(known.strand_decode_ms, 1.0);
  EXPECT_EQ(known.strand_draw_ms, 2.0);
  EXPECT_EQ(known.picture_decode_ms, 3.0);
  EXPECT_EQ(known.device, DrawingDevice::Software);
  EXPECT_NEAR(known.paint_ms, 2 * 60.0, 1e-9);
  EXPECT_TRUE(known.is_paint_guessed);
  sources.is_software = false;
  EXPECT_FALSE(gather_mode_facts(sources).is_paint_guessed) << "a GPU is that fast or faster";
  EXPECT_EQ(gather_mode_facts(sources).paint_ms, 2 * kGuessedHardwareMs);
  sources.pictures.frames = 4;
  sources.is_software = true;
  sources.pictures.bytes = 40'000;
  sources.pictures.paint_median_ms = 30.0;
  sources.pictures.encode_median_ms = 5.0;
  known = gather_mode_facts(sources);
  EXPECT_EQ(known.paint_ms, 70.0);
  EXPECT_FALSE(known.is_paint_guessed);
  EXPECT_EQ(known.picture_bytes, 10e3);
}

}  // namespace
}  // namespace strandcast::mode_policy_test
