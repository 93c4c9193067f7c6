// Parsers of live protocols in tests, and what a pose of theirs looks like from outside: where the face
// looks, where the crown points.
#pragma once

#include <gtest/gtest.h>

#include "server/input/live/live_parser.h"

namespace strandcast::test {

inline std::unique_ptr<LiveParser> live_parser_of(const std::string& protocol,
                                                  const std::string& axis_order = "",
                                                  const std::string& version = "") {
  LiveParserConfig config;
  config.protocol = protocol;
  config.axis_order = axis_order;
  config.protocol_version = version;
  auto parser = make_live_parser(config);
  EXPECT_TRUE(parser) << parser.error().to_string();
  return std::move(*parser);
}

/// What bytes say that have to be right.
inline LivePacket parsed(LiveParser& parser, std::span<const std::byte> bytes) {
  auto packet = parser.parse(bytes, 0);
  EXPECT_TRUE(packet) << packet.error().to_string();
  return packet ? std::move(*packet) : LivePacket{};
}

/// Floats on the wire leave this much, m or as a share of one.
constexpr double kLivePoseTolerance = 2e-6;

inline testing::AssertionResult is_near(const glm::dvec3& found, const glm::dvec3& expected) {
  if (glm::length(found - expected) <= kLivePoseTolerance) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "(" << found.x << ", " << found.y << ", " << found.z
                                     << ") instead of (" << expected.x << ", " << expected.y << ", "
                                     << expected.z << ")";
}

inline glm::dvec3 face_of(const LivePose& pose) {
  return pose.world_from_subject.rotation * glm::dvec3(0.0, 0.0, 1.0);
}
inline testing::AssertionResult looks_along(const LivePose& pose, const glm::dvec3& direction) {
  return is_near(face_of(pose), direction);
}
inline testing::AssertionResult has_crown_along(const LivePose& pose, const glm::dvec3& direction) {
  return is_near(pose.world_from_subject.rotation * glm::dvec3(0.0, 1.0, 0.0), direction);
}

}  // namespace strandcast::test
