// VMC. Packets are written by tests/support/live_packets.h from the protocol's pages, in Unity's axes.
#include <cmath>
#include <numbers>

#include "common/motion/mocap_packet.h"
#include "server/input/live/live_parser.h"
#include "server/input/live/osc_reader.h"
#include "tests/support/live_packets.h"
#include "tests/support/live_poses.h"

namespace strandcast::live_vmc_test {
namespace {

using test::live_parser_of;
using test::osc;
using test::osc_bundle;
using test::PacketBytes;
using test::parsed;
using test::vmc_bone;
using test::vmc_pose;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr test::Quad kUnturned = {0, 0, 0, 1};

test::Quad turn_about(int axis, double angle_rad) {
  test::Quad quaternion = {0, 0, 0, static_cast<float>(std::cos(angle_rad / 2))};
  quaternion[static_cast<size_t>(axis)] = static_cast<float>(std::sin(angle_rad / 2));
  return quaternion;
}

// Unity: +X to the right of who looks along +Z, left-handed. So a positive turn about +Y takes +Z to +X, to
// the right; one about +X takes +Z to -Y, down; one about +Z takes +Y to -X, the crown to the left.
TEST(VmcParser, TurnsAHeadAsUnityDoes) {
  const double angle = 0.5;
  const double s = std::sin(angle), c = std::cos(angle);
  const auto pose_of = [](const test::Quad& rotation) {
    const auto parser = live_parser_of("vmc");
    return parsed(*parser, test::vmc_head({0.1f, 1.5f, -0.2f}, rotation, 2.5f)).poses.at(0);
  };
  const LivePose right = pose_of(turn_about(1, angle));
  EXPECT_TRUE(right.has_position);
  EXPECT_EQ(right.subject, "");
  EXPECT_EQ(right.source_time_ns, 2'500'000'000);
  EXPECT_TRUE(test::is_near(right.world_from_subject.position_m, {-0.1, 1.5, -0.2}));
  EXPECT_TRUE(test::looks_along(right, {-s, 0, c})) << "to its right, which is -X";
  EXPECT_TRUE(test::has_crown_along(right, {0, 1, 0}));
  EXPECT_TRUE(test::looks_along(pose_of(turn_about(0, angle)), {0, -s, c})) << "down";
  const LivePose tilted = pose_of(turn_about(2, angle));
  EXPECT_TRUE(test::looks_along(tilted, {0, 0, 1}));
  EXPECT_TRUE(test::has_crown_along(tilted, {s, c, 0})) << "to its left, which is +X";
}

/// Rotates as the usual formula does, in axes of either hand.
std::array<double, 3> rotated(const test::Quad& q, const std::array<double, 3>& v) {
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const std::array<double, 3> t = {2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]),
                                   2 * (x * v[1] - y * v[0])};
  return {v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
          v[2] + w * t[2] + x * t[1] - y * t[0]};
}

// The chain is walked in Unity's axes here, and only its end is mirrored: so it must come out of a parser
// that mirrors every bone. Every axis of every bone differs.
TEST(VmcParser, ChainsTheBonesFromTheRootToTheHead) {
  struct Bone {
    const char* name;
    test::Triple position_m;
    test::Quad rotation;
  };
  const auto quaternion = [](double x, double y, double z, double w) {
    const double length = std::sqrt(x * x + y * y + z * z + w * w);
    return test::Quad{static_cast<float>(x / length), static_cast<float>(y / length),
                      static_cast<float>(z / length), static_cast<float>(w / length)};
  };
  const std::vector<Bone> chain = {
      {"root", {0.5f, 0.01f, -0.3f}, quaternion(0.1, 0.3, -0.2, 1)},
      {"Hips", {0.02f, 0.9f, 0.04f}, quaternion(-0.2, 0.1, 0.05, 1)},
      {"Spine", {0.01f, 0.1f, -0.02f}, quaternion(0.3, -0.1, 0.1, 1)},
      {"Chest", {-0.01f, 0.13f, 0.03f}, quaternion(0.05, 0.2, 0.3, 1)},
      {"UpperChest", {0.02f, 0.11f, -0.01f}, quaternion(-0.1, -0.2, 0.15, 1)},
      {"Neck", {0.01f, 0.15f, 0.02f}, quaternion(0.25, 0.05, -0.3, 1)},
      {"Head", {-0.02f, 0.09f, 0.05f}, quaternion(0.15, -0.35, 0.2, 1)},
  };
  std::vector<PacketBytes> messages;
  for (const Bone& bone : chain)
    messages.push_back(vmc_pose(bone.name == std::string("root") ? "/VMC/Ext/Root/Pos" : "/VMC/Ext/Bone/Pos",
                                bone.name, bone.position_m, bone.rotation));
  const auto parser = live_parser_of("vmc");
  const LivePacket packet = parsed(*parser, osc_bundle(messages));
  ASSERT_EQ(packet.poses.size(), 1u);

  // From the head back to the root: where its joint is, and where it looks.
  const auto in_unity = [&](std::array<double, 3> point, size_t first_bone, bool is_place) {
    for (size_t i = first_bone + 1; i-- > 0;) {
      point = rotated(chain[i].rotation, point);
      for (size_t axis = 0; axis < 3 && is_place; ++axis) point[axis] += chain[i].position_m[axis];
    }
    return glm::dvec3(-point[0], point[1], point[2]);  // mirrored
  };
  const LivePose& head = packet.poses[0];
  EXPECT_TRUE(test::is_near(head.world_from_subject.position_m, in_unity({0, 0, 0}, 6, true)));
  EXPECT_TRUE(test::looks_along(head, in_unity({0, 0, 1}, 6, false)));
  EXPECT_TRUE(test::has_crown_along(head, in_unity({0, 1, 0}, 6, false)));
  EXPECT_THAT(head.joint_names, ElementsAre("neck", "chest"));
  EXPECT_TRUE(test::is_near(head.joint_m.at(0), in_unity({0, 0, 0}, 5, true)));
  EXPECT_TRUE(test::is_near(head.joint_m.at(1), in_unity({0, 0, 0}, 4, true)));
}

TEST(VmcParser, SaysWhereShouldersAndElbowsAre) {
  const auto parser = live_parser_of("vmc");
  const LivePacket packet =
      parsed(*parser,
             osc_bundle({vmc_bone("Hips", {0, 1, 0}, kUnturned), vmc_bone("Chest", {0, 0.25f, 0}, kUnturned),
                         vmc_bone("Head", {0, 0.25f, 0}, kUnturned),
                         vmc_bone("LeftUpperArm", {-0.2f, 0.125f, 0}, kUnturned),
                         vmc_bone("LeftLowerArm", {-0.3f, 0, 0.0625f}, kUnturned),
                         vmc_bone("RightShoulder", {0.0625f, 0.125f, 0}, turn_about(1, std::numbers::pi / 2)),
                         vmc_bone("RightUpperArm", {0.25f, 0, 0}, kUnturned)}));
  ASSERT_EQ(packet.poses.size(), 1u);
  const LivePose& head = packet.poses[0];
  EXPECT_THAT(head.joint_names, ElementsAre("chest", "left_shoulder", "right_shoulder", "left_elbow"));
  ASSERT_EQ(head.joint_m.size(), 4u);
  // Unity's left is -X, ours +X. Arms hang on the chest where there is no collar bone.
  EXPECT_TRUE(test::is_near(head.joint_m[0], {0, 1.25, 0}));
  EXPECT_TRUE(test::is_near(head.joint_m[1], {0.2, 1.375, 0}));
  // A quarter turn to the right lays Unity's +X, the way to the shoulder, onto -Z.
  EXPECT_TRUE(test::is_near(head.joint_m[2], {-0.0625, 1.375, -0.25}));
  EXPECT_TRUE(test::is_near(head.joint_m[3], {0.5, 1.375, 0.0625}));
}

TEST(VmcParser, TakesItsOwnBodyWherePositionsAreZero) {
  const PacketBytes packet =
      osc_bundle({vmc_bone("Hips", {0, 0, 0}, kUnturned), vmc_bone("Neck", {0, 0, 0}, turn_about(0, 0.5)),
                  vmc_bone("Head", {0, 0, 0}, kUnturned)});
  LiveParserConfig config;
  config.protocol = "vmc";
  const LivePose usual = parsed(*make_live_parser(config).value(), packet).poses.at(0);
  EXPECT_GT(usual.world_from_subject.position_m.y, 0.5) << "as high as hips";
  EXPECT_GT(usual.world_from_subject.position_m.z, 0.02) << "a neck that bows takes the head ahead";
  config.ignores_zero_positions = false;
  const LivePose literal = parsed(*make_live_parser(config).value(), packet).poses.at(0);
  EXPECT_TRUE(test::is_near(literal.world_from_subject.position_m, {0, 0, 0}));
  EXPECT_TRUE(test::looks_along(literal, test::face_of(usual)));
}

TEST(VmcParser, KnowsNoPlaceOfAHeadWithoutABody) {
  const auto parser = live_parser_of("vmc");
  const LivePacket packet = parsed(*parser, osc_bundle({vmc_bone("Head", {0, 0, 0}, turn_about(1, 0.3))}));
  ASSERT_EQ(packet.poses.size(), 1u);
  EXPECT_FALSE(packet.poses[0].has_position);
}

TEST(VmcParser, NamesTrackersBySerialNumber) {
  const auto parser = live_parser_of("vmc");
  const LivePacket packet =
      parsed(*parser, osc_bundle({vmc_pose("/VMC/Ext/Hmd/Pos", "LHR-1", {1, 2, 3}, turn_about(1, 0.5)),
                                  vmc_pose("/VMC/Ext/Tra/Pos", "LHR-2\n", {-1, 0, 0}, kUnturned),
                                  vmc_pose("/VMC/Ext/Con/Pos/Local", "LHR-3", {9, 9, 9}, kUnturned)}));
  ASSERT_EQ(packet.poses.size(), 2u);
  EXPECT_EQ(packet.poses[0].subject, "LHR-1");
  EXPECT_TRUE(test::is_near(packet.poses[0].world_from_subject.position_m, {-1, 2, 3}));
  EXPECT_TRUE(test::looks_along(packet.poses[0], {-std::sin(0.5), 0, std::cos(0.5)}));
  EXPECT_EQ(packet.poses[1].subject, "LHR-2 ") << "made fit for one line";
  EXPECT_EQ(parser->ignored(), 0u);
}

TEST(VmcParser, TakesWind) {
  const auto parser = live_parser_of("vmc");
  EXPECT_EQ(parsed(*parser, test::osc_wind({1.5f, -0.25f, 3.0f})).wind_mps, glm::dvec3(1.5, -0.25, 3.0));
  EXPECT_FALSE(parsed(*parser, osc("/strandcast/wind", {1.0f, 2.0f})).wind_mps.has_value());
  EXPECT_EQ(parser->ignored(), 1u);
}

TEST(VmcParser, LeavesOutAndCountsWhatItDoesNotKnow) {
  const auto parser = live_parser_of("vmc");
  const LivePacket packet = parsed(
      *parser, osc_bundle({osc("/other/thing", {1}), osc("/VMC/Ext/Blend/Val", {std::string("Joy"), 0.5f}),
                           osc("/VMC/Ext/Bone/Pos", {std::string("Head"), 1.0f}),  // too few
                           osc("/VMC/Ext/T", {3}),                                 // of another kind
                           vmc_bone("LeftThumbDistal", {1, 2, 3}, kUnturned)}));
  EXPECT_THAT(packet.poses, IsEmpty());
  EXPECT_EQ(parser->ignored(), 3u);
  // Arguments beyond those known do not matter.
  std::vector<test::OscValue> values = {std::string("Head")};
  for (const float number : {0.0f, 1.5f, 0.0f, 0.0f, 0.0f, 0.0f, 1.0f, 42.0f}) values.emplace_back(number);
  EXPECT_EQ(parsed(*parser, osc_bundle({osc("/VMC/Ext/Bone/Pos", values)})).poses.size(), 1u);
}

/// Heights of the heads that datagrams tell, each frame of which has the hips and the head at its own height.
std::vector<int> heights(LiveParser& parser, const std::vector<PacketBytes>& datagrams) {
  std::vector<int> found;
  for (const PacketBytes& datagram : datagrams)
    for (const LivePose& pose : parsed(parser, datagram).poses)
      found.push_back(static_cast<int>(std::lround(pose.world_from_subject.position_m.y)));
  return found;
}
PacketBytes hips(int height) {
  return vmc_bone("Hips", {0, static_cast<float>(height), 0}, kUnturned);
}
/// The head above the neck by so much, so that heads of mixed frames show.
PacketBytes head(int height) {
  return vmc_bone("Head", {0, static_cast<float>(100 * height), 0}, kUnturned);
}
PacketBytes upper_chest(int height) {
  return vmc_bone("UpperChest", {0, static_cast<float>(10'000 * height), 0}, kUnturned);
}
constexpr int kWhole = 10'101;

TEST(VmcParser, EndsAFrameWithItsBundle) {
  const auto parser = live_parser_of("vmc");
  EXPECT_THAT(heights(*parser, {osc_bundle({hips(1), head(1), upper_chest(1)}),
                                osc_bundle({hips(2), head(2), upper_chest(2)})}),
              ElementsAre(kWhole, 2 * kWhole));
  // Two frames in one bundle.
  EXPECT_THAT(
      heights(*parser, {osc_bundle({hips(3), head(3), upper_chest(3), hips(4), head(4), upper_chest(4)})}),
      ElementsAre(3 * kWhole, 4 * kWhole));
}

// Unity's order has UpperChest behind all other bones, often in a datagram of its own.
TEST(VmcParser, WaitsForTheRestOfAFrameOnceItKnowsWhatComes) {
  const auto parser = live_parser_of("vmc");
  std::vector<PacketBytes> datagrams;
  for (int i = 1; i <= 4; ++i) {
    datagrams.push_back(osc_bundle({hips(i), head(i)}));
    datagrams.push_back(osc_bundle({upper_chest(i)}));
  }
  // Of the first frame a half is told at once, as nobody knows yet that more comes.
  EXPECT_THAT(heights(*parser, datagrams), ElementsAre(101, kWhole, 2 * kWhole, 3 * kWhole, 4 * kWhole));
  // A half that is lost: told when the next frame begins, with what was known of the rest; frames are not
  // mixed after.
  EXPECT_THAT(heights(*parser, {osc_bundle({hips(5), head(5)}), osc_bundle({hips(6), head(6)}),
                                osc_bundle({upper_chest(6)})}),
              ElementsAre(5 * 101 + 40'000, 6 * kWhole));
  EXPECT_THAT(heights(*parser, {osc_bundle({upper_chest(7)}), osc_bundle({hips(8), head(8)}),
                                osc_bundle({upper_chest(8)})}),
              ElementsAre(6 * 101 + 70'000, 8 * kWhole));
}

TEST(VmcParser, EndsAFrameOfSingleMessagesWhenABoneRepeats) {
  const auto parser = live_parser_of("vmc");
  std::vector<PacketBytes> datagrams;
  for (int i = 1; i <= 3; ++i)
    for (const PacketBytes& message : {head(i), upper_chest(i)}) datagrams.push_back(message);
  EXPECT_THAT(heights(*parser, datagrams), ElementsAre(10'100, 20'200, 30'300))
      << "the first when its head comes again, the others when they are whole";
}

TEST(VmcParser, ForgetsBonesThatDoNotComeAnyMore) {
  const auto parser = live_parser_of("vmc");
  (void)heights(*parser, {osc_bundle({hips(1), head(1), upper_chest(1)})});
  size_t told_late = 0;
  for (int i = 2; i < 100; ++i)
    if (const auto found = heights(*parser, {osc_bundle({hips(i), head(i)})});
        found.empty() || found.back() != 101 * i + 10'000)
      ++told_late;
  EXPECT_GT(told_late, 0u);
  EXPECT_LT(told_late, 40u) << "then frames end without it";
}

// A body that moves on without its head moves no hair, and whoever sends it hears why.
TEST(VmcParser, AHeadThatIsToldNoMoreIsLost) {
  const auto parser = live_parser_of("vmc");
  EXPECT_EQ(heights(*parser, {osc_bundle({hips(1), head(1)})}).size(), 1u);
  size_t told = 0;
  for (int i = 0; i < 100; ++i) told += heights(*parser, {osc_bundle({hips(2), upper_chest(1)})}).size();
  EXPECT_LT(told, 40u) << "then it is lost";
  EXPECT_THAT(parser->take_notes(), ElementsAre(HasSubstr("no Head among them")));
  EXPECT_THAT(parser->take_notes(), IsEmpty()) << "once";
  told = 0;
  for (int i = 0; i < 40; ++i)
    told += heights(*parser, {osc_bundle({hips(2), upper_chest(1), head(1)})}).size();
  EXPECT_GT(told, 30u) << "it is back";
  const auto never = live_parser_of("vmc");
  for (int i = 0; i < 100; ++i) EXPECT_THAT(heights(*never, {osc_bundle({hips(2)})}), IsEmpty());
  EXPECT_THAT(never->take_notes(), ElementsAre(HasSubstr("no Head among them")));
}

TEST(VmcParser, AStartTakesNumbersOfBothKinds) {
  const auto parser = live_parser_of("vmc");
  const auto take_of = [&](const std::vector<test::OscValue>& values) {
    return parser->take_of(osc("/strandcast/record/start", values));
  };
  EXPECT_EQ(take_of({std::string("12A"), 3.0f})->take, 3u);
  EXPECT_EQ(take_of({int32_t{7}, int32_t{2}})->slate, "7");
  EXPECT_EQ(take_of({})->take, 0u);
  for (const float wrong : {2.5f, -1.0f, 1e30f, std::nanf("")})
    EXPECT_FALSE(take_of({std::string("12A"), wrong})) << wrong;
  const std::vector<test::OscValue> half = {std::string("12A"), 2.5f};
  (void)parsed(*parser, osc("/strandcast/record/start", half));
  EXPECT_THAT(parser->take_notes(),
              ElementsAre(HasSubstr("start takes a slate (text) and a take (a number)")));
}

TEST(VmcParser, ShowsAQuaternionWithoutDirection) {
  const auto parser = live_parser_of("vmc");
  for (const test::Quad& bad : {test::Quad{0, 0, 0, 0}, test::Quad{0, NAN, 0, 1}, test::Quad{9, 9, 9, 9}}) {
    const LivePacket packet =
        parsed(*parser, osc_bundle({hips(1), vmc_bone("Neck", {0, 1, 0}, bad), head(1)}));
    ASSERT_EQ(packet.poses.size(), 1u);
    EXPECT_FALSE(is_finite(packet.poses[0].world_from_subject));
  }
  EXPECT_TRUE(
      is_finite(parsed(*parser, osc_bundle({hips(1), vmc_bone("Neck", {0, 1, 0}, kUnturned), head(1)}))
                    .poses.at(0)
                    .world_from_subject));
}

TEST(VmcParser, IsAsItWasAfterAnError) {
  const auto parser = live_parser_of("vmc");
  (void)parsed(*parser, osc_bundle({hips(1), head(1)}));
  PacketBytes broken = osc_bundle({hips(7), head(7)});
  broken.resize(broken.size() - 4);
  EXPECT_FALSE(parser->parse(broken, 0));
  EXPECT_THAT(heights(*parser, {osc_bundle({hips(2)}), osc_bundle({head(2)})}), ElementsAre(202));
  EXPECT_FALSE(parser->parse(PacketBytes(2000), 0)) << "beyond the limit";
}

TEST(VmcParser, DescribesWhatCame) {
  const auto parser = live_parser_of("vmc");
  EXPECT_THAT(parser->describe(), IsEmpty());
  (void)parsed(*parser, osc_bundle({osc("/VMC/Ext/T", {1.5f}), osc("/odd\n", {7, std::string("a\x1b[2J")})}));
  EXPECT_THAT(parser->describe(), ElementsAre("/VMC/Ext/T 1.5", HasSubstr("7 \"a")));
  for (const std::string& line : parser->describe())
    EXPECT_EQ(line.find_first_of("\n\x1b"), std::string::npos);
  (void)parsed(*parser, osc_bundle(std::vector<PacketBytes>(90, osc("/a", {1}))));
  const auto lines = parser->describe();
  ASSERT_EQ(lines.size(), kMaxMonitorLines);
  EXPECT_EQ(lines.back(), "and 27 more");
}

/// The same message with the bytes of its floats, which are its last ones, turned round.
PacketBytes with_little_floats(PacketBytes message, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    const auto end = message.end() - static_cast<std::ptrdiff_t>(i * sizeof(float));
    std::reverse(end - sizeof(float), end);
  }
  return message;
}

TEST(VmcParser, ReadsFloatsOfTheOtherOrderWhereQuaternionsSaySo) {
  const auto parser = live_parser_of("vmc");
  LivePacket packet;
  std::vector<std::string> notes;
  for (int i = 0; i < 8; ++i) {
    const PacketBytes head =
        test::vmc_pose("/VMC/Ext/Tra/Pos", "hat", {0.1f, 1.7f, 0.2f}, turn_about(1, 0.1 * (i + 1)));
    packet =
        parsed(*parser,
               osc_bundle({with_little_floats(osc("/VMC/Ext/T", {12.3f}), 1), with_little_floats(head, 7)}));
    for (std::string& note : parser->take_notes()) notes.push_back(std::move(note));
  }
  EXPECT_THAT(notes, ElementsAre("the sender's floats are little-endian, and are read so"));
  ASSERT_EQ(packet.poses.size(), 1u);
  EXPECT_NEAR(packet.poses[0].world_from_subject.position_m.y, 1.7, 1e-6);
  // And back, as another program at the same port may send.
  for (int i = 0; i < 8; ++i)
    packet = parsed(*parser, osc_bundle({test::vmc_pose("/VMC/Ext/Tra/Pos", "hat", {0.1f, 1.6f, 0.2f},
                                                        turn_about(1, 0.1 * (i + 1)))}));
  EXPECT_NEAR(packet.poses.at(0).world_from_subject.position_m.y, 1.6, 1e-6);
}

// A receiver that knows the protocol's pages alone: it waits for OK, and hangs each bone on the one before.
TEST(VmcPackets, HaveTheBonesThatPlaceAHead) {
  const Pose head{{0.3, 1.6, -0.2}, glm::angleAxis(0.4, glm::dvec3(0, 1, 0))};
  const auto bytes = find_mocap_encoding("vmc")->encode({1.0, head});
  const auto osc = read_osc(bytes, kMaxDatagramBytes);
  ASSERT_TRUE(osc && !osc->messages.empty());
  OscArguments loaded(osc->messages.front());
  EXPECT_EQ(osc->messages.front().address, "/VMC/Ext/OK");
  EXPECT_EQ(loaded.take_int(), 1);
  std::vector<std::string> bones;
  glm::dvec3 place_m(0.0);  // in Unity's axes
  for (const OscMessage& message : osc->messages) {
    if (!message.address.ends_with("/Pos")) continue;
    OscArguments arguments(message);
    bones.emplace_back(arguments.take_string().value_or(""));
    for (int axis = 0; axis < 3; ++axis) place_m[axis] += arguments.take_float().value_or(NAN);
    const std::array<float, 3> turn{*arguments.take_float(), *arguments.take_float(),
                                    *arguments.take_float()};
    EXPECT_NEAR(turn[1], bones.back() == "Head" ? -std::sin(0.2) : 0.0, 1e-6) << bones.back();
    EXPECT_NEAR(arguments.take_float().value_or(0.0f), bones.back() == "Head" ? std::cos(0.2) : 1.0, 1e-6);
  }
  EXPECT_THAT(bones, testing::ElementsAre("root", "Hips", "Spine", "Chest", "Neck", "Head"));
  EXPECT_LT(glm::distance(place_m, glm::dvec3(-0.3, 1.6, -0.2)), 1e-6);
}

}  // namespace
}  // namespace strandcast::live_vmc_test
