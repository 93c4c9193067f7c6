// Whom a live input hears, who drives the head, and what it says of all that. Time is virtual; packets are
// those of real protocols.
#include "server/input/live/live_source.h"
#include "common/base/units.h"

#include "server/input/input_hub.h"
#include "tests/support/live_packets.h"

namespace strandcast::live_source_test {
namespace {

using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
constexpr int64_t kStart = 1'000 * kMsInNs;
const std::string kFirst = "127.0.0.1:50001";
const std::string kSecond = "127.0.0.1:50002";

std::unique_ptr<LiveSource> make(const LiveDesc& live) {
  auto source = LiveSource::make(live, 0);
  EXPECT_TRUE(source) << source.error().to_string();
  return source ? std::move(*source) : nullptr;
}

test::PacketBytes at_x(double x_cm) {
  return test::opentrack({x_cm, 0, 0, 0, 0, 0});
}
test::PacketBytes camera(uint8_t number, double height_mm) {
  test::FreedPacket packet;
  packet.camera = number;
  packet.position_mm = {0, 0, height_mm};
  return test::freed(packet);
}
/// A device of VMC: a subject with a name, at this height.
test::PacketBytes tracker(const std::string& name, float height_m) {
  return test::osc_bundle({test::vmc_pose("/VMC/Ext/Tra/Pos", name, {0, height_m, 0}, {0, 0, 0, 1})});
}

/// The places of the head that come of what was sent.
std::vector<glm::dvec3> places(const LiveSource::Due& due) {
  std::vector<glm::dvec3> places;
  for (const MotionSamples& samples : due.motion)
    places.push_back(samples.samples.front().world_from_head.position_m);
  return places;
}

std::vector<std::string> texts(std::vector<LiveNote> notes) {
  std::vector<std::string> texts;
  for (LiveNote& note : notes) texts.push_back(std::move(note.text));
  return texts;
}

TEST(LiveSource, TheFirstWhoSendsIsHeardUntilNothingComes) {
  const auto source = make({.protocol = "opentrack"});
  for (int i = 0; i <= 100; ++i) {
    EXPECT_TRUE(source->take(kFirst, at_x(10), kStart + i * 10 * kMsInNs));
    EXPECT_TRUE(source->take(kSecond, at_x(50), kStart + i * 10 * kMsInNs + kMsInNs));
    for (const glm::dvec3& place : places(source->advance(kStart + i * 10 * kMsInNs + kMsInNs)))
      EXPECT_NEAR(place.x, 0.1, 1e-12);
  }
  LiveInputStatus status = source->status(kStart + 1'000 * kMsInNs);
  EXPECT_EQ(status.sender, kFirst);
  EXPECT_EQ(status.packets, 101u);
  EXPECT_EQ(status.received_bytes, 101u * 48u);
  EXPECT_EQ(status.refused, 101u);
  EXPECT_NEAR(status.rate_hz, 100.0, 1.0);
  EXPECT_LT(status.jitter_ms, 1e-6);
  EXPECT_NEAR(status.age_ms, 0.0, 1e-9);
  EXPECT_FALSE(status.is_stale);
  // The first stops; the second is heard a second later, not before.
  const int64_t last_ns = kStart + 1'000 * kMsInNs;
  ASSERT_TRUE(source->take(kSecond, at_x(50), last_ns + kMotionStaleNs));
  EXPECT_EQ(source->status(last_ns + kMotionStaleNs).sender, kFirst);
  const LiveSource::Due ended = source->advance(last_ns + kMotionStaleNs + kMsInNs);
  EXPECT_TRUE(ended.has_ended);
  EXPECT_TRUE(source->status(last_ns + kMotionStaleNs + kMsInNs).is_stale);
  EXPECT_TRUE(source->status(last_ns + kMotionStaleNs + kMsInNs).sender.empty());
  EXPECT_FALSE(source->advance(last_ns + kMotionStaleNs + 2 * kMsInNs).has_ended) << "once";
  ASSERT_TRUE(source->take(kSecond, at_x(50), last_ns + kMotionStaleNs + 2 * kMsInNs));
  status = source->status(last_ns + kMotionStaleNs + 2 * kMsInNs);
  EXPECT_EQ(status.sender, kSecond);
  EXPECT_FALSE(status.is_stale);
  const auto notes = texts(source->take_notes());
  EXPECT_THAT(notes, Contains(HasSubstr("127.0.0.1:50001 sends")));
  EXPECT_THAT(notes, Contains(HasSubstr("127.0.0.1:50001 has stopped sending")));
  EXPECT_THAT(notes, Contains(HasSubstr("127.0.0.1:50002 sends")));
  EXPECT_THAT(notes, Contains(HasSubstr("127.0.0.1:50002 sends too")));
}

TEST(LiveSource, MalformedPacketsAreCountedAndHearNobody) {
  const auto source = make({.protocol = "opentrack"});
  for (size_t size : {0u, 1u, 47u, 49u, 1'500u})
    EXPECT_FALSE(source->take(kFirst, test::PacketBytes(size), kStart));
  EXPECT_EQ(source->status(kStart).malformed, 5u);
  EXPECT_EQ(source->status(kStart).packets, 0u);
  EXPECT_TRUE(source->status(kStart).sender.empty());
  EXPECT_THAT(texts(source->take_notes()), Contains(HasSubstr("malformed packet from 127.0.0.1:50001")));
  EXPECT_TRUE(source->take(kSecond, at_x(1), kStart + kMsInNs));
  EXPECT_EQ(source->status(kStart + kMsInNs).sender, kSecond);
  // A flood of them fills no memory.
  for (int i = 0; i < 10'000; ++i) (void)source->take(kSecond, test::PacketBytes(3), kStart + kMsInNs);
  EXPECT_LE(source->take_notes().size(), 64u);
}

TEST(LiveSource, AThousandPacketsASecondAreTakenAndNoMore) {
  const auto source = make({.protocol = "opentrack"});
  int64_t time_ns = kStart;
  for (int i = 0; i < 10'000; ++i) ASSERT_TRUE(source->take(kFirst, at_x(1), time_ns += kMsInNs));
  EXPECT_EQ(source->status(time_ns).over_rate, 0u);
  // Ten times as many: what is beyond goes, and the next second is served again.
  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(source->take(kFirst, at_x(1), time_ns += kMsInNs / 10));
  const LiveInputStatus status = source->status(time_ns);
  EXPECT_EQ(status.packets + status.over_rate, 110'000u);
  EXPECT_NEAR(static_cast<double>(status.packets), 10'000 + 10'000 + kMaxSampleBurst, 20);
}

TEST(LiveSource, BytesAreBoundedToo) {
  const auto source = make({.protocol = "vmc", .max_datagram_bytes = 65'507});
  test::PacketBytes large = test::osc("/VMC/Ext/Opt", {std::string(60'000, 'x')});
  for (int i = 0; i < 1'000; ++i) (void)source->take(kFirst, large, kStart + i * kMsInNs);
  const LiveInputStatus status = source->status(kStart + 1'000 * kMsInNs);
  EXPECT_LE(static_cast<double>(status.received_bytes), 2 * kMaxLiveBytesPerS);
  EXPECT_GT(status.over_rate, 900u);
}

/// From the source to the simulation no more than a step: what was taken before a step is in it.
TEST(LiveSource, WhatCameBeforeAStepIsInIt) {
  const auto source = make({.protocol = "opentrack"});
  InputHub hub;
  const int64_t step = 16'666'667;
  int64_t next_step_ns = kStart + step;
  double newest_m = 0.0;
  for (int i = 0; i < 2'000; ++i) {
    // 1,000 a second, the head at 0.5 m/s.
    const int64_t time_ns = kStart + i * kMsInNs;
    for (; next_step_ns <= time_ns; next_step_ns += step) {
      const InputFrame frame = hub.sample(next_step_ns);
      EXPECT_NEAR(frame.world_from_head.position_m.x, newest_m, 1e-9) << i;
      EXPECT_LE(next_step_ns - frame.motion_time_ns, kMsInNs) << i;
    }
    newest_m = 5e-4 * i;
    ASSERT_TRUE(source->take(kFirst, at_x(100.0 * newest_m), time_ns));
    for (const MotionSamples& samples : source->advance(time_ns).motion) hub.push(7, samples, time_ns);
  }
  EXPECT_EQ(hub.counters().rejected(), 0u);
}

// Through parser, policy and hub: no step shows a blow, where a head that is held stops dead and leaps.
TEST(LiveSource, AHeadThatATrackerLosesSlowsAndComesBackGently) {
  const auto source = make({.protocol = "opentrack"});
  InputHub hub;
  constexpr int64_t kStepNs = 16'666'667;
  constexpr double kStepS = 1.0 / 60.0, kSpeedMps = 1.0;
  std::vector<Pose> shown, held;
  for (int i = 0; i < 300; ++i) {
    const int64_t time_ns = kStart + i * kStepNs;
    const Pose pose{{kSpeedMps * i * kStepS, 0.0, 0.0}, {1, 0, 0, 0}};
    const bool is_lost = i >= 120 && i < 150;
    held.push_back(is_lost ? held.back() : pose);
    if (!is_lost) {
      ASSERT_TRUE(source->take(kFirst, at_x(100.0 * pose.position_m.x), time_ns));
    }
    for (const MotionSamples& samples : source->advance(time_ns).motion) hub.push(7, samples, time_ns);
    shown.push_back(hub.sample(time_ns).world_from_head);
  }
  EXPECT_LT(peaks_of(shown, kStepS).mps2, 1.05 * kEasyStart.mps2);
  EXPECT_NEAR(shown.back().position_m.x, held.back().position_m.x, 1e-6 + kSpeedMps * 1.5 * kStepS);
  EXPECT_GT(peaks_of(held, kStepS).mps2, 10.0 * kEasyStart.mps2);
}

TEST(LiveSource, AHeadIsChosenElseTheFirst) {
  const auto source = make({.protocol = "vmc"});
  int64_t time_ns = kStart;
  const auto show = [&](const std::string& name, float height_m) {
    (void)source->take(kFirst, tracker(name, height_m), time_ns += 10 * kMsInNs);
    return source->advance(time_ns);
  };
  EXPECT_EQ(places(show("waist", 1.0f)).size(), 1u);
  EXPECT_THAT(places(show("left foot", 0.1f)), IsEmpty());
  EXPECT_EQ(source->status(time_ns).subject, "waist");
  EXPECT_EQ(source->status(time_ns).subjects, "waist, left foot");
  const auto head = places(show("HEAD", 1.7f));
  ASSERT_FALSE(head.empty());
  EXPECT_NEAR(head.back().y, 1.7, 1e-6) << "believed at once: it is another one";
  EXPECT_EQ(source->status(time_ns).subject, "HEAD");
  EXPECT_THAT(places(show("waist", 1.0f)), IsEmpty());
  // Without the head, whoever else is seen.
  for (int i = 0; i < 120; ++i) (void)show("waist", 1.0f);
  EXPECT_EQ(source->status(time_ns).subject, "waist");
}

TEST(LiveSource, ThePerformersHeadGoesBeforeTrackers) {
  const auto source = make({.protocol = "vmc"});
  (void)source->take(kFirst, tracker("LHR-1", 1.0f), kStart);
  EXPECT_EQ(source->status(kStart).subject, "LHR-1");
  for (int i = 1; i < 5; ++i) {
    (void)source->take(kFirst, test::vmc_head({0, 1.6f, 0}, {0, 0, 0, 1}, 0.01f * static_cast<float>(i)),
                       kStart + i * 10 * kMsInNs);
    (void)source->take(kFirst, tracker("LHR-1", 1.0f), kStart + i * 10 * kMsInNs + kMsInNs);
  }
  EXPECT_EQ(source->status(kStart + 50 * kMsInNs).subject, "(no name)");
  const auto seen = places(source->advance(kStart + 50 * kMsInNs));
  ASSERT_FALSE(seen.empty());
  EXPECT_NEAR(seen.back().y, 1.6, 1e-6);
}

TEST(LiveSource, ASkeletonsHeadIsAHead) {
  const auto source = make({.protocol = "natnet"});
  (void)source->take(kFirst, test::natnet_server(3, 1), kStart);
  (void)source->take(kFirst, test::natnet_names("3.1", {{7, "Sword"}}, {{1, "Hips"}, {2, "Head"}}), kStart);
  test::NatnetPacket packet;
  packet.bodies = {{.id = 7, .position_m = {2, 1, 0}}};
  packet.bones = {{.id = 1, .position_m = {0, 1, 0}}, {.id = 2, .position_m = {0, 1.7f, 0}}};
  for (uint32_t i = 0; i < 3; ++i) {
    packet.frame = 10 + i;
    packet.time_s = 0.01 * i;
    (void)source->take(kFirst, test::natnet(packet), kStart + i * 10 * kMsInNs);
  }
  EXPECT_EQ(source->status(kStart + 30 * kMsInNs).subject, "Actor/Head");
  EXPECT_THAT(source->status(kStart + 30 * kMsInNs).subjects, HasSubstr("Sword"));
}

TEST(LiveSource, ANamedSubjectIsWaitedFor) {
  const auto source = make({.protocol = "freed", .subject = "2"});
  int64_t time_ns = kStart;
  EXPECT_TRUE(source->take(kFirst, camera(1, 1'000), time_ns));
  EXPECT_THAT(places(source->advance(time_ns)), IsEmpty());
  EXPECT_TRUE(source->status(time_ns).is_stale);
  EXPECT_TRUE(source->take(kFirst, camera(2, 1'500), time_ns += kMsInNs));
  ASSERT_EQ(places(source->advance(time_ns)).size(), 1u);
  // Another one by command, which jumps there.
  source->choose_subject("1");
  EXPECT_TRUE(source->take(kFirst, camera(2, 1'500), time_ns += kMsInNs));
  EXPECT_TRUE(source->take(kFirst, camera(1, 1'000), time_ns += kMsInNs));
  const auto seen = places(source->advance(time_ns));
  ASSERT_FALSE(seen.empty());
  EXPECT_NEAR(seen.back().y, 1.0, 1e-9);
  EXPECT_EQ(source->status(time_ns).subject, "1");
  EXPECT_EQ(source->live().subject, "1");
}

TEST(LiveSource, NamesOfStrangersAreFewAndPrintable) {
  const auto source = make({.protocol = "vmc"});
  (void)source->take(kFirst, tracker("a\x1b[2J\nb", 1.0f), kStart);
  for (int i = 0; i < 1'000; ++i)
    (void)source->take(kFirst, tracker("t" + std::to_string(i), 1.0f), kStart + i * kMsInNs / 10);
  const LiveInputStatus status = source->status(kStart + 100 * kMsInNs);
  EXPECT_EQ(status.subjects.find('\x1b'), std::string::npos);
  EXPECT_EQ(status.subjects.find('\n'), std::string::npos);
  EXPECT_LE(std::count(status.subjects.begin(), status.subjects.end(), ','),
            static_cast<std::ptrdiff_t>(kMaxLiveSubjects));
  EXPECT_LE(source->take_notes().size(), 64u);
  ServerStatus whole;
  whole.live_inputs.assign(kMaxLiveInputs, status);
  EXPECT_LE(encode(ServerMessage(whole)).size(), kMaxControlBytes);
  EXPECT_TRUE(decode_server_message(encode(ServerMessage(whole))).ok());
}

TEST(LiveSource, ValuesAreShownAsTheyWereSent) {
  const auto source = make({.protocol = "opentrack"});
  EXPECT_TRUE(source->take(kFirst, test::opentrack({1.5, -2, 3, 40, 5, -6}), kStart));
  const LiveInputStatus status = source->status(kStart);
  ASSERT_FALSE(status.values.empty());
  std::string all;
  for (const LiveValue& value : status.values) all += value.text + "\n";
  EXPECT_THAT(all, HasSubstr("1.5"));
  EXPECT_THAT(all, HasSubstr("40"));
}

TEST(LiveSource, WindComesAlong) {
  const auto source = make({.protocol = "vmc"});
  EXPECT_TRUE(source->take(kFirst, test::osc_wind({1, 2, -3}), kStart));
  const LiveSource::Due due = source->advance(kStart);
  ASSERT_EQ(due.wind.size(), 1u);
  EXPECT_EQ(due.wind[0].samples.front().velocity_mps, glm::vec3(1, 2, -3));
  EXPECT_THAT(source->advance(kStart + kMsInNs).wind, IsEmpty());
}

TEST(LiveSource, WrongInputsAreToldWithTheirField) {
  const auto sentence = [](const LiveDesc& live) {
    const auto source = LiveSource::make(live, 1);
    return source ? std::string("no error") : source.error().to_string();
  };
  EXPECT_THAT(sentence({.protocol = "vcm"}),
              testing::AllOf(HasSubstr("live.1"), HasSubstr("vcm"), HasSubstr("vmc")));
  EXPECT_THAT(sentence({.protocol = "opentrack", .axes = "upside"}),
              testing::AllOf(HasSubstr("live.1"), HasSubstr("upside"), HasSubstr("xyz-ypr")));
  EXPECT_THAT(sentence({.protocol = "opentrack", .host = "10.0.0.1"}),
              testing::AllOf(HasSubstr("live.1.host"), HasSubstr("4242")));
  EXPECT_EQ(sentence({.protocol = "vmc"}), "no error");
}

/// What comes of a head that goes along x by so many of the sender's centimetres every 10 ms.
struct Walk {
  glm::dvec3 end_m{0.0};
  LiveInputStatus status;
};
Walk walk(double scale, double step_cm, int steps) {
  const auto source = make({.protocol = "opentrack", .scale = scale});
  Walk walk;
  for (int i = 0; i <= steps; ++i) {
    EXPECT_TRUE(source->take(kFirst, at_x(step_cm * i), kStart + i * 10 * kMsInNs));
    for (const glm::dvec3& place_m : places(source->advance(kStart + i * 10 * kMsInNs))) walk.end_m = place_m;
  }
  walk.status = source->status(kStart + steps * 10 * kMsInNs);
  return walk;
}

TEST(LiveSource, PlacesAreScaledBeforeTheirSpeedIsJudged) {
  constexpr int kSteps = 20;
  // 5 m/s as it comes. The same at a quarter of the numbers, were it 20 m/s.
  const Walk as_it_comes = walk(1.0, 5.0, kSteps);
  EXPECT_NEAR(as_it_comes.end_m.x, 0.05 * kSteps, 1e-9);
  EXPECT_EQ(as_it_comes.status.clamped, 0u);
  const Walk smaller = walk(0.25, 20.0, kSteps);
  EXPECT_NEAR(smaller.end_m.x, 0.05 * kSteps, 1e-9);
  EXPECT_EQ(smaller.status.clamped, 0u) << "20 m/s are 5";
  // Four times as large it is 20 m/s, of which a head gets 10 m/s and the burst of the window.
  const Walk larger = walk(4.0, 5.0, kSteps);
  const double most_m = kMaxLiveSpeedMps * (kSteps * 10 * kMsInNs + kClampWindowNs) * 1e-9;
  EXPECT_GT(larger.status.clamped, 10u);
  EXPECT_LE(larger.end_m.x, most_m + 1e-9);
  EXPECT_GT(larger.end_m.x, most_m - kMaxLiveSpeedMps * kClampWindowNs * 1e-9 - 1e-9);
}

TEST(LiveSource, PlacesAreScaledBeforeTheyAreBelieved) {
  // One pose 1 m away by the sender's numbers, which is beyond the gate.
  EXPECT_EQ(walk(1.0, 100.0, 1).status.gated, 1u);
  EXPECT_EQ(walk(0.5, 100.0, 1).status.gated, 0u) << "half a metre";
  EXPECT_EQ(walk(1.0, 25.0, 1).status.gated, 0u);
  EXPECT_EQ(walk(4.0, 25.0, 1).status.gated, 1u) << "a metre";
  // What only the scale takes out of the world is as impossible as what came so.
  const double too_far_cm = 1.001 * kMaxHeadDistanceM * 100.0 / kMaxLiveScale;
  EXPECT_EQ(walk(kMaxLiveScale, too_far_cm, 1).status.impossible, 1u);
  EXPECT_EQ(walk(1.0, too_far_cm, 1).status.impossible, 0u);
}

TEST(LiveSource, JointsAreScaledWithTheHead) {
  constexpr test::Quad kUnturned = {0, 0, 0, 1};
  const auto body = [&] {
    return test::osc_bundle({test::vmc_bone("Hips", {0, 1, 0}, kUnturned),
                             test::vmc_bone("Chest", {0, 0.25f, 0}, kUnturned),
                             test::vmc_bone("Head", {0, 0.25f, 0}, kUnturned),
                             test::vmc_bone("LeftUpperArm", {-0.2f, 0.125f, 0}, kUnturned)});
  };
  for (const double scale : {1.0, 0.5, 3.0}) {
    const auto source = make({.protocol = "vmc", .scale = scale});
    ASSERT_TRUE(source->take(kFirst, body(), kStart));
    const LiveSource::Due due = source->advance(kStart);
    ASSERT_EQ(due.motion.size(), 1u);
    const auto& sample = due.motion[0].samples.front();
    EXPECT_LT(glm::distance(sample.world_from_head.position_m, glm::dvec3(0, 1.5 * scale, 0)), 1e-6);
    ASSERT_EQ(due.motion[0].joint_names, (std::vector<std::string>{"chest", "left_shoulder"}));
    EXPECT_LT(glm::distance(glm::dvec3(sample.joint_m[0]), scale * glm::dvec3(0, -0.25, 0)), 1e-6);
    EXPECT_LT(glm::distance(glm::dvec3(sample.joint_m[1]), scale * glm::dvec3(0.2, -0.125, 0)), 1e-6)
        << "to the left, which is +X";
  }
}

TEST(LiveSource, WishesToRecordComeFromWhoeverMaySendAndOneByOne) {
  const auto source = make({.protocol = "vmc"});
  int64_t now_ns = kStart;
  EXPECT_TRUE(source->take(kFirst, tracker("head", 1.0f), now_ns));
  EXPECT_FALSE(source->advance(now_ns).recording);
  // From another port than the performer's: a manager, not the performer.
  const std::vector<test::OscValue> slate = {std::string("12A"), int32_t{3}};
  EXPECT_TRUE(source->take(kSecond, test::osc("/strandcast/record/start", slate), now_ns));
  EXPECT_TRUE(source->take(kSecond, test::osc("/strandcast/record/stop", {}), now_ns));
  EXPECT_TRUE(source->take(kSecond, test::osc("/strandcast/record/start", {}), now_ns)) << "too many at once";
  EXPECT_EQ(source->advance(now_ns).recording, (RecordCommand{true, {}, "12A", 3}));
  EXPECT_FALSE(source->advance(now_ns + kRecordPauseNs - 1).recording);
  EXPECT_TRUE(source->is_active());
  EXPECT_EQ(source->advance(now_ns + kRecordPauseNs).recording, (RecordCommand{false, {}}));
  now_ns += 10 * kRecordPauseNs;
  EXPECT_FALSE(source->advance(now_ns).recording);
  EXPECT_EQ(source->status(now_ns).over_rate, 1u);
  EXPECT_EQ(source->status(now_ns).refused, 0u);
  // Whatever a slate holds, and whatever is no wish.
  const std::vector<test::OscValue> long_slate = {std::string(1'000, 'x') + "\n", int32_t{-7}};
  EXPECT_TRUE(source->take(kSecond, test::osc("/strandcast/record/start", long_slate), now_ns));
  EXPECT_EQ(source->advance(now_ns).recording,
            (RecordCommand{true, {}, std::string(kMaxSlateChars, 'x'), 0}));
  now_ns += 10 * kRecordPauseNs;
  (void)source->take_notes();
  EXPECT_TRUE(source->take(
      kSecond, test::osc("/strandcast/record/start", {std::string("12A"), int32_t{12'345}}), now_ns));
  EXPECT_EQ(source->advance(now_ns).recording, (RecordCommand{true, {}, "12A", kMaxTake}));
  EXPECT_THAT(texts(source->take_notes()),
              testing::ElementsAre(HasSubstr("take 12345: takes go up to 9999")));
  now_ns += 10 * kRecordPauseNs;
  for (const auto& packet : {test::osc("/strandcast/record/pause", {}), test::osc("/strandcast/record/", {}),
                             test::osc("/strandcast/record/start", {1.0f})})
    (void)source->take(kFirst, packet, now_ns);
  EXPECT_FALSE(source->advance(now_ns).recording);
}

/// What a source says of these packets, 60 a second for three seconds.
std::vector<std::string> said_of(const char* protocol, const std::function<test::PacketBytes(int)>& packet) {
  const auto source = make({.protocol = protocol});
  std::vector<std::string> said;
  for (int i = 0; i < 180; ++i) {
    const int64_t time_ns = kStart + i * kSInNs / 60;
    (void)source->take(kFirst, packet(i), time_ns);
    (void)source->advance(time_ns);
    for (std::string& text : texts(source->take_notes())) said.push_back(std::move(text));
  }
  return said;
}

// "Nothing comes" sends a person to the cable, where the fault is in the numbers.
TEST(LiveSource, PacketsOfWhichNoneIsBelievedAreNotCalledNothing) {
  // The last byte of a place, which changes with each packet, counts as its first.
  const auto swapped = [](int i) {
    test::FreedPacket packet;
    const auto anywhere_mm = [i](int axis) { return 1'000.0 * ((i * (37 + 30 * axis)) % 128); };
    packet.position_mm = {anywhere_mm(0), anywhere_mm(1), anywhere_mm(2)};
    return test::freed(packet);
  };
  const auto jumping = said_of("freed", swapped);
  EXPECT_THAT(jumping, Contains(HasSubstr("are not believed: they jump as no head does")));
  EXPECT_THAT(jumping, Not(Contains(HasSubstr("nothing of"))));
  const auto broken = said_of("vmc", [](int) {
    return test::osc_bundle({test::vmc_pose("/VMC/Ext/Tra/Pos", "hat", {0, 1, 0}, {0, 9, 0, 9})});
  });
  EXPECT_THAT(broken, Contains(HasSubstr("are not believed: they are no pose of a head")));
  const auto still = said_of("freed", [](int) { return camera(1, 1'700.0); });
  EXPECT_THAT(still, Not(Contains(HasSubstr("not believed"))));
}

TEST(LiveSource, NamesTheProtocolOfPacketsOfAnother) {
  const auto vmc = said_of("vmc", [](int) { return camera(1, 1'700.0); });
  EXPECT_THAT(vmc, Contains(HasSubstr("it reads as a packet of freed, which wants --mocap freed")));
  const auto freed = said_of("freed", [](int) { return tracker("hat", 1.7f); });
  EXPECT_THAT(freed, Contains(HasSubstr("it reads as a packet of vmc, which wants --mocap vmc")));
  const auto noise = said_of("vmc", [](int i) { return test::PacketBytes(37, static_cast<std::byte>(i)); });
  EXPECT_THAT(noise, Not(Contains(HasSubstr("it reads as"))));
}

TEST(LiveSource, ACommandThatThereIsNotIsNamedWhoeverSendsIt) {
  const auto source = make({.protocol = "vmc"});
  ASSERT_TRUE(source->take(kFirst, tracker("hat", 1.7f), kStart));
  ASSERT_TRUE(source->take(kSecond, test::osc("/strandcast/record/begin", {}), kStart + kMsInNs));
  EXPECT_THAT(
      texts(source->take_notes()),
      Contains(HasSubstr("127.0.0.1:50002 sends /strandcast/record/begin, and there is no such command; "
                         "there are /strandcast/record/start, /strandcast/record/stop")));
  EXPECT_EQ(source->status(kStart + kMsInNs).refused, 0u);
}

}  // namespace
}  // namespace strandcast::live_source_test
