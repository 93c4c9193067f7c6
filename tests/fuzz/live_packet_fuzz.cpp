// libFuzzer entry: packets of the live protocols that are not OSC; over TCP the stream in pieces of any size
// too.
#include "common/motion/opentrackio.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/live_checks.h"

namespace strandcast::live_packet_fuzz {
namespace {

constexpr const char* kProtocols[] = {"opentrack",    "freed",       "natnet", "vrpn",
                                      "livelinkface", "opentrackio", "mvn"};
constexpr const char* kVersions[] = {"", "3.0", "4.0", "4.1", "2.5", "2.9"};

/// A stream says the same however it is cut, unless a piece was refused.
void check_cuts(const LiveParserConfig& config, std::span<const std::byte> stream, size_t piece) {
  const auto whole = make_live_parser(config).value();
  const auto in_pieces = make_live_parser(config).value();
  const auto packet = whole->parse(stream, 0);
  std::vector<LivePose> poses;
  bool is_taken = true;
  for (size_t begin = 0; is_taken && begin < stream.size(); begin += piece) {
    const auto part = in_pieces->parse(stream.subspan(begin, std::min(piece, stream.size() - begin)), 0);
    is_taken = part.ok();
    if (part) poses.insert(poses.end(), part->poses.begin(), part->poses.end());
  }
  CHECK(is_taken == packet.ok());
  if (!packet) return;
  CHECK(poses.size() == packet->poses.size());
  for (size_t i = 0; i < poses.size(); ++i) CHECK(is_same(poses[i], packet->poses[i]));
}

/// With the checksum that it should have, so that documents are reached.
std::span<const std::byte> with_checksum(std::vector<std::byte>& packet) {
  if (packet.size() < kTrackHeaderBytes) return packet;
  const size_t length = (packet.size() - kTrackHeaderBytes) & kMaxTrackPayloadBytes;
  packet[12] = (packet[12] & std::byte{0x80}) | static_cast<std::byte>(length >> 8);
  packet[13] = static_cast<std::byte>(length & 0xFF);
  const uint16_t sum = fletcher16(std::span(packet).first(14), std::span(packet).subspan(kTrackHeaderBytes));
  packet[14] = static_cast<std::byte>(sum >> 8);
  packet[15] = static_cast<std::byte>(sum & 0xFF);
  return packet;
}

}  // namespace

extern "C" int FUZZ_ENTRY(live_packet)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  LiveParserConfig config;
  config.protocol = kProtocols[input.take<uint8_t>() % std::size(kProtocols)];
  const auto settings = input.take<uint8_t>();
  for (const LiveProtocol& protocol : live_protocols())
    if (protocol.name == config.protocol && !protocol.axis_orders.empty())
      config.axis_order = protocol.axis_orders[settings & 1];
  if (config.protocol == "freed" && (settings & 2) != 0) config.axis_order += "/29.97df";
  config.protocol_version = kVersions[(settings >> 1) % std::size(kVersions)];
  LiveParserPair parsers(config);
  while (!input.is_empty()) {
    auto piece = input.take_piece();
    std::vector<std::byte> summed(piece.begin(), piece.end());
    if (config.protocol == "opentrackio" && (settings & 2) != 0) piece = with_checksum(summed);
    parsers.parse(piece);
    if (config.protocol == "vrpn") check_cuts(config, piece, 1 + (settings >> 3));
  }
  return 0;
}

}  // namespace strandcast::live_packet_fuzz
