// What a server believes of samples of head motion. Any thread. Feeds and servers use the same limits, so
// that both can say why a sample is left out.
#pragma once

#include <cstddef>
#include <string>

#include "common/wire/messages.h"

namespace strandcast {

inline constexpr double kMinQuaternionNorm = 0.5, kMaxQuaternionNorm = 2.0;
inline constexpr double kMaxHeadDistanceM = 1e4;
/// What a notice to a source begins with whose samples are left out.
inline constexpr const char* kRefusedSamples = "samples of this source are left out: ";

/// Returns why a pose is no head's, or empty.
std::string refusal_of(const Pose& world_from_head);
/// Returns why a sample is left out, or empty; `joint_count` is that of the names.
std::string refusal_of(const MotionSamples::Sample& sample, size_t joint_count);

}  // namespace strandcast
