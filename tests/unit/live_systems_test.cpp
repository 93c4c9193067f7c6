// Parsers of capture systems: NatNet and VRPN. Packets are written by tests/support/live_packets.h from the
// documents.
#include <cmath>

#include "server/input/live/live_parser.h"
#include "tests/support/live_packets.h"
#include "tests/support/live_poses.h"

namespace strandcast::live_systems_test {
namespace {

using test::live_parser_of;
using test::PacketBytes;
using test::parsed;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

const std::vector<std::string> kVersions = {"2.5",  "2.6", "2.7", "2.8", "2.9", "2.10",
                                            "2.11", "3.0", "3.1", "4.0", "4.1"};

std::vector<std::string> subjects(const LivePacket& packet) {
  std::vector<std::string> names;
  for (const LivePose& pose : packet.poses) names.push_back(pose.subject);
  return names;
}

/// A body that was turned by a third of a turn about (1, 1, 1): its X looks along Y, Y along Z, Z along X.
constexpr test::Quad kThird = {0.5f, 0.5f, 0.5f, 0.5f};

/// The frame that the test data of python_natnet (BSD 3-Clause) recorded from Motive 2.1: its values, in
/// bytes of our own writer.
test::NatnetPacket recorded_values(const std::string& version) {
  test::NatnetPacket packet;
  packet.version = version;
  packet.frame = 162'734;
  packet.time_s = 1356.117;
  packet.bodies = {
      {2, {0.1744466f, 1.4471314f, -0.7343040f}, {-0.05459423f, 0.5099482f, 0.04370357f, -0.8573577f}, true}};
  return packet;
}

TEST(NatnetParser, ReadsBodiesOfEveryVersion) {
  for (const std::string& version : kVersions)
    for (const bool is_told : {false, true})
      for (const bool has_all_kinds : {false, true}) {
        const auto parser = live_parser_of("natnet", "", is_told ? version : "");
        test::NatnetPacket values = recorded_values(version);
        values.has_all_kinds = has_all_kinds;
        const LivePacket packet = parsed(*parser, test::natnet(values));
        ASSERT_EQ(packet.poses.size(), 1u) << version;
        const LivePose& pose = packet.poses[0];
        EXPECT_EQ(pose.subject, "2");
        EXPECT_EQ(pose.frame, 162'734u);
        // 2.5 tells no time, 2.6 a float, which has steps of 2^-13 s there.
        if (version == "2.5")
          EXPECT_FALSE(pose.source_time_ns.has_value());
        else if (version == "2.6")
          EXPECT_NEAR(static_cast<double>(pose.source_time_ns.value_or(0)), 1356.117e9, 1e9 / 16384);
        else
          EXPECT_EQ(pose.source_time_ns, 1'356'117'000'000) << version;
        EXPECT_TRUE(test::is_near(pose.world_from_subject.position_m, {0.1744466, 1.4471314, -0.7343040}));
        EXPECT_FLOAT_EQ(static_cast<float>(pose.world_from_subject.rotation.y), 0.5099482f);
        EXPECT_FLOAT_EQ(static_cast<float>(pose.world_from_subject.rotation.w), -0.8573577f);
        EXPECT_EQ(parser->ignored(), 0u);
      }
}

// Motive streams +Y up or +Z up, as its user chooses. A point 1 to the right, 2 ahead and 3 up of a system
// with +Z up (x, y, z) is (1, 3, -2) with +Y up, and the axes that a body was turned about go the same way.
TEST(NatnetParser, LaysTheWorldOnItsSide) {
  test::NatnetPacket values;
  values.bodies = {{1, {1, 2, 3}, kThird, true}};
  const LivePose standing = parsed(*live_parser_of("natnet"), test::natnet(values)).poses.at(0);
  EXPECT_TRUE(test::is_near(standing.world_from_subject.position_m, {1, 2, 3}));
  EXPECT_TRUE(test::looks_along(standing, {1, 0, 0}));
  EXPECT_TRUE(test::has_crown_along(standing, {0, 0, 1}));
  // Its own Z, ahead of a face here, is -Y there; the body takes that to -Z, which is -Y here. Y here is Z
  // there, which goes to X.
  const LivePose laid = parsed(*live_parser_of("natnet", "z-up"), test::natnet(values)).poses.at(0);
  EXPECT_TRUE(test::is_near(laid.world_from_subject.position_m, {1, 3, -2}));
  EXPECT_TRUE(test::looks_along(laid, {0, -1, 0}));
  EXPECT_TRUE(test::has_crown_along(laid, {1, 0, 0}));
}

TEST(NatnetParser, LeavesOutBodiesThatAreNotTracked) {
  test::NatnetPacket values;
  values.bodies = {{1, {1, 1, 1}, {}, false}, {2, {2, 2, 2}, kThird, true}, {3, {NAN, 3, 3}, {}, true}};
  const auto parser = live_parser_of("natnet");
  const LivePacket packet = parsed(*parser, test::natnet(values));
  EXPECT_THAT(subjects(packet), ElementsAre("2", "3"));
  EXPECT_FALSE(is_finite(packet.poses.at(1).world_from_subject)) << "left to whoever takes it";
  EXPECT_THAT(parser->describe(), ElementsAre("frame 1 at 0.0000 s", HasSubstr("1 (not tracked): x 1.0000"),
                                              HasSubstr("2: x 2.0000"), HasSubstr("3: x nan")));
}

TEST(NatnetParser, CallsBodiesAndBonesByTheirNames) {
  for (const std::string& version : kVersions) {
    const auto parser = live_parser_of("natnet");
    test::NatnetPacket values;
    values.version = version;
    values.bodies = {{2, {}, kThird, true}, {3, {}, kThird, true}};
    values.bones = {{1, {}, kThird, true}, {7, {}, kThird, true}};
    EXPECT_THAT(subjects(parsed(*parser, test::natnet(values))), ElementsAre("2", "3", "5/1", "5/7"));
    (void)parsed(*parser,
                 test::natnet_names(version, {{2, "Prop\n"}, {4, "Other"}}, {{1, "Hips"}, {7, "Head"}}));
    EXPECT_THAT(subjects(parsed(*parser, test::natnet(values))),
                ElementsAre("Prop ", "3", "Actor/Hips", "Actor/Head"))
        << version;
  }
}

/// The number of the message that is sent next.
int message_id(const std::vector<std::byte>& bytes) {
  return bytes.empty() ? -1 : std::to_integer<int>(bytes[0]);
}

TEST(NatnetParser, AsksForWhatItDoesNotKnow) {
  const auto parser = live_parser_of("natnet");
  constexpr int kConnect = 0, kRequestModels = 4, kKeepAlive = 10;
  const auto greeting = parser->greeting();
  ASSERT_EQ(greeting.size(), 4u + 270u);
  EXPECT_EQ(message_id(greeting), kConnect);
  EXPECT_EQ(std::to_integer<int>(greeting[2]) + 256 * std::to_integer<int>(greeting[3]), 270);
  EXPECT_EQ(parser->request(), greeting) << "until a server answers";
  (void)parsed(*parser, test::natnet_server(4, 1));
  EXPECT_EQ(message_id(parser->request()), kRequestModels);
  (void)parsed(*parser, test::natnet_names("4.1", {{2, "Head"}}, {}));
  EXPECT_EQ(message_id(parser->request()), kKeepAlive);
  test::NatnetPacket values = recorded_values("4.1");
  (void)parsed(*parser, test::natnet(values));
  EXPECT_EQ(message_id(parser->request()), kKeepAlive);
  values.flags = 2;
  EXPECT_THAT(subjects(parsed(*parser, test::natnet(values))), ElementsAre("Head"));
  EXPECT_EQ(message_id(parser->request()), kRequestModels) << "the server has other models now";
  EXPECT_EQ(parser->describe().at(0), "server \"Motive\", NatNet 4.1");
}

// The server's answer tells the version; what it says is read first, and named where nothing fits.
TEST(NatnetParser, ReadsWhatAServerOfAnOlderVersionSends) {
  for (const std::string& version : kVersions) {
    const auto parser = live_parser_of("natnet");
    const int number = test::natnet_number(version);
    (void)parsed(*parser,
                 test::natnet_server(static_cast<uint8_t>(number / 100), static_cast<uint8_t>(number % 100)));
    test::NatnetPacket values = recorded_values(version);
    for (uint32_t markers = 0; markers < 2; ++markers) {
      values.has_all_kinds = markers == 1;
      EXPECT_THAT(subjects(parsed(*parser, test::natnet(values))), ElementsAre("2")) << version;
    }
    const PacketBytes whole = test::natnet(values);
    const auto cut = parser->parse(std::span(whole).first(whole.size() - 1), 0);
    ASSERT_FALSE(cut);
    EXPECT_THAT(cut.error().message, HasSubstr("2.5 to 4.1; its server says " + version));
    // One that its server does not track any more has no pose. Before 2.6 nothing tells.
    values.bodies[0].is_tracked = false;
    EXPECT_EQ(parsed(*parser, test::natnet(values)).poses.size(), version == "2.5" ? 1u : 0u) << version;
  }
}

// A float of 36,000 s has steps of 4 ms: the times of arrival are better.
TEST(NatnetParser, LeavesOutTimesThatAreTooCoarse) {
  const auto parser = live_parser_of("natnet", "", "2.6");
  test::NatnetPacket values = recorded_values("2.6");
  EXPECT_TRUE(parsed(*parser, test::natnet(values)).poses.at(0).source_time_ns.has_value());
  values.time_s = 36'000.0;
  EXPECT_FALSE(parsed(*parser, test::natnet(values)).poses.at(0).source_time_ns.has_value());
  EXPECT_THAT(parser->describe().at(0), testing::Eq("frame 162734"));
}

TEST(NatnetParser, HoldsToTheVersionThatWasSet) {
  const auto parser = live_parser_of("natnet", "", "3.1");
  EXPECT_TRUE(parser->parse(test::natnet(recorded_values("3.0")), 0)) << "the same layout";
  const auto other = parser->parse(test::natnet(recorded_values("4.1")), 0);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("3.1"));
  LiveParserConfig config;
  config.protocol = "natnet";
  config.protocol_version = "2.4";
  EXPECT_THAT(make_live_parser(config).error().message, HasSubstr("4.1, 4.0, 3.1, 3.0, 2.11"));
  // What a server says is tried first only: its bitstream may be set to another version.
  const auto open = live_parser_of("natnet");
  (void)parsed(*open, test::natnet_server(4, 1));
  EXPECT_EQ(parsed(*open, test::natnet(recorded_values("3.1"))).poses.size(), 1u);
}

TEST(NatnetParser, RefusesWhatIsCutOrCountsTooMuch) {
  for (const std::string version : {"3.1", "4.1"}) {
    test::NatnetPacket values = recorded_values(version);
    values.has_all_kinds = true;
    values.bones = {{1, {}, kThird, true}};
    const auto parser = live_parser_of("natnet");
    for (const PacketBytes& whole :
         {test::natnet(values), test::natnet_names(version, {{2, "Head"}}, {{1, "Hips"}})}) {
      ASSERT_TRUE(parser->parse(whole, 0));
      for (size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(parser->parse(std::span(whole).first(size), 0)) << version << " " << size;
      PacketBytes longer = whole;
      longer.push_back(std::byte{0});
      EXPECT_FALSE(parser->parse(longer, 0));
      // Every count and size, one after the other, as the largest number there is: nothing is reserved for
      // it.
      for (size_t at = 4; at + 4 <= whole.size(); ++at) {
        PacketBytes huge = whole;
        std::fill_n(huge.begin() + static_cast<ptrdiff_t>(at), 4, std::byte{0xFF});
        const auto read = parser->parse(huge, 0);
        EXPECT_TRUE(!read || read->poses.size() <= 2u);
      }
    }
    const PacketBytes server = test::natnet_server(4, 1);
    EXPECT_FALSE(parser->parse(std::span(server).first(200), 0));
  }
  const auto parser = live_parser_of("natnet");
  EXPECT_THAT(parsed(*parser, test::natnet_message(8, PacketBytes(4))).poses, IsEmpty());
  EXPECT_EQ(parser->ignored(), 1u) << "a message string";
}

TEST(VrpnParser, ReadsTrackersOfAServer) {
  const auto parser = live_parser_of("vrpn");
  EXPECT_EQ(parser->greeting(), test::vrpn_cookie());
  test::PacketWriter stream(std::endian::big);
  stream.append(test::vrpn_begin("Head"));
  stream.append(test::vrpn_pose(1234.5, 0, 3, 0, {1, 2, 3}, {0.5, 0.5, 0.5, 0.5}));
  stream.append(test::vrpn_pose(1234.625, 0, 3, 2, {4, 5, 6}, {0, 0, 0, 1}));
  const LivePacket packet = parsed(*parser, stream.bytes());
  EXPECT_THAT(subjects(packet), ElementsAre("Head", "Head/2"));
  EXPECT_EQ(packet.poses.at(0).source_time_ns, 1'234'500'000'000);
  EXPECT_EQ(packet.poses.at(1).source_time_ns, 1'234'625'000'000);
  EXPECT_TRUE(test::is_near(packet.poses[0].world_from_subject.position_m, {1, 2, 3}));
  EXPECT_TRUE(test::looks_along(packet.poses[0], {1, 0, 0}));
  EXPECT_TRUE(test::has_crown_along(packet.poses[0], {0, 0, 1}));
  EXPECT_THAT(parser->describe(),
              ElementsAre(HasSubstr("Head: x 1.0000 y 2.0000 z 3.0000"), HasSubstr("Head/2")));
  const auto laid = live_parser_of("vrpn", "z-up");
  EXPECT_TRUE(
      test::is_near(parsed(*laid, stream.bytes()).poses.at(0).world_from_subject.position_m, {1, 3, -2}));
}

TEST(VrpnParser, TakesAStreamInAnyPieces) {
  test::PacketWriter stream(std::endian::big);
  stream.append(test::vrpn_begin("Head"));
  for (int i = 0; i < 5; ++i) {
    stream.append(test::vrpn_message(i, 0, 2, PacketBytes(static_cast<size_t>(i))));  // bodies of odd lengths
    stream.append(test::vrpn_pose(i, 0, 3, 0, {static_cast<double>(i), 0, 0}, {0, 0, 0, 1}));
  }
  for (const size_t piece : {1, 7, 24, 100, 10'000}) {
    const auto parser = live_parser_of("vrpn");
    std::vector<double> found;
    std::span<const std::byte> rest = stream.bytes();
    while (!rest.empty()) {
      const size_t size = std::min(piece, rest.size());
      const auto packet = parser->parse(rest.first(size), 0);
      ASSERT_TRUE(packet) << packet.error().to_string();
      for (const LivePose& pose : packet->poses) found.push_back(pose.world_from_subject.position_m.x);
      rest = rest.subspan(size);
    }
    EXPECT_THAT(found, ElementsAre(0, 1, 2, 3, 4)) << piece;
    EXPECT_EQ(parser->ignored(), 5u) << "pings";
  }
}

TEST(VrpnParser, RefusesStrangersAndWrongLengths) {
  const auto stranger = live_parser_of("vrpn");
  const PacketBytes http = test::PacketWriter(std::endian::big).text("HTTP/1.1 400").bytes();
  EXPECT_THAT(stranger->parse(http, 0).error().message, HasSubstr("no server of VRPN 7"));
  PacketBytes older = test::vrpn_cookie();
  older[12] = std::byte{'6'};  // 06.35
  EXPECT_FALSE(stranger->parse(older, 0));
  EXPECT_EQ(parsed(*stranger, test::vrpn_begin("Head")).poses.size(), 0u) << "as it was";

  const auto parser = live_parser_of("vrpn");
  (void)parsed(*parser, test::vrpn_begin("Head"));
  const PacketBytes pose = test::vrpn_pose(1, 0, 3, 0, {1, 2, 3}, {0, 0, 0, 1});
  for (const uint32_t length : {0u, 23u, 64'001u, 0x7fffffffu, 0xffffffffu}) {
    test::PacketWriter wrong(std::endian::big);
    wrong.append(pose).put(length).append(PacketBytes(20));
    EXPECT_FALSE(parser->parse(wrong.bytes(), 0)) << length;
  }
  EXPECT_FALSE(parser->parse(test::vrpn_description(-1, 5000, "far"), 0));
  EXPECT_FALSE(parser->parse(test::vrpn_description(-1, -5, "below"), 0));
  EXPECT_FALSE(parser->parse(test::vrpn_message(0, 1, -2, PacketBytes(4)), 0)) << "a name of no length";
  EXPECT_FALSE(parser->parse(test::vrpn_message(0, 1, -2, PacketBytes(5, std::byte{0x7f})), 0));
  EXPECT_EQ(parsed(*parser, pose).poses.size(), 1u) << "none of them left anything behind";
  // A pose of another length, and of a type that nobody described, say nothing.
  EXPECT_THAT(parsed(*parser, test::vrpn_message(0, 0, 3, PacketBytes(63))).poses, IsEmpty());
  EXPECT_THAT(parsed(*parser, test::vrpn_pose(1, 0, 9, 0, {1, 2, 3}, {0, 0, 0, 1})).poses, IsEmpty());
  EXPECT_EQ(parser->ignored(), 2u);
}

TEST(VrpnParser, HoldsItsLimits) {
  const auto parser = live_parser_of("vrpn");
  (void)parsed(*parser, test::vrpn_begin("Head"));
  constexpr size_t kMostBodyBytes = 64'000 - 24;
  EXPECT_TRUE(parser->parse(test::vrpn_message(0, 0, 2, PacketBytes(kMostBodyBytes)), 0));
  EXPECT_THAT(parser->parse(test::vrpn_message(0, 0, 2, PacketBytes(kMostBodyBytes + 1)), 0).error().message,
              HasSubstr("of 64001 bytes; 24 to 64000 are allowed"));
  EXPECT_TRUE(parser->parse(test::vrpn_description(-1, 1023, "last"), 0));
  EXPECT_THAT(parser->parse(test::vrpn_description(-1, 1024, "beyond"), 0).error().message,
              HasSubstr("describes number 1024; 0 to 1023 are allowed"));
  EXPECT_TRUE(parser->parse(test::vrpn_description(-1, 1, std::string(511, 'n')), 0)) << "with its NUL 512";
  EXPECT_FALSE(parser->parse(test::vrpn_description(-1, 1, std::string(512, 'n')), 0));
  EXPECT_EQ(subjects(parsed(*parser, test::vrpn_pose(1, 1, 3, 0, {1, 2, 3}, {0, 0, 0, 1}))).at(0),
            std::string(64, 'n'))
      << "cut to what a subject may have";
}

}  // namespace
}  // namespace strandcast::live_systems_test
