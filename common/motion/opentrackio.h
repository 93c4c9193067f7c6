// Packets of OpenTrackIO 1.0 (SMPTE RiS): a header of 16 bytes, big-endian, before JSON or CBOR, which may be
// spread over segments. Pure functions, any thread. The checksum is Fletcher-16 over the header before it and
// the payload: modulo 255 in version 1.0.0, modulo 256 since 1.0.1. Both are read, and the newer is written.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/base/timecode.h"
#include "common/motion/value_tree.h"

namespace strandcast {

inline constexpr uint16_t kOpenTrackIoPort = 55555;
/// Group of source 1; that of source N ends in N.
inline constexpr const char* kOpenTrackIoGroup = "239.135.1.1";
inline constexpr size_t kTrackHeaderBytes = 16;
inline constexpr size_t kMaxTrackPayloadBytes = (size_t{1} << 15) - 1;  // of one segment
inline constexpr size_t kMaxTrackSampleBytes = size_t{1} << 16;         // of all segments of a sample

enum class TrackEncoding : uint8_t { Json = 1, Cbor = 2 };
/// Encodings from here on belong to vendors.
inline constexpr uint8_t kFirstVendorEncoding = 0x80;

struct TrackSegment {
  uint8_t encoding = 0;
  uint16_t sequence = 0;
  uint32_t offset = 0;  // of the payload in its sample, bytes
  bool is_last = true;
  std::span<const std::byte> payload;  // of the packet that was read
};

/// Reads a packet. BadInput for another identifier, length or checksum.
Result<TrackSegment> read_track_segment(std::span<const std::byte> packet);
/// Writes a packet; the payload has at most kMaxTrackPayloadBytes.
std::vector<std::byte> write_track_segment(const TrackSegment& segment);

/// Checksum of bytes and of those behind them: a sum, and the sum of its sums in the upper byte. `modulus` is
/// 255 or 256.
uint16_t fletcher16(std::span<const std::byte> begin, std::span<const std::byte> end, uint32_t modulus = 256);

/// What a sample tells of one head, in metres and degrees, +Z up, +Y ahead, +X to the right.
struct TrackSample {
  std::array<double, 3> translation_m{};      // x, y, z
  std::array<double, 3> pan_tilt_roll_deg{};  // about +Z, +X and +Y, each after the one before
  double time_s = 0.0;
  uint32_t number = 0;
  double rate_hz = 0.0;  // 0 = not told
  uint32_t source = 1;
  std::optional<Timecode> timecode = {};
  std::optional<bool> is_recording = {};  // empty = not told
  std::string slate = {};                 // of what is recorded; empty = none
};

/// Makes the document of a sample.
ValueTree make_track_document(const TrackSample& sample);

}  // namespace strandcast
