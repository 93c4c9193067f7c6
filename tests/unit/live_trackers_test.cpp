// Parsers of head and camera trackers. Packets are written by tests/support/live_packets.h from the
// documents, in each sender's axes and units; what comes out is looked at as a face: where it looks, where
// its crown points.
#include <cmath>

#include "common/base/units.h"
#include "common/motion/mocap_packet.h"
#include "server/input/live/live_parser.h"
#include "tests/support/live_packets.h"
#include "tests/support/live_poses.h"

namespace strandcast::live_trackers_test {
namespace {

using test::live_parser_of;
using test::PacketBytes;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

LivePose only_pose(LiveParser& parser, const PacketBytes& bytes) {
  LivePacket packet = test::parsed(parser, bytes);
  EXPECT_EQ(packet.poses.size(), 1u);
  return packet.poses.size() == 1 ? packet.poses[0] : LivePose{};
}

constexpr double kDegree = 3.14159265358979323846 / 180;

/// A face that was turned to its left, then up about its own ears, then tilted to its right about its own
/// nose. By hand: +X is to the left, so it looks along (sin left cos up, sin up, cos left cos up); untilted
/// its crown is the same with up 90 degrees more, and its right ear along (-cos left, 0, sin left); the tilt
/// mixes these two.
struct Turned {
  double left, up, tilt_right;

  glm::dvec3 face() const {
    return {std::sin(left) * std::cos(up), std::sin(up), std::cos(left) * std::cos(up)};
  }
  glm::dvec3 crown() const {
    const glm::dvec3 straight(-std::sin(left) * std::sin(up), std::cos(up), -std::cos(left) * std::sin(up));
    const glm::dvec3 right_ear(-std::cos(left), 0, std::sin(left));
    return std::cos(tilt_right) * straight + std::sin(tilt_right) * right_ear;
  }
};
void expect_turned(const LivePose& pose, const Turned& turned) {
  EXPECT_TRUE(test::looks_along(pose, turned.face()));
  EXPECT_TRUE(test::has_crown_along(pose, turned.crown()));
}

TEST(LiveParsers, AreFoundByName) {
  LiveParserConfig config;
  for (const LiveProtocol& protocol : live_protocols()) {
    config.protocol = protocol.name;
    config.axis_order = "";
    const auto parser = make_live_parser(config);
    ASSERT_TRUE(parser) << protocol.name;
    EXPECT_EQ((*parser)->ignored(), 0u);
    EXPECT_THAT((*parser)->describe(), IsEmpty());
    EXPECT_GT(protocol.default_port, 0);
    for (const char* order : protocol.axis_orders) {
      config.axis_order = order;
      EXPECT_TRUE(make_live_parser(config)) << protocol.name << " " << order;
    }
    config.axis_order = "sideways";
    EXPECT_EQ(make_live_parser(config).error().code, ErrorCode::NotFound) << protocol.name;
  }
  config.protocol = "opentrak";
  const auto unknown = make_live_parser(config);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::NotFound);
  EXPECT_THAT(unknown.error().message,
              testing::AllOf(HasSubstr("\"opentrak\""), HasSubstr("opentrack"), HasSubstr("vmc")));
  config = {};
  config.protocol = "opentrack";
  config.axis_order = "yaw-first";
  EXPECT_THAT(make_live_parser(config).error().message, HasSubstr("xyz-ypr, ypr-xyz"));
}

// opentrack's neural tracker makes the six numbers from a pose whose axes it names (ahead, up, right): +x to
// the head's left, y up, +z away from the camera; yaw to the right, pitch up, roll to the left.
TEST(OpentrackParser, TurnsAHeadAsItsTrackersDo) {
  const auto parser = live_parser_of("opentrack");
  const LivePose pose = only_pose(*parser, test::opentrack({10, 20, 30, 40, 15, -25}));
  EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {0.10, 0.20, -0.30}));
  EXPECT_TRUE(pose.has_position);
  EXPECT_FALSE(pose.source_time_ns.has_value());
  expect_turned(pose, {-40 * kDegree, 15 * kDegree, 25 * kDegree});
  EXPECT_TRUE(test::looks_along(only_pose(*parser, test::opentrack({0, 0, 0, 90, 0, 0})), {-1, 0, 0}));
  EXPECT_TRUE(test::looks_along(only_pose(*parser, test::opentrack({0, 0, 0, 0, 90, 0})), {0, 1, 0}));
  EXPECT_TRUE(test::has_crown_along(only_pose(*parser, test::opentrack({0, 0, 0, 0, 0, 90})), {1, 0, 0}));
  EXPECT_THAT(parser->describe(),
              ElementsAre("x 0.00 y 0.00 z 0.00 cm", "yaw 0.00 pitch 0.00 roll 90.00 degrees"));
}

