#include "common/motion/opentrackio.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include "common/base/check.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr std::string_view kIdentifier = "OTrk";
constexpr size_t kChecksumAt = kTrackHeaderBytes - 2;
constexpr uint32_t kLastFlag = 0x8000;

uint32_t take_big_endian(std::span<const std::byte> bytes) {
  uint32_t number = 0;
  for (const std::byte byte : bytes) number = number << 8 | std::to_integer<uint32_t>(byte);
  return number;
}
void put_track_number(std::vector<std::byte>& bytes, uint32_t number, int count) {
  while (count-- > 0) bytes.push_back(static_cast<std::byte>(number >> (8 * count)));
}

/// As one of those that the header of opentrackio.h names.
bool has_right_checksum(std::span<const std::byte> packet) {
  const uint32_t sent = take_big_endian(packet.subspan(kChecksumAt, 2));
  const auto payload = packet.subspan(kTrackHeaderBytes);
  for (const auto head : {packet.first(kChecksumAt), packet.first(0)})
    for (const uint32_t modulus : {255u, 256u})
      if (fletcher16(head, payload, modulus) == sent) return true;
  return false;
}

ValueTree map_of(ValueTree::Map map) {
  return {std::move(map)};
}

/// A rate as OpenTrackIO tells it: of whole numbers.
ValueTree rational_of(double rate_hz) {
  constexpr int64_t kDenominator = 1000;
  const auto thousandths = static_cast<int64_t>(std::llround(rate_hz * kDenominator));
  const int64_t common = std::max<int64_t>(std::gcd(thousandths, kDenominator), 1);
  return map_of({{"num", {static_cast<double>(thousandths / common)}},
                 {"denom", {static_cast<double>(kDenominator / common)}}});
}

}  // namespace

uint16_t fletcher16(std::span<const std::byte> begin, std::span<const std::byte> end, uint32_t modulus) {
  uint32_t sum = 0, sum_of_sums = 0;
  for (const auto bytes : {begin, end})
    for (const std::byte byte : bytes) {
      sum = (sum + std::to_integer<uint32_t>(byte)) % modulus;
      sum_of_sums = (sum_of_sums + sum) % modulus;
    }
  return static_cast<uint16_t>(sum_of_sums << 8 | sum);
}

Result<TrackSegment> read_track_segment(std::span<const std::byte> packet) {
  const auto is_letter = [](std::byte byte, char letter) { return byte == static_cast<std::byte>(letter); };
  if (packet.size() < kTrackHeaderBytes ||
      !std::equal(kIdentifier.begin(), kIdentifier.end(), packet.begin(),
                  [&](char letter, std::byte byte) { return is_letter(byte, letter); }))
    return make_error(
        ErrorCode::BadInput,
        "a packet of OpenTrackIO begins with \"OTrk\" and a header of {} bytes, this one has {}",
        kTrackHeaderBytes, packet.size());
  TrackSegment segment;
  segment.encoding = std::to_integer<uint8_t>(packet[5]);
  segment.sequence = static_cast<uint16_t>(take_big_endian(packet.subspan(6, 2)));
  segment.offset = take_big_endian(packet.subspan(8, 4));
  const uint32_t length = take_big_endian(packet.subspan(12, 2));
  segment.is_last = (length & kLastFlag) != 0;
  segment.payload = packet.subspan(kTrackHeaderBytes);
  if ((length & ~kLastFlag) != segment.payload.size())
    return make_error(ErrorCode::BadInput, "a packet of OpenTrackIO says that it has {} bytes and has {}",
                      length & ~kLastFlag, segment.payload.size());
  if (!has_right_checksum(packet))
    return make_error(ErrorCode::BadInput, "a packet of OpenTrackIO with the wrong checksum: {:#06x}",
                      take_big_endian(packet.subspan(kChecksumAt, 2)));
  return segment;
}

std::vector<std::byte> write_track_segment(const TrackSegment& segment) {
  CHECK(segment.payload.size() <= kMaxTrackPayloadBytes);
  std::vector<std::byte> packet;
  packet.reserve(kTrackHeaderBytes + segment.payload.size());
  for (const char letter : kIdentifier) packet.push_back(static_cast<std::byte>(letter));
  put_track_number(packet, 0, 1);
  put_track_number(packet, segment.encoding, 1);
  put_track_number(packet, segment.sequence, 2);
  put_track_number(packet, segment.offset, 4);
  put_track_number(packet, static_cast<uint32_t>(segment.payload.size()) | (segment.is_last ? kLastFlag : 0u),
                   2);
  put_track_number(packet, 0, 2);
  packet.insert(packet.end(), segment.payload.begin(), segment.payload.end());
  const uint16_t checksum = fletcher16(std::span(packet).first(kChecksumAt), segment.payload);
  packet[kChecksumAt] = static_cast<std::byte>(checksum >> 8);
  packet[kChecksumAt + 1] = static_cast<std::byte>(checksum & 0xFF);
  return packet;
}

ValueTree make_track_document(const TrackSample& sample) {
  const double whole_s = std::floor(sample.time_s);
  ValueTree::Map timing = {
      {"mode", {std::string("internal")}},
      {"sampleTimestamp",
       map_of({{"seconds", {whole_s}}, {"nanoseconds", {std::floor((sample.time_s - whole_s) * kNsPerS)}}})},
      {"sequenceNumber", {static_cast<double>(sample.number & 0xFFFF)}}};
  if (sample.rate_hz > 0.0) timing.emplace_back("sampleRate", rational_of(sample.rate_hz));
  const auto& p = sample.translation_m;
  const auto& r = sample.pan_tilt_roll_deg;
  ValueTree head = map_of({{"translation", map_of({{"x", {p[0]}}, {"y", {p[1]}}, {"z", {p[2]}}})},
                           {"rotation", map_of({{"pan", {r[0]}}, {"tilt", {r[1]}}, {"roll", {r[2]}}})},
                           {"id", {std::string("head")}}});
  return map_of({{"protocol", map_of({{"name", {std::string("OpenTrackIO")}},
                                      {"version", {ValueTree::List{{1.0}, {0.0}, {1.0}}}}})},
                 {"sourceNumber", {static_cast<double>(sample.source)}},
                 {"tracker", map_of({{"status", {std::string("head of Strandcast")}}})},
                 {"timing", map_of(std::move(timing))},
                 {"transforms", {ValueTree::List{std::move(head)}}}});
}

}  // namespace strandcast
