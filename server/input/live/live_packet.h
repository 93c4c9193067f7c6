// LivePacket: content of one packet of a live source, independent of its protocol: poses and wind in
// Strandcast's world. Plain data.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/timecode.h"
#include "common/math/pose.h"

namespace strandcast {

/// Pose of one subject: a rigid body, a performer's head or a tracker.
struct LivePose {
  std::string subject;                    // as its sender names it; empty where a protocol has only one
  Pose world_from_subject;                // right-handed, +Y up, m
  bool has_position = true;               // false: the sender tells how it is turned, not where it is
  std::optional<int64_t> source_time_ns;  // of the sender's clock
  std::optional<uint32_t> frame;          // the sender's number of it, which tells the order; wraps around
  std::optional<Timecode> timecode;       // of the sender's frame
  std::optional<uint64_t> body;           // the sender's number of the subject, which names do not change
  std::vector<std::string> joint_names;   // of the body below a head
  std::vector<glm::dvec3> joint_m;        // of each, in the world
};

/// A sender's wish that a recording begins or ends.
struct LiveTake {
  bool is_wanted = true;
  std::string slate;  // as on the clapperboard; empty = none
  uint32_t take = 0;  // of the slate; 0 = none
};

struct LivePacket {
  std::vector<LivePose> poses;
  std::optional<LiveTake> take;
  std::optional<glm::dvec3> wind_mps;  // in the world
};

}  // namespace strandcast