TEST(OpentrackParser, TakesAnglesFirstWhereTold) {
  const auto parser = live_parser_of("opentrack", "ypr-xyz");
  const LivePose pose = only_pose(*parser, test::opentrack({40, 15, -25, 10, 20, 30}));
  EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {0.10, 0.20, -0.30}));
  expect_turned(pose, {-40 * kDegree, 15 * kDegree, 25 * kDegree});
}

TEST(OpentrackParser, TakesWholePacketsOnly) {
  const auto parser = live_parser_of("opentrack");
  const PacketBytes packet = test::opentrack({1, 2, 3, 4, 5, 6});
  for (size_t size = 0; size < packet.size(); ++size)
    EXPECT_FALSE(parser->parse(std::span(packet).first(size), 0)) << size;
  const auto longer = parser->parse(PacketBytes(packet.size() + 1), 0);
  ASSERT_FALSE(longer);
  EXPECT_THAT(longer.error().message, HasSubstr("has 48 bytes and this one 49"));
  const LivePose pose = only_pose(*parser, test::opentrack({NAN, 0, 0, INFINITY, 0, 0}));
  EXPECT_FALSE(is_finite(pose.world_from_subject)) << "left to whoever takes it";
}

// By the manual's appendix B: a camera at rest looks along +Y with +Z up, so +X is to its right. Pan to the
// right, tilt up, roll clockwise as seen from behind, to the right.
TEST(FreedParser, TurnsACameraAsTheManualSays) {
  const auto parser = live_parser_of("freed");
  test::FreedPacket packet;
  packet.camera = 7;
  packet.angle_deg = {40, 15, -25};
  packet.position_mm = {1000, 2000, 1500};
  const LivePose pose = only_pose(*parser, test::freed(packet));
  EXPECT_EQ(pose.subject, "7");
  EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {-1.0, 1.5, 2.0}));
  expect_turned(pose, {-40 * kDegree, 15 * kDegree, -25 * kDegree});
  EXPECT_THAT(parser->describe(),
              ElementsAre("camera 7", "pan 40.000 tilt 15.000 roll -25.000 degrees",
                          "x 1000.00 y 2000.00 height 1500.00 mm", "zoom 0 focus 0", "spare word 0"));
  const auto swapped = live_parser_of("freed", "tilt-pan-roll");
  packet.angle_deg = {15, 40, -25};
  expect_turned(only_pose(*swapped, test::freed(packet)), {-40 * kDegree, 15 * kDegree, -25 * kDegree});
}

// Ends of the ranges as the manual writes them: pan -180 is A60000, tilt +90 is 2D0000. Positions are 1/64
// mm.
TEST(FreedParser, ReadsTheNumbersOfTheManual) {
  test::PacketWriter writer(std::endian::big);
  for (const int byte : {0xD1, 0x02, 0xA6, 0,    0, 0x2D, 0, 0,    0xFF, 0x80, 0,    0xFF, 0xFF, 0xC0,
                         0,    0,    0x40, 0x80, 0, 0,    0, 0x02, 0x03, 0x04, 0x05, 0x06, 0,    0})
    writer.put(static_cast<uint8_t>(byte));
  int sum = 0x40;
  for (const std::byte byte : writer.bytes()) sum -= std::to_integer<int>(byte);
  const auto parser = live_parser_of("freed");
  (void)only_pose(*parser, writer.put(static_cast<uint8_t>(sum)).bytes());
  EXPECT_THAT(parser->describe(),
              ElementsAre("camera 2", "pan -180.000 tilt 90.000 roll -1.000 degrees",
                          "x -1.00 y 1.00 height -131072.00 mm", "zoom 515 focus 263430", "spare word 0"));
}

