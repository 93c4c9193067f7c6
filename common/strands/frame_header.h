// The 32-byte header in front of every media message. Layout in proto/WIRE.md. Pure functions, any thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

enum class Opcode : uint8_t {
  Control = 0x01,  // protobuf follows at once, no header
  Asset = 0x10,    // SceneAsset: groom topology and head mesh
  StrandKeyframe = 0x20,
  StrandDelta = 0x21,
  JpegFrame = 0x30,  // one whole picture
  JpegTiles = 0x31,  // the tiles that changed, or all
  Vp8Frame = 0x32,
  H264Frame = 0x33,
};

/// Returns true for pictures that may depend on the preceding picture.
constexpr bool is_chained_picture(Opcode opcode) {
  return opcode == Opcode::JpegTiles || opcode == Opcode::Vp8Frame || opcode == Opcode::H264Frame;
}

inline constexpr size_t kFrameHeaderBytes = 32;
/// Bit of stream_id that marks pictures and keeps them apart from streams of strands.
inline constexpr uint16_t kPictureStreamBit = 0x8000;
/// Returns the stream_id of a picture class.
constexpr uint16_t picture_stream_id(uint32_t picture_class) {
  return static_cast<uint16_t>(kPictureStreamBit | (picture_class & (kPictureStreamBit - 1u)));
}
/// Bit of a picture's flags: it is the finest of its state.
inline constexpr uint8_t kStillPicture = 1;
inline constexpr uint32_t kMaxMediaPayloadBytes = 64u << 20;

struct FrameHeader {
  Opcode opcode = Opcode::StrandDelta;
  uint8_t flags = 0;       // strands: bits of the bust (strand_payload.h); pictures: kStillPicture; else 0
  uint16_t stream_id = 0;  // the strand class; of pictures, their class and kPictureStreamBit
  uint32_t sequence = 0;   // counts per stream, from 1
  uint32_t base_sequence = 0;  // a delta decodes only right after this one; 0 = none needed
  uint32_t payload_bytes = 0;
  int64_t sim_time_ns = 0;
  int64_t send_time_ns = 0;  // server clock

  bool operator==(const FrameHeader&) const = default;
};

/// Serialises the header, little-endian.
std::array<std::byte, kFrameHeaderBytes> pack(const FrameHeader& header);

/// Reads a header; checks its opcode, its limit, and that exactly payload_bytes follow it in `message`.
Result<FrameHeader> unpack_frame_header(std::span<const std::byte> message);

/// One encoded media message: header and payload in one buffer, ready for the socket; shared by all sessions.
struct EncodedFrame {
  FrameHeader header;
  std::vector<std::byte> message;  // header + payload
};
using EncodedFramePtr = std::shared_ptr<const EncodedFrame>;

/// Makes a message and sets header.payload_bytes. Returns null if the payload exceeds kMaxMediaPayloadBytes.
EncodedFramePtr make_encoded_frame(FrameHeader header, std::span<const std::byte> payload);

/// Copies a frame for another stream and sets send_time_ns in both the header and the message.
EncodedFramePtr with_send_time(const EncodedFrame& frame, uint16_t stream_id, int64_t send_time_ns);

}  // namespace strandcast
