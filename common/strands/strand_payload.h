// The fixed part at the front of every strand payload (keyframe or delta, any codec), and the table rows of
// the codecs. Used by the codecs only; layout in proto/WIRE.md.
#pragma once

#include "common/strands/strand_codec.h"

namespace strandcast {

inline constexpr size_t kStrandFixedBytes = 96;
inline constexpr size_t kStrandCountOffset = 8;  // in the fixed part
inline constexpr float kMaxQuantumM = 1.0f;
inline constexpr int64_t kMaxStrandTimeNs = int64_t{1} << 61;  // 73 years either way: no difference overflows
inline constexpr double kMaxHeadPositionM = 1e9;               // along every axis
inline constexpr double kRotationTolerance = 1e-3;             // of the length of the head's quaternion

/// All of a snapshot except its lattice, with the hash that checks the decoded lattice.
struct StrandFixedPart {
  uint64_t tick = 0;
  int64_t motion_time_ns = 0;
  Pose world_from_head;
  BustCode bust = kRigidBust;
  float quantum_m = 0.0f;
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  uint64_t state_hash = 0;
};

/// A received strand message whose fixed part was checked against the limits.
struct StrandMessage {
  FrameHeader header;
  StrandFixedPart fixed;
  std::span<const std::byte> body;  // codec data, points into the message
};

/// Appends the fixed part of a snapshot with its state hash and the codec's number on the wire.
void append_fixed_part(const SnapshotInfo& snapshot, uint64_t state_hash, uint8_t codec_number,
                       std::vector<std::byte>& payload);

/// Returns the flags of the frame header that say whether the snapshot has a bust.
constexpr uint8_t bust_flags(const SnapshotInfo& snapshot) {
  return static_cast<uint8_t>(snapshot.bust >> 24);
}

/// Reads the header of an untrusted strand message.
Result<FrameHeader> read_strand_header(std::span<const std::byte> message);
/// Checks times and the head's pose against the limits.
Status check_numbers(const StrandMessage& message);
/// Checks header, codec, counts and finite numbers of an untrusted strand message.
Result<StrandMessage> read_strand_message(std::span<const std::byte> message, uint8_t codec_number,
                                          const StrandStreamLimits& limits);

/// Makes a snapshot with everything except the lattice filled in.
Snapshot make_snapshot(const StrandMessage& message);

/// Checks a decoded snapshot: BadInput unless every lattice value is in range and the state hash matches the
/// announced one.
Status check_decoded(const Snapshot& snapshot, const StrandMessage& message);
/// Does the same check for a lattice whose range and hash the caller has computed.
Status check_decoded(bool is_in_range, uint64_t state_hash, const StrandMessage& message);

/// Checks the order of frames: Unavailable unless the message is a keyframe or follows `last_sequence` (0 =
/// nothing decoded yet).
Status check_chain(const FrameHeader& header, uint32_t last_sequence);

std::unique_ptr<StrandEncoder> make_raw_encoder();
std::unique_ptr<StrandDecoder> make_raw_decoder(const StrandStreamLimits& limits);
std::unique_ptr<StrandEncoder> make_delta_encoder();
std::unique_ptr<StrandDecoder> make_delta_decoder(const StrandStreamLimits& limits);

}  // namespace strandcast
