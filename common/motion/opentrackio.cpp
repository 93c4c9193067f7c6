#include "common/motion/opentrackio.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "common/base/check.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

constexpr std::string_view kIdentifier = "OTrk";
constexpr size_t kChecksumAt = kTrackHeaderBytes - 2;
constexpr uint32_t kLastFlag = 0x8000;
constexpr double kMostTrackRateHz = 1e4;

uint32_t take_big_endian(std::span<const std::byte> bytes) {
  uint32_t number = 0;
  for (const std::byte byte : bytes) number = number << 8 | std::to_integer<uint32_t>(byte);
  return number;
}
void put_track_number(std::vector<std::byte>& bytes, uint32_t number, int count) {
  while (count-- > 0) bytes.push_back(static_cast<std::byte>(number >> (8 * count)));
}

bool has_right_checksum(std::span<const std::byte> packet) {
  const uint32_t sent = take_big_endian(packet.subspan(kChecksumAt, 2));
  const auto head = packet.first(kChecksumAt), payload = packet.subspan(kTrackHeaderBytes);
  return fletcher16(head, payload, 256) == sent || fletcher16(head, payload, 255) == sent;
}

ValueTree map_of(ValueTree::Map map) {
  return {std::move(map)};
}

/// A rate as OpenTrackIO tells it: of whole numbers.
ValueTree rational_of(const FrameRate& rate) {
  return map_of(
      {{"num", {static_cast<double>(rate.numerator)}}, {"denom", {static_cast<double>(rate.denominator)}}});
}

/// The counting is told where it leaves out numbers, which version 1.0 has no field for.
ValueTree timecode_tree(const Timecode& timecode) {
  const TimecodeFields fields = fields_of(timecode);
  ValueTree::Map map = {{"hours", {1.0 * fields.hours}},
                        {"minutes", {1.0 * fields.minutes}},
                        {"seconds", {1.0 * fields.seconds}},
                        {"frames", {1.0 * fields.frames}},
                        {"frameRate", rational_of(timecode.rate)}};
  if (timecode.is_drop) map.emplace_back("dropFrame", ValueTree{true});
  return map_of(std::move(map));
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
  // What is no rate of a document is not told.
  if (const auto rate =
          parse_frame_rate(fmt::format("{:f}", sample.rate_hz), kLeastFrameRate, kMostTrackRateHz))
    timing.emplace_back("sampleRate", rational_of(*rate));
  if (sample.timecode) timing.emplace_back("timecode", timecode_tree(*sample.timecode));
  ValueTree::Map tracker = {{"status", {std::string("head of Strandcast")}}};
  if (sample.is_recording) tracker.emplace_back("recording", ValueTree{*sample.is_recording});
  if (!sample.slate.empty()) tracker.emplace_back("slate", ValueTree{sample.slate});
  const auto& p = sample.translation_m;
  const auto& r = sample.pan_tilt_roll_deg;
  ValueTree head = map_of({{"translation", map_of({{"x", {p[0]}}, {"y", {p[1]}}, {"z", {p[2]}}})},
                           {"rotation", map_of({{"pan", {r[0]}}, {"tilt", {r[1]}}, {"roll", {r[2]}}})},
                           {"id", {std::string("head")}}});
  return map_of({{"protocol", map_of({{"name", {std::string("OpenTrackIO")}},
                                      {"version", {ValueTree::List{{1.0}, {0.0}, {1.0}}}}})},
                 {"sourceNumber", {static_cast<double>(sample.source)}},
                 {"tracker", map_of(std::move(tracker))},
                 {"timing", map_of(std::move(timing))},
                 {"transforms", {ValueTree::List{std::move(head)}}}});
}

}  // namespace strandcast
