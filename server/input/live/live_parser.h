// LiveParser: the bytes of one live source into poses and wind of Strandcast's world. One parser per peer: it
// keeps what a peer said before (bones, names). No socket, no clock, no policy: numbers are as sent, so that
// a pose may hold NaN or a quaternion of any length, and whoever takes it has to look. One thread at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/input/live/live_packet.h"

namespace strandcast {

/// Lines of LiveParser::describe; what is beyond is counted in the last of them.
constexpr size_t kMaxMonitorLines = 64;

/// How a protocol's packets are read; what senders and documents disagree about is a setting.
struct LiveParserConfig {
  std::string protocol;          // a name of live_protocols()
  std::string axis_order;        // one of LiveProtocol::axis_orders; empty = the first
  std::string protocol_version;  // natnet: 3.0, 3.1, 4.0 or 4.1; empty = what the server says, or what fits
  bool ignores_zero_positions = true;  // vmc: bones whose position is zero keep the bind offset
  uint32_t max_datagram_bytes = 1500;  // vmc: OSC beyond it is refused
};

enum class LiveTransport { Udp, Tcp };

/// A row of the table of protocols.
struct LiveProtocol {
  const char* name;
  const char* summary;  // for people
  LiveTransport transport;
  uint16_t default_port;  // where data come in, or (Tcp) where the peer listens
  uint16_t request_port;  // Udp: of the peer, where greeting() and request() go; 0 = there are none
  std::vector<const char*> axis_orders;  // how its numbers may be meant, the usual one first; may be empty
  const char* multicast_group;           // "" = none
};

/// Every protocol there is a parser for.
std::span<const LiveProtocol> live_protocols();

class LiveParser {
 public:
  virtual ~LiveParser() = default;

  /// What one datagram says or, over TCP, one chunk as read. An error is one sentence and leaves the parser
  /// as it was; over TCP the connection is of no use afterwards. What is not known is left out and counted.
  virtual Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t arrival_ns) = 0;
  /// To be sent to the peer when a connection begins: VRPN's cookie, NatNet's wish to be served; empty =
  /// nothing.
  virtual std::vector<std::byte> greeting() const { return {}; }
  /// To be sent to the peer about once a second, so that it goes on, or says what is not known yet (NatNet);
  /// empty = nothing.
  virtual std::vector<std::byte> request() const { return {}; }
  /// Messages, bundles and descriptions of kinds that are not known, since the parser was made.
  virtual uint64_t ignored() const = 0;
  /// What the last packet held, for a person: fields and values as they were sent, at most kMaxMonitorLines.
  virtual std::vector<std::string> describe() const = 0;
};

/// A parser that has seen nothing yet. NotFound names the protocols, orders or versions that there are.
Result<std::unique_ptr<LiveParser>> make_live_parser(const LiveParserConfig& config);

}  // namespace strandcast
