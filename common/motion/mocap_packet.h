// Encodes a head as packets of motion capture protocols, for other programs to follow the head, or to
// try a server without a capture system. Pure functions; axes and units are those of each protocol's senders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/timecode.h"
#include "common/math/pose.h"

namespace strandcast {

/// Values from which a packet is made.
struct MocapMoment {
  double time_s = 0.0;
  Pose world_from_head;
  std::optional<glm::vec3> wind_mps = {};  // world; of vmc only
  uint32_t number = 0;                     // of the packet; of opentrackio only
  double rate_hz = 0.0;                    // of packets, 0 = not told; likewise
  uint32_t source = 1;                     // of protocols that number their sources
  std::optional<Timecode> timecode = {};   // of opentrackio, and of freed in its spare word: frames, 16 bits
  std::optional<bool> is_recording = {};   // of opentrackio only
  std::string slate = {};                  // likewise
};

/// A protocol that packets can be made for.
struct MocapEncoding {
  const char* name;
  uint16_t port;  // that servers listen on
  std::vector<std::byte> (*encode)(const MocapMoment&);
  bool numbers_sources = false;  // several heads can go to one address
  bool has_timecode = false;
};

/// Returns the names of all protocols for a person, for example "vmc, freed".
std::string mocap_encoding_names();
/// Finds a protocol; BadInput lists the known ones.
Result<MocapEncoding> find_mocap_encoding(const std::string& name);

}  // namespace strandcast
