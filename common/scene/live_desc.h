// LiveDesc: one live motion capture input of a scene: a port that senders of a protocol use, or a peer that
// is asked. Plain data, any thread. server/input/live/live_parser.h checks the names of protocols and data
// meanings.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace strandcast {

inline constexpr size_t kMaxLiveInputs = 4;
inline constexpr double kMinLiveScale = 1e-3, kMaxLiveScale = 1e3;

struct LiveDesc {
  std::string protocol = {};  // by its name, such as "vmc"
  std::string host = {};      // whom to ask (vrpn, natnet), or the multicast group; empty: whoever sends here
  uint32_t port = 0;          // 0 = the protocol's own
  std::string subject = {};   // that drives the head; empty: one named head, else the first one seen
  std::string axes = {};      // how numbers are meant where senders disagree; empty: as most mean them
  std::string version = {};   // of the protocol, where that is not told (natnet); empty: as it looks
  bool takes_zero_positions = false;   // a bone at 0 is there; false: its sender leaves places out (vmc)
  bool turns_only = false;             // the head turns where it is and does not move
  double delay_ms = 0.0;               // the head is shown so much later, between samples, not at the newest
  uint32_t max_datagram_bytes = 1500;  // longer OSC is refused
  double scale = 1.0;                  // places times this, for senders of another unit or size

  bool operator==(const LiveDesc&) const = default;
};

}  // namespace strandcast
