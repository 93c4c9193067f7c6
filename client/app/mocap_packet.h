// Encodes a head as packets of motion capture protocols, to try a server without a capture system. Pure
// functions; axes and units are those that each protocol's senders use.
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

/// Values from which a packet is made.
struct MocapMoment {
  double time_s = 0.0;
  Pose world_from_head;
  std::optional<glm::vec3> wind_mps = {};  // world; of vmc only
};

/// A protocol that packets can be made for.
struct MocapEncoding {
  const char* name;
  uint16_t port;  // that servers listen on
  std::vector<std::byte> (*encode)(const MocapMoment&);
};

/// Finds a protocol; BadInput lists the known ones.
Result<MocapEncoding> find_mocap_encoding(const std::string& name);

}  // namespace strandcast
