// LiveParser: parses the bytes of one live source into poses and wind in Strandcast's world. One parser per
// peer, since it keeps what the peer sent before (bones, names). No socket, clock or policy. Numbers are as
// sent: a pose may hold NaN or a quaternion of any length, so the receiver must check it. One thread at a
// time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "server/input/live/live_packet.h"

namespace strandcast {

/// Largest number of lines of LiveParser::describe(); further lines are counted in the last one.
constexpr size_t kMaxMonitorLines = 64;

/// How packets of a protocol are read; points on which senders and documents disagree are settings.
struct LiveParserConfig {
  std::string protocol;    // a name of live_protocols()
  std::string axis_order;  // one of LiveProtocol::axis_orders; empty = the first; freed: "ORDER/25" where its
                           // spare word counts frames of timecode, as parse_spare_count() reads it
  std::string
      protocol_version;  // natnet: 2.5 to 2.11, 3.0 to 4.1; empty = what the server says, or what fits
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

/// Returns the protocols that have a parser.
std::span<const LiveProtocol> live_protocols();

class LiveParser {
 public:
  virtual ~LiveParser() = default;

  /// Parses a datagram or, over TCP, a chunk as read. An error is one sentence and leaves the parser
  /// unchanged; a TCP connection cannot be used after it. Unknown content is skipped and counted.
  virtual Result<LivePacket> parse(std::span<const std::byte> bytes, int64_t arrival_ns) = 0;
  /// Returns the wish to record that a datagram is, from any sender; such a datagram needs no parse().
  virtual std::optional<LiveTake> take_of(std::span<const std::byte>) const { return std::nullopt; }
  /// Returns why a datagram, from any sender, that is a command and nothing else is none of ours; empty for
  /// all others, which are parsed.
  virtual std::string unknown_command_of(std::span<const std::byte>) const { return {}; }
  /// Returns bytes to send when a connection begins: VRPN's cookie, NatNet's request to be served; empty =
  /// nothing.
  virtual std::vector<std::byte> greeting() const { return {}; }
  /// Returns bytes to send about once a second, so that the peer continues or describes what is unknown yet
  /// (NatNet); empty = nothing.
  virtual std::vector<std::byte> request() const { return {}; }
  /// Returns the number of messages, bundles and descriptions of unknown kinds since the parser was made.
  virtual uint64_t ignored() const = 0;
  /// Describes the last packet for a person: fields and values as sent, at most kMaxMonitorLines.
  virtual std::vector<std::string> describe() const = 0;
  /// Returns sentences for the log since the last call: what the peer does that it should not, each once.
  virtual std::vector<std::string> take_notes() { return {}; }
};

/// Parses how timecode counts: a rate, with "df" behind it for drop-frame, or "nd" or "ndf". Returns its
/// first frame; BadInput says which rates there are.
Result<Timecode> parse_timecode_count(std::string_view text);

/// How the spare word of FreeD counts frames; vendors differ, and some have the aperture in most of its bits.
struct SpareCount {
  Timecode begin;
  uint32_t first_bit = 0;  // from the lowest
  uint32_t bits = 16;
};
/// Parses "25", where the whole word counts, or "25:12-15" for some bits of it. BadInput says what is wrong.
Result<SpareCount> parse_spare_count(std::string_view text);

/// Makes a parser. NotFound lists the known protocols, axis orders or versions.
Result<std::unique_ptr<LiveParser>> make_live_parser(const LiveParserConfig& config);

}  // namespace strandcast
