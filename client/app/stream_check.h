// Checks a running server as its viewers see it: decodes a number of frames with one viewer, joins a second
// one half way, and compares the state hashes of every tick that both decoded. One thread.
#pragma once

#include <cstdint>
#include <string>

#include "client/net/viewer_client.h"
#include "common/base/result.h"

namespace strandcast {

struct StreamCheck {
  uint64_t decoded_frames = 0;   // by the first viewer
  uint64_t compared_ticks = 0;   // decoded by both
  uint64_t differing_ticks = 0;  // with different hashes
  uint64_t rejected_frames = 0;  // by either
  uint64_t first_differing_tick = 0;

  bool is_good() const { return compared_ticks > 0 && differing_ticks == 0 && rejected_frames == 0; }
  std::string to_string() const;
};

/// Decodes `frames` frames (at least 2). Errors are those of the connection, and Timeout when `timeout_s`
/// passes first.
Result<StreamCheck> check_stream(const ClientConfig& config, uint64_t frames, double timeout_s);

}  // namespace strandcast
