// OpenTrackIO: packets are written here by hand, from the published description, in its axes and units.
#include <gmock/gmock.h>

#include <cmath>

#include "common/motion/mocap_packet.h"
#include "common/motion/opentrackio.h"
#include "server/input/live/live_parser.h"
#include "tests/support/live_packets.h"
#include "tests/support/live_poses.h"

namespace strandcast::live_opentrackio_test {
namespace {

using test::live_parser_of;
using test::opentrackio;
using test::PacketBytes;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

PacketBytes packet_of(std::initializer_list<int> numbers) {
  PacketBytes bytes;
  for (const int number : numbers) bytes.push_back(static_cast<std::byte>(number));
  return bytes;
}
LivePose only_pose(LiveParser& parser, const PacketBytes& bytes) {
  LivePacket packet = test::parsed(parser, bytes);
  EXPECT_EQ(packet.poses.size(), 1u);
  return packet.poses.size() == 1 ? packet.poses[0] : LivePose{};
}
std::string transform(const std::string& translation, const std::string& rotation) {
  return "{\"translation\":" + translation + ",\"rotation\":" + rotation + "}";
}
std::string sample(const std::string& transforms, const std::string& more = "") {
  return "{\"transforms\":[" + transforms + "]" + more + "}";
}
const std::string kAtRest = "{\"pan\":0,\"tilt\":0,\"roll\":0}";

// An empty document in JSON. The sums modulo 256 after each byte, by hand: 79 163 21 128 128 129 129 134 134
// 134 134 134 6 8 131 0, and their own: 79 242 7 135 7 136 9 143 21 155 33 167 173 181 56 56.
TEST(OpenTrackIo, APacketHasTheBytesOfItsDescription) {
  const PacketBytes by_hand =
      packet_of({'O', 'T', 'r', 'k', 0, 1, 0, 5, 0, 0, 0, 0, 0x80, 2, 56, 0, '{', '}'});
  TrackSegment segment;
  segment.encoding = 1;
  segment.sequence = 5;
  segment.payload = std::span(by_hand).subspan(kTrackHeaderBytes);
  EXPECT_EQ(write_track_segment(segment), by_hand);
  const auto read = read_track_segment(by_hand);
  ASSERT_TRUE(read) << read.error().to_string();
  EXPECT_EQ(read->sequence, 5u);
  EXPECT_TRUE(read->is_last);
  for (size_t i = 0; i < by_hand.size(); ++i) {
    PacketBytes wrong = by_hand;
    wrong[i] ^= std::byte{0x04};
    EXPECT_FALSE(read_track_segment(wrong)) << i;
    EXPECT_FALSE(read_track_segment(std::span(by_hand).first(i))) << i;
  }
}

// Version 1.0.0 sums modulo 255, 1.0.1 modulo 256; nobody sums the payload alone, or anything else.
TEST(OpenTrackIo, ChecksumsOfBothVersionsAreRead) {
  const std::string json = sample(transform("{\"x\":1,\"y\":2,\"z\":3}", kAtRest));
  for (const uint32_t modulus : {255u, 256u})
    EXPECT_TRUE(read_track_segment(opentrackio(json, {.modulus = modulus}))) << modulus;
  EXPECT_FALSE(read_track_segment(opentrackio(json, {.modulus = 254})));
}

// +Z is up and a camera at rest looks along +Y, so +X is to its right. Pan turns about +Z to the left, tilt
// about +X up, roll about +Y to the right.
TEST(OpenTrackIo, TurnsACameraAsItsAxesSay) {
  const auto parser = live_parser_of("opentrackio");
  const auto turned = [&](const std::string& rotation) {
    return only_pose(*parser, opentrackio(sample(transform("{\"x\":1,\"y\":2,\"z\":1.5}", rotation))));
  };
  const LivePose left = turned("{\"pan\":90,\"tilt\":0,\"roll\":0}");
  EXPECT_TRUE(test::is_near(left.world_from_subject.position_m, {-1, 1.5, 2}));
  EXPECT_TRUE(test::looks_along(left, {1, 0, 0}));
  EXPECT_TRUE(test::looks_along(turned("{\"pan\":0,\"tilt\":90,\"roll\":0}"), {0, 1, 0}));
  EXPECT_TRUE(test::has_crown_along(turned("{\"pan\":0,\"tilt\":0,\"roll\":90}"), {-1, 0, 0}));
  // To the left and then up about its own ears: it looks up, and its crown points to where its back was.
  const LivePose both = turned("{\"pan\":90,\"tilt\":90,\"roll\":0}");
  EXPECT_TRUE(test::looks_along(both, {0, 1, 0}));
  EXPECT_TRUE(test::has_crown_along(both, {-1, 0, 0}));
  const auto other = live_parser_of("opentrackio", "pan-right");
  EXPECT_TRUE(test::looks_along(
      only_pose(*other, opentrackio(sample(
                            transform("{\"x\":0,\"y\":0,\"z\":0}", "{\"pan\":90,\"tilt\":0,\"roll\":0}")))),
      {-1, 0, 0}));
}

// A dolly two metres ahead that is turned to the left, with a crane one metre ahead of it: one metre to the
// left of the dolly. In the other order the crane would be in line with both.
TEST(OpenTrackIo, TransformsAreAppliedInOrder) {
  const auto parser = live_parser_of("opentrackio");
  const std::string turn = "{\"pan\":90,\"tilt\":0,\"roll\":0}";
  const std::string dolly = transform("{\"x\":0,\"y\":2,\"z\":0}", turn);
  const std::string crane = transform("{\"x\":0,\"y\":1,\"z\":0}", kAtRest);
  const LivePose chained = only_pose(*parser, opentrackio(sample(dolly + "," + crane)));
  EXPECT_TRUE(test::is_near(chained.world_from_subject.position_m, {1, 0, 2}));
  EXPECT_TRUE(test::looks_along(chained, {1, 0, 0}));
  const LivePose swapped = only_pose(*parser, opentrackio(sample(crane + "," + dolly)));
  EXPECT_TRUE(test::is_near(swapped.world_from_subject.position_m, {0, 0, 3}));
  const LivePose still = only_pose(*parser, opentrackio(sample("{\"rotation\":" + turn + "}")));
  EXPECT_FALSE(still.has_position);
}

TEST(OpenTrackIo, TellsWhoWhenAndWhatTheTrackerDoes) {
  const auto parser = live_parser_of("opentrackio");
  const std::string head = transform("{\"x\":0,\"y\":0,\"z\":0}", kAtRest);
  const std::string timing =
      ",\"timing\":{\"sequenceNumber\":7,\"sampleRate\":{\"num\":30000,\"denom\":1001},"
      "\"timecode\":{\"hours\":1,\"minutes\":2,\"seconds\":3,\"frames\":4}";
  const std::string rest =
      "},\"sourceNumber\":3,\"tracker\":{\"recording\":true,\"slate\":\"A101\",\"status\":\"good\"}";
  const LivePose pose = only_pose(
      *parser, opentrackio(sample(
                   head, timing + ",\"sampleTimestamp\":{\"seconds\":12,\"nanoseconds\":500000000}" + rest)));
  EXPECT_EQ(pose.subject, "3");
  EXPECT_EQ(pose.frame, 7u);
  EXPECT_EQ(pose.source_time_ns, 12'500'000'000);
  EXPECT_EQ(pose.timecode, make_timecode({1, 2, 3, 4}, {30'000, 1001}, false).value())
      << "at the samples' rate";
  EXPECT_THAT(parser->describe(), ElementsAre("source 3", HasSubstr("pan 0.000"), HasSubstr("x 0.0000"),
                                              "sample 7", "29.970 samples a second", "timecode 01:02:03:04",
                                              "records", "slate A101", "status good"));
  // Without a time, the number over the rate: 7 x 1001 / 30000 s.
  EXPECT_EQ(only_pose(*parser, opentrackio(sample(head, timing + rest))).source_time_ns, 233'566'667);
}

TEST(OpenTrackIo, AFlagThatChangesIsAWishToRecord) {
  const auto parser = live_parser_of("opentrackio");
  const std::string head = transform("{\"x\":0,\"y\":0,\"z\":0}", kAtRest);
  const auto wish_of = [&](const std::string& tracker) {
    const auto packet = parser->parse(opentrackio(sample(head, tracker)), 0);
    EXPECT_TRUE(packet);
    return packet ? packet->take : std::nullopt;
  };
  EXPECT_FALSE(wish_of(""));
  EXPECT_FALSE(wish_of(",\"tracker\":{\"recording\":false}"));
  const auto begun = wish_of(",\"tracker\":{\"recording\":true,\"slate\":\"A101\"}");
  ASSERT_TRUE(begun);
  EXPECT_TRUE(begun->is_wanted);
  EXPECT_EQ(begun->slate, "A101");
  EXPECT_FALSE(wish_of(",\"tracker\":{\"recording\":true,\"slate\":\"A101\"}")) << "each is told once";
  EXPECT_FALSE(wish_of("")) << "a sample that does not say it changes nothing";
  const auto ended = wish_of(",\"tracker\":{\"recording\":false}");
  ASSERT_TRUE(ended);
  EXPECT_FALSE(ended->is_wanted);
}

TEST(OpenTrackIo, TimecodesHaveARateOfTheirOwn) {
  const auto parser = live_parser_of("opentrackio");
  const auto told = [&](const std::string& fields) {
    return only_pose(*parser, opentrackio(sample(
                                  transform("{\"x\":0,\"y\":0,\"z\":0}", kAtRest),
                                  ",\"timing\":{\"sampleRate\":{\"num\":240,\"denom\":1},\"timecode\":{" +
                                      fields + "}}")))
        .timecode;
  };
  const std::string drop = "\"frameRate\":{\"num\":60000,\"denom\":2002},\"dropFrame\":true";
  const std::string at = "\"hours\":10,\"minutes\":1,\"seconds\":0,\"frames\":";
  EXPECT_EQ(told(at + "2," + drop), make_timecode({10, 1, 0, 2}, {30'000, 1001}, true).value());
  EXPECT_THAT(parser->describe(), Contains("timecode 10:01:00;02"));
  EXPECT_EQ(told(at + "4,\"format\":{\"frameRate\":{\"num\":25,\"denom\":1}}"),
            make_timecode({10, 1, 0, 4}, {25, 1}, false).value())
      << "as it was before version 1.0";
  EXPECT_FALSE(told(at + "1," + drop)) << "a number that is left out";
  EXPECT_FALSE(told(at + "1")) << "no timecode counts 240 frames a second";
  EXPECT_FALSE(told(at + "1.5," + drop));
  EXPECT_FALSE(told("\"hours\":10," + drop));
}

TEST(OpenTrackIo, AClockThatRunsFreeIsSaidOnce) {
  const auto parser = live_parser_of("opentrackio");
  const auto notes_of = [&](const std::string& fields) {
    (void)only_pose(*parser, opentrackio(sample(transform("{\"x\":0,\"y\":0,\"z\":0}", kAtRest),
                                                ",\"timing\":{\"synchronization\":{" + fields + "}}")));
    return parser->take_notes();
  };
  EXPECT_THAT(notes_of("\"locked\":true,\"source\":\"ptp\""), IsEmpty());
  EXPECT_THAT(parser->describe(), Contains("locked to ptp"));
  EXPECT_THAT(notes_of("\"locked\":false,\"source\":\"ptp\""),
              ElementsAre("the tracker is not locked to ptp"));
  EXPECT_THAT(notes_of("\"locked\":false,\"source\":\"ptp\""), IsEmpty());
  EXPECT_THAT(notes_of(""), IsEmpty());
  EXPECT_THAT(notes_of("\"locked\":true,\"source\":\"ptp\""),
              ElementsAre("the tracker is locked again to ptp"));
}

TEST(OpenTrackIo, NumbersGoOnWhereSixteenBitsBeginAnew) {
  const auto parser = live_parser_of("opentrackio");
  const auto frame_of = [&](uint32_t number) {
    return only_pose(*parser,
                     opentrackio(sample(transform("{\"x\":0,\"y\":0,\"z\":0}", kAtRest),
                                        ",\"timing\":{\"sequenceNumber\":" + std::to_string(number) + "}")))
        .frame;
  };
  EXPECT_EQ(frame_of(65'534), 65'534u);
  EXPECT_EQ(frame_of(65'535), 65'535u);
  EXPECT_EQ(frame_of(1), 65'537u);
  EXPECT_EQ(frame_of(0), 65'536u) << "one that was late";
  EXPECT_EQ(frame_of(70'000), 70'000u) << "one that counts further";
}

/// A document in pieces of `piece` bytes; senders number segments (`step` 1) or samples (0).
std::vector<PacketBytes> in_segments(const std::string& json, size_t piece, uint16_t first, uint16_t step) {
  std::vector<PacketBytes> packets;
  for (size_t at = 0; at < json.size(); at += piece) {
    const auto number = static_cast<uint16_t>(first + step * (at / piece));
    packets.push_back(opentrackio(
        json.substr(at, piece),
        {.sequence = number, .offset = static_cast<uint32_t>(at), .is_last = at + piece >= json.size()}));
  }
  return packets;
}

TEST(OpenTrackIo, SegmentsArePutTogether) {
  const std::string json = sample(transform("{\"x\":1,\"y\":2,\"z\":3}", kAtRest));
  for (const uint16_t step : {uint16_t{0}, uint16_t{1}}) {
    const auto parser = live_parser_of("opentrackio");
    const auto packets = in_segments(json, 20, 65'534, step);
    ASSERT_GT(packets.size(), 3u);
    for (size_t i = 0; i + 1 < packets.size(); ++i) {
      EXPECT_THAT(test::parsed(*parser, packets[i]).poses, IsEmpty());
      EXPECT_THAT(test::parsed(*parser, packets[i]).poses, IsEmpty()) << "it came twice";
    }
    EXPECT_TRUE(test::is_near(only_pose(*parser, packets.back()).world_from_subject.position_m, {-1, 3, 2}));
    EXPECT_EQ(parser->ignored(), 0u);
    // One is missing: the sample is dropped, and the next is whole.
    for (size_t i = 0; i < packets.size(); ++i)
      if (i != 1) {
        EXPECT_THAT(test::parsed(*parser, packets[i]).poses, IsEmpty());
      }
    EXPECT_GT(parser->ignored(), 0u);
    for (size_t i = 0; i + 1 < packets.size(); ++i) (void)test::parsed(*parser, packets[i]);
    (void)only_pose(*parser, packets.back());
  }
}

TEST(OpenTrackIo, SegmentsAreBounded) {
  const auto parser = live_parser_of("opentrackio");
  const std::string piece(32'000, ' ');
  EXPECT_TRUE(parser->parse(opentrackio(piece, {.is_last = false}), 0));
  EXPECT_TRUE(parser->parse(opentrackio(piece, {.offset = 32'000, .is_last = false}), 0));
  const auto refused = parser->parse(opentrackio(piece, {.offset = 64'000, .is_last = false}), 0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::LimitExceeded);
}

TEST(OpenTrackIo, SaysWhatIsWrong) {
  const auto parser = live_parser_of("opentrackio");
  EXPECT_THAT(parser->parse(opentrackio("{\"a\":"), 0).error().to_string(), HasSubstr("JSON, byte 5"));
  EXPECT_THAT(parser->parse(opentrackio("{}", {.encoding = 2}), 0).error().to_string(), HasSubstr("CBOR"));
  EXPECT_THAT(parser->parse(opentrackio("{}", {.encoding = 3}), 0).error().to_string(),
              HasSubstr("no encoding 3"));
  EXPECT_TRUE(parser->parse(opentrackio("{}", {.encoding = 0x80}), 0)) << "a vendor's";
  EXPECT_TRUE(parser->parse(opentrackio("{\"lens\":{}}"), 0)) << "no head in it";
  EXPECT_EQ(parser->ignored(), 2u);
  const LivePose pose = only_pose(*parser, opentrackio(sample(transform("{\"x\":1}", kAtRest))));
  EXPECT_FALSE(is_finite(pose.world_from_subject)) << "a place that is not told whole";
  EXPECT_THAT(parser->describe(), Contains(HasSubstr("nan")));
}

/// JSON and CBOR say the same, to the last bit, and so does the head that was sent.
TEST(OpenTrackIo, WhatIsSentComesBack) {
  const auto of_json = live_parser_of("opentrackio"), of_cbor = live_parser_of("opentrackio");
  const auto json = find_mocap_encoding("opentrackio"), cbor = find_mocap_encoding("opentrackio-cbor");
  ASSERT_TRUE(json && cbor);
  for (uint32_t i = 0; i < 50; ++i) {
    const glm::dquat turn = glm::angleAxis(0.1 * i, glm::dvec3(0, 1, 0)) *
                            glm::angleAxis(0.9 * std::sin(i), glm::dvec3(1, 0, 0)) *
                            glm::angleAxis(0.5 * std::cos(i), glm::dvec3(0, 0, 1));
    const MocapMoment moment{0.01 * i, {{0.1 * i, 1.6, -0.2}, turn}, {}, i, 59.94, 4};
    const LivePose a = only_pose(*of_json, json->encode(moment)),
                   b = only_pose(*of_cbor, cbor->encode(moment));
    EXPECT_EQ(a.world_from_subject, b.world_from_subject);
    EXPECT_TRUE(test::is_near(a.world_from_subject.position_m, moment.world_from_head.position_m));
    EXPECT_LT(angle_between_rad(a.world_from_subject.rotation, turn), 2e-6);
    EXPECT_EQ(a.subject, "4");
    EXPECT_EQ(a.frame, i);
    ASSERT_TRUE(a.source_time_ns);
    EXPECT_NEAR(static_cast<double>(*a.source_time_ns), 1e7 * i, 1.0);
  }
  EXPECT_THAT(of_cbor->describe(), Contains("59.940 samples a second"));
}

/// Timecode, recording and slate, of all rates; a datagram of one Ethernet frame has room for all of it.
TEST(OpenTrackIo, WhatIsSentTellsTimecodeAndTake) {
  constexpr size_t kEthernetPayload = 1472;
  for (const char* count : {"23.976", "24", "25", "29.97", "29.97df", "30", "50", "59.94df", "60"}) {
    SCOPED_TRACE(count);
    const auto parser = live_parser_of("opentrackio");
    MocapMoment moment{1.7e9, {{-1.23456789012345, 1.6, -0.2}, {}}, {}, 70'000, 60'000.0 / 1001.0, 200};
    moment.timecode = advanced(parse_timecode_count(count).value(), 1e6);
    moment.is_recording = true;
    moment.slate = std::string(60, 'A');
    const PacketBytes packet = find_mocap_encoding("opentrackio")->encode(moment);
    EXPECT_LT(packet.size(), kEthernetPayload);
    const LivePacket read = test::parsed(*parser, packet);
    ASSERT_EQ(read.poses.size(), 1u);
    EXPECT_EQ(read.poses[0].timecode, moment.timecode);
    ASSERT_TRUE(read.take);
    EXPECT_EQ(read.take->slate, moment.slate);
    const std::string text(reinterpret_cast<const char*>(packet.data()), packet.size());
    EXPECT_THAT(text, HasSubstr("\"sampleRate\":{\"num\":60000,\"denom\":1001}"));
    // What the flag was is known from here on.
    moment.is_recording = false;
    const auto ended = test::parsed(*parser, find_mocap_encoding("opentrackio")->encode(moment)).take;
    EXPECT_TRUE(ended && !ended->is_wanted);
  }
}

}  // namespace
}  // namespace strandcast::live_opentrackio_test
