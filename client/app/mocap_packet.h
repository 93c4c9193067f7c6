// A head as packets of motion capture: what a stage's program would send, for trying a server without one.
// Pure functions; axes and units of each protocol as its senders have them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/math/pose.h"

namespace strandcast {

/// What a packet is made of.
struct MocapMoment {
  double time_s = 0.0;
  Pose world_from_head;
  std::optional<glm::vec3> wind_mps = {};  // world; of vmc only
};

/// A protocol that packets can be made of.
struct MocapEncoding {
  const char* name;
  uint16_t port;  // that servers listen on
  std::vector<std::byte> (*encode)(const MocapMoment&);
};

/// BadInput names those there are.
Result<MocapEncoding> find_mocap_encoding(const std::string& name);

}  // namespace strandcast
