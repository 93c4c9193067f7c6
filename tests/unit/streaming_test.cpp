// The streaming report without measuring for long: classes of motion, verdicts, the page and the CSV.
#include "server/report/streaming.h"

#include <algorithm>
#include <cmath>

#include "common/replay/strand_fill.h"
#include "common/strands/strand_prefix.h"
#include "server/report/peers/peer_codecs.h"
#include "server/report/streaming_goals.h"
#include "server/report/streaming_page.h"
#include "server/report/svg_bars.h"
#include "tests/support/claims.h"
#include "tests/support/shared_data.h"

namespace strandcast {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(StreamMotion, AHeadIsMeasuredByItsWayAndItsTurn) {
  std::vector<Pose> poses;
  for (int i = 0; i < 120; ++i) {
    const double t_s = i * kStreamFrameS;
    poses.push_back({t_s * glm::dvec3(3.0, 0.0, 4.0), glm::angleAxis(2.0 * t_s, glm::dvec3(0.0, 1.0, 0.0))});
  }
  const HeadPace head = measure_pace(poses, kStreamFrameS);
  EXPECT_NEAR(head.mean_speed_mps, 5.0, 1e-9);
  EXPECT_NEAR(head.mean_turn_rad_per_s, 2.0, 1e-6);
  EXPECT_EQ(measure_pace({}, kStreamFrameS).mean_speed_mps, 0.0);
}

TEST(StreamMotion, TheBuiltInOnesAreWhatTheyAreCalled) {
  std::vector<MotionLevel> classes;
  for (const StreamMotion& motion : built_in_stream_motions()) {
    const auto recording = record_strands({motion, {24, 8}, 3.0, "", nullptr});
    ASSERT_TRUE(recording.ok()) << recording.error().to_string();
    EXPECT_EQ(recording->frames.size(), 180u);
    classes.push_back(recording->motion_level);
  }
  EXPECT_THAT(classes, testing::ElementsAre(MotionLevel::Idle, MotionLevel::Active, MotionLevel::Violent));
}

/// A head that turns at so many rad/s in each of its seconds.
StreamMotion turning(std::vector<double> rad_per_s) {
  const double duration_s = static_cast<double>(rad_per_s.size());
  const auto head_at = [rad_per_s](double t_s) {
    double angle_rad = 0.0;
    for (size_t i = 0; i < rad_per_s.size(); ++i)
      angle_rad += rad_per_s[i] * std::clamp(t_s - static_cast<double>(i), 0.0, 1.0);
    return Pose{glm::dvec3(0.0), glm::angleAxis(angle_rad, glm::dvec3(0.0, 1.0, 0.0))};
  };
  return {"turning", head_at, duration_s};
}

TEST(StreamMotion, IsSurveyedByItsHeadAlone) {
  // 0.25 m of hair at the median of 1 rad/s are 0.25 m/s.
  const MotionSurvey walk = survey_motion(turning({1.0, 0.2, 1.0, 8.0, 1.0, 0.1, 1.0}), 0.5);
  EXPECT_EQ(walk.level, MotionLevel::Active);
  EXPECT_NEAR(walk.median_drive_mps, 0.25, 1e-3);
  EXPECT_GE(walk.begin_s[1], 3.0 - 2 * kStreamFrameS) << "the wildest part is where it turns fastest";
  EXPECT_LE(walk.begin_s[1], 3.5 + 2 * kStreamFrameS);
  const double begin_s = walk.begin_s[0];
  const double turned_rad =
      angle_between_rad(turning({1.0, 0.2, 1.0, 8.0, 1.0, 0.1, 1.0}).head_at(begin_s).rotation,
                        turning({1.0, 0.2, 1.0, 8.0, 1.0, 0.1, 1.0}).head_at(begin_s + 0.5).rotation);
  EXPECT_NEAR(turned_rad, 0.5, 0.03) << "and the median one where it turns as it mostly does";
  EXPECT_EQ(survey_motion(turning({0.1, 0.1, 9.0, 0.1}), 0.5).level, MotionLevel::Idle)
      << "one turn is no dance";
  EXPECT_EQ(survey_motion(turning({3.0, 3.0, 0.1, 3.0}), 0.5).level, MotionLevel::Violent);
  // Longer parts change where they lie, not what the motion is.
  EXPECT_EQ(survey_motion(turning({1.0, 0.2, 1.0, 8.0, 1.0, 0.1, 1.0}), 3.0).level, MotionLevel::Active);
  EXPECT_EQ(survey_motion(turning({}), 0.5).level, MotionLevel::Idle);
}

TEST(StreamRecording, IsOfThePartThatWasAskedFor) {
  const StreamMotion motion = turning({0.5, 0.5, 6.0, 0.5, 0.5});
  std::vector<double> turns;
  for (const MotionPart part : kMotionParts) {
    const auto recording = record_strands({motion, {10, 4}, 0.5, "", nullptr, part});
    ASSERT_TRUE(recording.ok()) << recording.error().to_string();
    EXPECT_EQ(recording->part, part);
    EXPECT_EQ(recording->motion_level, MotionLevel::Active);
    turns.push_back(recording->head.mean_turn_rad_per_s);
  }
  EXPECT_NEAR(turns[0], 0.5, 0.05);
  EXPECT_NEAR(turns[1], 6.0, 0.5);
}

TEST(StreamRecording, RefusesWhatDoesNotFit) {
  StreamMotion motion = built_in_stream_motions().front();
  motion.duration_s = 1.0;
  const auto too_short = record_strands({motion, {10, 4}, 2.0, "", nullptr});
  ASSERT_FALSE(too_short.ok());
  EXPECT_THAT(too_short.error().to_string(), HasSubstr("lasts 1.00 s"));
  motion.duration_s = 100.0;
  const auto too_large = record_strands({motion, {200'000, 64}, 60.0, "", nullptr});
  ASSERT_FALSE(too_large.ok());
  EXPECT_EQ(too_large.error().code, ErrorCode::LimitExceeded);
}

// ---- what the documents say of the strand codec, on strands that the built-in scene's solver moves ----

constexpr StreamSize kClaimedSize = {claims::kStreamStrands, claims::kStreamVertices};
constexpr double kClaimedSeconds = 0.5;

const StreamRecording& recorded(const StreamMotion& motion) {
  static std::map<std::string, StreamRecording> known;
  const auto [found, is_new] = known.try_emplace(motion.name);
  if (!is_new) return found->second;
  auto recording = record_strands({motion, kClaimedSize, kClaimedSeconds, "", nullptr});
  EXPECT_TRUE(recording.ok()) << recording.error().to_string();
  return found->second = std::move(recording).value();
}

/// What `tangent`, then `delta` and then every peer make of a recording at the goals' bound.
StreamingReport coded(const StreamRecording& recording, bool has_peers) {
  StreamingReport report;
  std::vector<StreamCodecRow> codecs = own_stream_codecs(kGoalBoundM);
  std::erase_if(codecs, [](const StreamCodecRow& codec) { return codec.name == "raw"; });
  std::partition(codecs.begin(), codecs.end(),
                 [](const StreamCodecRow& codec) { return codec.name == "tangent"; });
  if (has_peers)
    for (StreamCodecRow& peer : peer_stream_codecs(kGoalBoundM)) codecs.push_back(std::move(peer));
  for (const StreamCodecRow& codec : codecs) {
    const auto row = measure_codec(codec, recording);
    EXPECT_TRUE(row.ok()) << row.error().to_string();
    EXPECT_TRUE(row->keeps_bound()) << codec.name;
    report.rows.push_back(*row);
  }
  return report;
}

/// The documents round up, and by no more than a tenth.
void expect_claimed(double measured, double claimed, const std::string& what) {
  EXPECT_LE(measured, claimed) << what;
  EXPECT_GE(measured, 0.9 * claimed) << what << ": the documents say less than is true";
  fmt::print("{}: {:.3f} of {:g}\n", what, measured, claimed);
}

TEST(StreamClaims, BitsOfTheBuiltInMotions) {
  const std::vector<StreamMotion> motions = built_in_stream_motions();
  const double claimed[] = {claims::kIdleBits, claims::kActiveBits, claims::kViolentBits};
  ASSERT_EQ(motions.size(), std::size(claimed));
  for (size_t i = 0; i < motions.size(); ++i) {
    const StreamingReport report = coded(recorded(motions[i]), false);
    expect_claimed(report.rows[0].bits, claimed[i], motions[i].name);
    const double more = report.rows[1].bits / report.rows[0].bits;
    EXPECT_GE(more, claims::kLeastDeltaRatio) << motions[i].name;
    EXPECT_LE(more, claims::kMostDeltaRatio) << motions[i].name;
    fmt::print("delta: {:.2f} times as many\n", more);
  }
}

TEST(StreamClaims, StrandsThatWereLeftOutAreNearTheTruth) {
  constexpr StreamSize kSize = {claims::kFilledStrands, claims::kStreamVertices};
  constexpr double kSeconds = 0.2;
  const auto recording = record_strands({built_in_stream_motions()[1], kSize, kSeconds, "", nullptr});
  ASSERT_TRUE(recording.ok()) << recording.error().to_string();
  StrandFill fill(recording->shape.rest_in_head_m, kSize.vertex_count);
  const uint32_t sent = kSize.strand_count / 4;
  std::vector<double> off_mm;
  for (const StreamFrame& frame : recording->frames) {
    QuantiseInput input;
    input.strand_count = kSize.strand_count;
    input.vertex_count = kSize.vertex_count;
    input.quantum_m = 1e-6f;
    input.position_in_head_m = frame.position_in_head_m;
    const auto shown = fill.positions(prefix_of(quantise(input).snapshot, sent));
    ASSERT_EQ(shown.size(), frame.position_in_head_m.size());
    for (size_t i = 0; i < shown.size(); ++i)
      if (i % kSize.strand_count >= sent)
        off_mm.push_back(1e3 * static_cast<double>(glm::distance(shown[i], frame.position_in_head_m[i])));
  }
  std::sort(off_mm.begin(), off_mm.end());
  expect_claimed(off_mm[off_mm.size() / 2], claims::kFilledMedianMm, "median, mm");
  expect_claimed(off_mm[off_mm.size() * 95 / 100], claims::kFilledMostMm, "95 %, mm");
}

TEST(StreamClaims, AWalkOfMotionCaptureBesidePeers) {
  const std::filesystem::path clip =
      std::filesystem::path(STRANDCAST_SHARED_DATA) / "mocap" / claims::kStreamClip;
  REQUIRE_SHARED(clip);
  const auto motion = load_stream_motion(clip, {});
  ASSERT_TRUE(motion.ok()) << motion.error().to_string();
  const StreamingReport report = coded(recorded(*motion), true);
  const StreamingRow& ours = report.rows[0];
  expect_claimed(ours.bits, claims::kClipBits, "bits");
  const auto times_fewer = [&](PeerKind kind) { return best_peer(report, ours, kind)->bits / ours.bits; };
  // Of more times fewer bits the documents round down.
  expect_claimed(claims::kTimesFewerThanTemporal, times_fewer(PeerKind::Temporal), "temporal peers");
  expect_claimed(claims::kTimesFewerThanPlain, times_fewer(PeerKind::Plain), "plain peers");
}

StreamingRow row(const char* codec, MotionLevel motion_level, double bits) {
  StreamingRow result;
  result.motion = to_string(motion_level);
  result.motion_level = motion_level;
  result.size = {10'000, 16};
  result.codec = codec;
  result.is_ours = std::string(codec) == "tangent" || std::string(codec) == "delta";
  result.is_temporal = result.is_ours || std::string(codec).ends_with("temporal");
  result.bound_m = kGoalBoundM;
  result.max_error_m = 0.99 * kGoalBoundM;
  result.bits = result.all_bits = bits;
  result.join_bits = 12.9;
  result.decode_cpu_ms = 11.9;
  result.encode_wall_ms = result.encode_cpu_ms = 15.9;
  return result;
}

/// Exactly what the goals ask for.
StreamingReport just_met() {
  StreamingReport report;
  report.processors = 2;
  const std::pair<MotionLevel, double> bits[] = {
      {MotionLevel::Active, 3.5}, {MotionLevel::Idle, 1.8}, {MotionLevel::Violent, 6.0}};
  for (const auto& [motion_level, ours] : bits) {
    report.rows.push_back(row("tangent", motion_level, ours));
    report.rows.push_back(row("delta", motion_level, 2.0 * ours));
    report.rows.push_back(row("draco temporal", motion_level, 2.0 * ours));
    report.rows.push_back(row("zfp temporal", motion_level, 3.0 * ours));
    report.rows.push_back(
        row("draco", motion_level, motion_level == MotionLevel::Violent ? 4.0 * ours : 6.0 * ours));
  }
  for (const auto& [codec, codec_bits] : {std::pair("tangent", 6.0), std::pair("draco temporal", 12.0)}) {
    report.rows.push_back(row(codec, MotionLevel::Active, codec_bits));
    report.rows.back().part = MotionPart::Wildest;
  }
  return report;
}

std::vector<Verdict> verdicts(const StreamingReport& report) {
  std::vector<Verdict> result;
  for (const GoalLine& line : judge_streaming(report)) result.push_back(line.verdict);
  return result;
}

TEST(StreamingGoals, AreMetWhenExactlyReached) {
  EXPECT_THAT(verdicts(just_met()), testing::Each(Verdict::Met));
}

TEST(StreamingGoals, EachIsMissedByALittleTooMuchOfItsOwn) {
  const size_t count = judge_streaming(just_met()).size();
  const std::vector<void (*)(StreamingRow&)> spoils = {
      [](StreamingRow& r) { r.max_error_m = 1.01 * r.bound_m; },
      [](StreamingRow& r) {
        r.bits *= r.motion_level == MotionLevel::Active && r.part == MotionPart::Median ? 1.01 : 1.0;
      },
      [](StreamingRow& r) { r.bits *= r.motion_level == MotionLevel::Idle ? 1.01 : 1.0; },
      [](StreamingRow& r) { r.bits *= r.motion_level == MotionLevel::Violent ? 1.01 : 1.0; },
      [](StreamingRow& r) { r.bits *= r.part == MotionPart::Wildest ? 1.01 : 1.0; },
  };
  for (size_t i = 0; i < spoils.size(); ++i) {
    StreamingReport report = just_met();
    for (StreamingRow& r : report.rows)
      if (r.codec == "tangent") spoils[i](r);
    EXPECT_EQ(verdicts(report)[i], Verdict::Missed) << i;
  }
  StreamingReport report = just_met();
  for (StreamingRow& r : report.rows) {
    r.join_bits = 13.1;
    r.decode_cpu_ms = 12.1;
    r.encode_wall_ms = r.encode_cpu_ms = 16.1;
    if (!r.is_ours) r.bits *= 0.99;
  }
  for (size_t i = spoils.size(); i < count; ++i) EXPECT_EQ(verdicts(report)[i], Verdict::Missed) << i;
  EXPECT_THAT(verdicts(StreamingReport{}), testing::Each(Verdict::NotMeasured));
}

TEST(StreamingGoals, APeerThatMissesTheBoundIsNoPeer) {
  StreamingReport report = just_met();
  StreamingRow cheat = row("meshopt+zstd temporal", MotionLevel::Active, 1.0);
  cheat.max_error_m = 2.0 * cheat.bound_m;
  report.rows.push_back(cheat);
  EXPECT_THAT(verdicts(report), testing::Each(Verdict::Met));
  EXPECT_THAT(streaming_summary(report), HasSubstr("misses its bound: meshopt+zstd temporal"));
}

TEST(StreamingPage, SaysEveryGoalAndItsVerdict) {
  const StreamingReport report = just_met();
  const std::string page = streaming_page(report);
  for (const GoalLine& line : judge_streaming(report)) EXPECT_THAT(page, HasSubstr(line.goal));
  EXPECT_THAT(page, HasSubstr("Of 10 goals 10 are met, 0 missed, 0 not measured."));
  for (const char* loader : {"src=", "href=", "@import", "url(", "<script"})
    EXPECT_THAT(page, Not(HasSubstr(loader)));
  const std::string csv = streaming_csv(report);
  EXPECT_EQ(static_cast<size_t>(std::count(csv.begin(), csv.end(), '\n')), report.rows.size() + 1);
  EXPECT_THAT(streaming_page(StreamingReport{}), HasSubstr("nothing was measured"));
}

TEST(SvgBars, DrawsABarPerNumber) {
  BarDesc desc;
  desc.title = "bits & bytes";
  desc.groups = {"one", "two"};
  desc.series = {{"a", {1.0, 2.0}, 0}, {"b", {3.0, NAN}, 1}};
  const std::string svg = make_svg_bars(desc);
  size_t bars = 0;
  for (size_t at = svg.find("<title>"); at != std::string::npos; at = svg.find("<title>", at + 1)) ++bars;
  EXPECT_EQ(bars, 3u);
  EXPECT_THAT(svg, HasSubstr("bits &amp; bytes"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(make_svg_bars({}), HasSubstr("nothing was measured"));
}

}  // namespace
}  // namespace strandcast
