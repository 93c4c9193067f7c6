// What a pose of a live source looks like from outside: where the face looks, where the crown points.
#pragma once

#include <gtest/gtest.h>

#include "server/input/live/live_packet.h"

namespace strandcast::test {

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
