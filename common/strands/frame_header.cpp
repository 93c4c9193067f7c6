#include "common/strands/frame_header.h"

#include <algorithm>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {
namespace {

constexpr std::array kMediaOpcodes = {Opcode::Asset,     Opcode::StrandKeyframe, Opcode::StrandDelta,
                                      Opcode::JpegFrame, Opcode::JpegTiles,      Opcode::Vp8Frame,
                                      Opcode::H264Frame};

bool is_known(Opcode opcode) {
  return std::find(kMediaOpcodes.begin(), kMediaOpcodes.end(), opcode) != kMediaOpcodes.end();
}

std::string known_opcodes() {
  std::string list;
  for (const Opcode opcode : kMediaOpcodes)
    list += fmt::format("{}0x{:02x}", list.empty() ? "" : ", ", static_cast<uint8_t>(opcode));
  return list;
}

}  // namespace

std::array<std::byte, kFrameHeaderBytes> pack(const FrameHeader& header) {
  std::vector<std::byte> bytes;
  bytes.reserve(kFrameHeaderBytes);
  ByteWriter writer(bytes);
  writer.put(static_cast<uint8_t>(header.opcode));
  writer.put(header.flags);
  writer.put(header.stream_id);
  writer.put(header.sequence);
  writer.put(header.base_sequence);
  writer.put(header.payload_bytes);
  writer.put(header.sim_time_ns);
  writer.put(header.send_time_ns);
  std::array<std::byte, kFrameHeaderBytes> packed{};
  CHECK(bytes.size() == packed.size());
  std::memcpy(packed.data(), bytes.data(), packed.size());
  return packed;
}

Result<FrameHeader> unpack_frame_header(std::span<const std::byte> message) {
  // A later version may have more of them.
  if (!message.empty() && !is_known(static_cast<Opcode>(message[0])))
    return make_error(ErrorCode::Unsupported, "unknown media opcode 0x{:02x} (known: {})",
                      static_cast<unsigned>(message[0]), known_opcodes());
  if (message.size() < kFrameHeaderBytes)
    return make_error(ErrorCode::BadInput, "media message has {} bytes, its header alone has {}",
                      message.size(), kFrameHeaderBytes);
  ByteReader reader(message);
  FrameHeader header;
  header.opcode = static_cast<Opcode>(reader.take<uint8_t>());
  header.flags = reader.take<uint8_t>();
  header.stream_id = reader.take<uint16_t>();
  header.sequence = reader.take<uint32_t>();
  header.base_sequence = reader.take<uint32_t>();
  header.payload_bytes = reader.take<uint32_t>();
  header.sim_time_ns = reader.take<int64_t>();
  header.send_time_ns = reader.take<int64_t>();
  if (header.payload_bytes > kMaxMediaPayloadBytes)
    return make_error(ErrorCode::LimitExceeded, "media payload of {} bytes, the limit is {}",
                      header.payload_bytes, kMaxMediaPayloadBytes);
  if (header.payload_bytes != message.size() - kFrameHeaderBytes)
    return make_error(ErrorCode::BadInput, "media header announces {} payload bytes, the message carries {}",
                      header.payload_bytes, message.size() - kFrameHeaderBytes);
  return header;
}

EncodedFramePtr make_encoded_frame(FrameHeader header, std::span<const std::byte> payload) {
  if (payload.size() > kMaxMediaPayloadBytes) return nullptr;
  header.payload_bytes = static_cast<uint32_t>(payload.size());
  auto frame = std::make_shared<EncodedFrame>();
  frame->header = header;
  frame->message.reserve(kFrameHeaderBytes + payload.size());
  ByteWriter writer(frame->message);
  writer.put_bytes(pack(header));
  writer.put_bytes(payload);
  return frame;
}

EncodedFramePtr with_send_time(const EncodedFrame& frame, uint16_t stream_id, int64_t send_time_ns) {
  auto stamped = std::make_shared<EncodedFrame>(frame);
  stamped->header.stream_id = stream_id;
  stamped->header.send_time_ns = send_time_ns;
  const auto packed = pack(stamped->header);
  std::copy(packed.begin(), packed.end(), stamped->message.begin());
  return stamped;
}

}  // namespace strandcast
