// WebSocket close codes of the protocol, by which a client decides whether to reconnect. Meanings:
// proto/WIRE.md.
#pragma once

#include <cstdint>

namespace strandcast {

enum class CloseCode : uint16_t {
  Normal = 1000,
  GoingAway = 1001,     // the server stops: try again
  BadData = 1007,       // malformed message
  Policy = 1008,        // wrong order, or too many messages
  TooBig = 1009,        // message above kMaxControlBytes
  Internal = 1011,      // ours: please report
  TryLater = 1013,      // what it wants cannot be had now, or it reads too slowly
  Unauthorized = 4001,  // token refused: do not try again
  Kicked = 4002,        // by an admin: do not try again
  Full = 4003,          // no place for another session: try again
  Refused = 4004,       // a role that its token is not good for, or a ring of relays: do not try again
  NotFound = 4005,      // no head of this name: a newcomer does not try again
};

}  // namespace strandcast