// The word is its sender's own: it is timecode where somebody says so. 65,536 frames of 25 a second are 43
// min 41 s and 11 frames.
TEST(FreedParser, TheSpareWordCountsFramesWhereItIsSaid) {
  const auto timecode_of = [](LiveParser& parser, uint16_t spare) {
    return only_pose(parser, test::freed({.spare = spare})).timecode;
  };
  EXPECT_FALSE(timecode_of(*live_parser_of("freed"), 1000));
  const auto parser = live_parser_of("freed", "pan-tilt-roll/25");
  const auto at = [](TimecodeFields fields) { return make_timecode(fields, {25, 1}, false).value(); };
  EXPECT_EQ(timecode_of(*parser, 65'535), at({0, 43, 41, 10}));
  EXPECT_THAT(parser->describe(), testing::Contains("spare word 65535, timecode 00:43:41:10"));
  EXPECT_EQ(timecode_of(*parser, 0), at({0, 43, 41, 11})) << "it goes on";
  EXPECT_EQ(timecode_of(*parser, 65'534), at({0, 43, 41, 9})) << "one that was late";
  EXPECT_EQ(timecode_of(*live_parser_of("freed", "/29.97df"), 1800),
            make_timecode({0, 1, 0, 2}, {30'000, 1001}, true).value());
  for (const char* count : {"/29.97", "/29.97nd", "/29.97ndf"})
    EXPECT_EQ(timecode_of(*live_parser_of("freed", count), 1800),
              make_timecode({0, 1, 0, 0}, {30'000, 1001}, false).value());
  // Four bits beside an aperture of F2.8, as Z CAM documents it: 0x118 below a sequence number.
  const auto beside_aperture = live_parser_of("freed", "/25:12-15");
  for (const auto& [spare, frame] : {std::pair{0xE118, 14u}, {0xF118, 15u}, {0x0118, 16u}, {0x5FFF, 21u}})
    EXPECT_EQ(timecode_of(*beside_aperture, static_cast<uint16_t>(spare)), at({0, 0, 0, frame})) << spare;
  const auto low = live_parser_of("freed", "/25:0-7");
  EXPECT_EQ(timecode_of(*low, 0x1200), at({0, 0, 0, 0}));
  EXPECT_EQ(timecode_of(*low, 0x12FF), at({23, 59, 59, 24})) << "one that was late";
  // As it is sent, and back.
  MocapMoment moment;
  moment.timecode = at({0, 10, 0, 3});
  EXPECT_EQ(only_pose(*live_parser_of("freed", "/25"), find_mocap_encoding("freed")->encode(moment)).timecode,
            moment.timecode);
  const auto refusal = [](const char* protocol, const char* axes) {
    LiveParserConfig config;
    config.protocol = protocol;
    config.axis_order = axes;
    const auto refused = make_live_parser(config);
    return refused ? "it was made" : refused.error().to_string();
  };
  EXPECT_THAT(refusal("freed", "/26"), HasSubstr("frames of the spare word"));
  for (const char* bits : {"/25:", "/25:12", "/25:15-12", "/25:3-3", "/25:0-16", "/25:-1-4", "/25:1-2x"})
    EXPECT_THAT(refusal("freed", bits), HasSubstr("FIRST-LAST within 0-15")) << bits;
  EXPECT_THAT(refusal("freed", "roll/25"), HasSubstr("pan-tilt-roll"));
  EXPECT_THAT(refusal("opentrack", "xyz-ypr/25"), HasSubstr("xyz-ypr/25"));
}

TEST(FreedParser, ASpareWordThatStandsCountsNoFrames) {
  const auto notes_after = [](int packets, bool counts) {
    const auto parser = live_parser_of("freed", "/25");
    for (int i = 0; i < packets; ++i)
      (void)only_pose(*parser, test::freed({.spare = static_cast<uint16_t>(counts ? i / 2 : 7)}));
    return parser->take_notes();
  };
  EXPECT_THAT(notes_after(119, false), IsEmpty());
  EXPECT_THAT(notes_after(300, false), ElementsAre(HasSubstr("stand at 7: they count no frames")));
  EXPECT_THAT(notes_after(300, true), IsEmpty());
}

// Packets come unevenly, by 8 ms either way.
TEST(FreedParser, ASpareWordThatCountsAtAnotherRateIsToldWithIt) {
  const auto notes_of = [](const char* said, int packets_hz, int each) {
    const auto parser = live_parser_of("freed", said);
    for (int i = 0; i < 10 * packets_hz; ++i) {
      const int64_t time_ns = kSInNs + kSInNs * i / packets_hz + (i * 7 % 17 - 8) * kMsInNs;
      const auto packet = parser->parse(test::freed({.spare = static_cast<uint16_t>(i / each)}), time_ns);
      EXPECT_TRUE(packet.ok());
    }
    return parser->take_notes();
  };
  EXPECT_THAT(notes_of("/25", 50, 1),
              ElementsAre(AllOf(HasSubstr("counts about 50 frames a second"), HasSubstr("says 25"))));
  EXPECT_THAT(notes_of("/30:0-3", 25, 1), ElementsAre(HasSubstr("counts about 25 frames a second")));
  EXPECT_THAT(notes_of("/25", 50, 2), IsEmpty()) << "each number twice";
  EXPECT_THAT(notes_of("/50", 50, 1), IsEmpty());
  EXPECT_THAT(notes_of("/23.976", 24, 1), IsEmpty());
}

TEST(FreedParser, RefusesWrongChecksumsAndOtherSizes) {
  const auto parser = live_parser_of("freed");
  const PacketBytes right = test::freed({});
  for (size_t i = 1; i < right.size(); ++i) {
    PacketBytes wrong = right;
    wrong[i] ^= std::byte{0x10};
    const auto refused = parser->parse(wrong, 0);
    ASSERT_FALSE(refused) << i;
    EXPECT_THAT(refused.error().message, HasSubstr("wrong checksum"));
  }
  for (size_t size = 0; size < right.size(); ++size)
    EXPECT_FALSE(parser->parse(std::span(right).first(size), 0));
  EXPECT_EQ(parser->ignored(), 0u);
  PacketBytes other = right;
  other[0] = std::byte{0xD3};
  EXPECT_THAT(parser->parse(other, 0)->poses, IsEmpty()) << "another message of the same family";
  EXPECT_EQ(parser->ignored(), 1u);
  EXPECT_THAT(parser->describe(), IsEmpty());
}

// The app maps turns of -180 to 180 degrees to -1 to 1, about the axes of ARKit's face: left, down, tilt to
// the right.
TEST(LiveLinkFaceParser, TurnsAHeadAsArKitDoes) {
  const auto parser = live_parser_of("livelinkface");
  test::FacePacketFields fields;
  fields.yaw = 40.0f / 180;
  fields.pitch = -15.0f / 180;
  fields.roll = -25.0f / 180;
  const PacketBytes packet = test::live_link_face(fields);
  const LivePose pose = only_pose(*parser, packet);
  EXPECT_FALSE(pose.has_position);
  EXPECT_EQ(pose.subject, "iPhone");
  EXPECT_EQ(pose.frame, 100u);
  EXPECT_EQ(pose.source_time_ns, 1'675'000'000) << "100.5 frames at 60 a second";
  expect_turned(pose, {40 * kDegree, 15 * kDegree, -25 * kDegree});

  test::PacketWriter sized(std::endian::big);
  sized.put(static_cast<uint32_t>(packet.size())).append(packet);
  EXPECT_EQ(only_pose(*parser, sized.bytes()).world_from_subject, pose.world_from_subject)
      << "its size in front";

  const auto in_radians = live_parser_of("livelinkface", "radians");
  fields.yaw = static_cast<float>(40 * kDegree);
  fields.pitch = static_cast<float>(-15 * kDegree);
  fields.roll = static_cast<float>(-25 * kDegree);
  expect_turned(only_pose(*in_radians, test::live_link_face(fields)),
                {40 * kDegree, 15 * kDegree, -25 * kDegree});
  EXPECT_THAT(in_radians->describe(), ElementsAre(HasSubstr("\"iPhone\""), "frame 100 at 1.6750 s",
                                                  "head yaw 0.6981 pitch -0.2618 roll -0.4363"));
}

// 320 bytes for a device of 32 letters and a subject of 18, as a reader that was checked against the app has
// it.
TEST(LiveLinkFaceParser, FramesAreTimecodeWhereTheRateCounts) {
  const auto parser = live_parser_of("livelinkface");
  test::FacePacketFields fields;
  fields.frame = 60 * 3'723 + 4;
  const LivePose pose = only_pose(*parser, test::live_link_face(fields));
  ASSERT_TRUE(pose.timecode);
  EXPECT_EQ(timecode_text(*pose.timecode), "01:02:03:04");
  EXPECT_EQ(pose.timecode->part, 0.5);
  fields.frames_per_second = 59;
  EXPECT_FALSE(only_pose(*parser, test::live_link_face(fields)).timecode);
}

TEST(LiveLinkFaceParser, HasTheSizeOfRealPackets) {
  test::FacePacketFields fields;
  fields.device = std::string(32, 'd');
  fields.subject = std::string(18, 's');
  EXPECT_EQ(test::live_link_face(fields).size(), 320u);
}

TEST(LiveLinkFaceParser, TakesPacketsWithoutAFaceAndRefusesBrokenOnes) {
  const auto parser = live_parser_of("livelinkface");
  const PacketBytes packet = test::live_link_face({});
  const size_t names_end = 1 + 4 + 32 + 4 + 6;
  const size_t times_end = names_end + 16;
  for (size_t size = 0; size < packet.size(); ++size) {
    const auto read = parser->parse(std::span(packet).first(size), 0);
    EXPECT_EQ(read.ok(), size == names_end || size == times_end) << size;
    EXPECT_TRUE(!read || read->poses.empty());
  }
  PacketBytes wrong = packet;
  wrong[0] = std::byte{7};
  EXPECT_THAT(parser->parse(wrong, 0).error().message, HasSubstr("version 6 and this one with 7"));
  wrong = packet;
  wrong[1] = std::byte{0xFF};  // a name of four thousand million letters
  EXPECT_FALSE(parser->parse(wrong, 0));
  wrong = packet;
  wrong[times_end] = std::byte{60};
  EXPECT_FALSE(parser->parse(wrong, 0));
  wrong = packet;
  wrong.push_back(std::byte{0});
  EXPECT_FALSE(parser->parse(wrong, 0));
}

// VRChat's page: Unity's coordinates, +Y up, metres, Euler angles. Unity is left-handed with +X to the right;
// it turns about +Z (counter-clockwise as seen from behind), then +X (nose down), then +Y (to the right).
TEST(VrchatParser, TurnsAHeadAsUnityDoes) {
  const auto parser = live_parser_of("vrchat");
  const LivePose pose = only_pose(*parser, test::vrchat({0.3f, 1.6f, 0.5f}, {-15, 40, 25}));
  EXPECT_EQ(pose.subject, "head");
  EXPECT_TRUE(pose.has_position);
  EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {-0.3, 1.6, 0.5}));
  expect_turned(pose, {-40 * kDegree, 15 * kDegree, -25 * kDegree});
  EXPECT_EQ(only_pose(*parser, test::vrchat({0, 1, 0}, {0, 0, 0}, "8")).subject, "8");
  EXPECT_FALSE(is_finite(only_pose(*parser, test::vrchat({0, 1, 0}, {0, 1e30f, 0})).world_from_subject));
}

TEST(VrchatParser, AFrameEndsWithItsLastKind) {
  const auto parser = live_parser_of("vrchat");
  const auto place = [](float y) { return test::osc("/tracking/trackers/head/position", {0.0f, y, 0.0f}); };
  const auto turn = [](float y) { return test::osc("/tracking/trackers/head/rotation", {0.0f, y, 0.0f}); };
  const auto count = [&](const PacketBytes& bytes) { return test::parsed(*parser, bytes).poses.size(); };
  EXPECT_EQ(count(place(1)), 0u) << "its turn is to come";
  EXPECT_EQ(count(turn(10)), 1u);
  EXPECT_EQ(count(place(2)), 0u);
  const LivePose lost = only_pose(*parser, place(3));
  EXPECT_EQ(lost.world_from_subject.position_m.y, 2.0) << "a turn was lost";
  EXPECT_EQ(only_pose(*parser, turn(30)).world_from_subject.position_m.y, 3.0) << "and that changes nothing";
  // Who turns alone has one message a frame.
  const auto turning = live_parser_of("vrchat");
  for (const size_t poses : {0, 1, 1, 2})  // the one before; in the end this one too, from now on
    EXPECT_EQ(test::parsed(*turning, turn(10)).poses.size(), poses);
  const LivePose pose = only_pose(*turning, turn(90));
  EXPECT_FALSE(pose.has_position);
  EXPECT_TRUE(test::looks_along(pose, {-1, 0, 0}));
  for (const PacketBytes& other :
       {test::osc("/tracking/trackers/9/position", {0.0f, 0.0f, 0.0f}),
        test::osc("/tracking/trackers/head/scale", {0.0f, 0.0f, 0.0f}),
        test::osc("/tracking/trackers/head", {0.0f, 0.0f, 0.0f}),
        test::osc("/tracking/trackers/head/position", {0.0f, 0.0f}), test::osc("/avatar/parameters/x", {1})})
    EXPECT_EQ(test::parsed(*turning, other).poses.size(), 0u);
  EXPECT_EQ(turning->ignored(), 5u);
}

// MVN's specification, revision N: big-endian, +Z up, right-handed, centimetres; all segments look along +X
// in the T-pose, with their rotations the identity.
TEST(MvnParser, TurnsAHeadAsTheSpecificationSays) {
  const auto parser = live_parser_of("mvn");
  const auto half = [](double degrees) { return 0.5 * degrees * kDegree; };
  test::MvnPacket packet;
  packet.sample = 7;
  packet.time_ms = 1'500;
  packet.character = 2;
  const float c = static_cast<float>(std::cos(half(40))), s = static_cast<float>(std::sin(half(40)));
  packet.segments = {
      {1, {40, 10, 95}}, {6, {45, 10, 150}}, {7, {50, 10, 160}, {c, 0, 0, s}}, {13, {45, 28, 145}}};
  const LivePose pose = only_pose(*parser, test::mvn(packet));
  EXPECT_EQ(pose.subject, "2");
  EXPECT_EQ(pose.frame, 7u);
  EXPECT_EQ(pose.source_time_ns, 1'500'000'000);
  EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {0.1, 1.6, 0.5}));
  expect_turned(pose, {40 * kDegree, 0, 0});
  EXPECT_THAT(pose.joint_names, ElementsAre("neck", "left_shoulder"));
  EXPECT_TRUE(test::is_near(pose.joint_m.back(), {0.28, 1.45, 0.45}));
  // About +Y the nose goes down, about +X the crown to the right.
  packet.segments[2].rotation = {c, 0, s, 0};
  expect_turned(only_pose(*parser, test::mvn(packet)), {0, -40 * kDegree, 0});
  packet.segments[2].rotation = {c, s, 0, 0};
  expect_turned(only_pose(*parser, test::mvn(packet)), {0, 0, 40 * kDegree});
  // Who sends metres has a torso of less than two.
  const auto metres = live_parser_of("mvn");
  packet.segments = {{1, {0.4f, 0.1f, 0.95f}}, {7, {0.5f, 0.1f, 1.6f}}};
  EXPECT_TRUE(
      test::is_near(only_pose(*metres, test::mvn(packet)).world_from_subject.position_m, {0.1, 1.6, 0.5}));
  EXPECT_THAT(metres->take_notes(), ElementsAre(HasSubstr("taken as metres")));
}

TEST(MvnParser, TakesWholePacketsOnly) {
  const auto parser = live_parser_of("mvn");
  const PacketBytes packet = test::mvn({});
  for (size_t size = 0; size < packet.size(); ++size)
    EXPECT_FALSE(parser->parse(std::span(packet).first(size), 0)) << size;
  EXPECT_FALSE(parser->parse(PacketBytes(packet.size() + 1), 0));
  EXPECT_TRUE(test::parsed(*parser, test::mvn({.kind = "01"})).poses.empty());
  EXPECT_TRUE(test::parsed(*parser, test::mvn({.kind = "25"})).poses.empty());
  EXPECT_EQ(parser->ignored(), 2u);
  EXPECT_THAT(parser->take_notes(), ElementsAre(HasSubstr("as quaternions")));
  EXPECT_TRUE(test::parsed(*parser, test::mvn({.segments = {{1, {0, 0, 95}}}})).poses.empty()) << "no head";
}

}  // namespace
}  // namespace strandcast::live_trackers_test
