// The lattice of poses of a head: coordinates and parts of a rotation are whole steps of 2^-32 (m), 0.2 nm.
// Differences of such poses take few bytes and lose nothing. Pure functions, any thread.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/math/pose.h"

namespace strandcast {

inline constexpr double kPoseStepsPerUnit = 4294967296.0;

/// A pose in steps of the lattice: x, y, z of the position; w, x, y, z of the rotation.
using PoseSteps = std::array<int64_t, 7>;

/// Returns the nearest pose of the lattice; what is no number or beyond 1e9 m stays.
Pose rounded_pose(const Pose& pose);
/// Returns the steps of a pose; nothing unless pose_of() gives the same bits back.
std::optional<PoseSteps> pose_steps(const Pose& pose);
Pose pose_of(const PoseSteps& steps);

}  // namespace strandcast
