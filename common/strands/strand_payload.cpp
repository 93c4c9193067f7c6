#include "common/strands/strand_payload.h"

#include <cmath>

#include "common/base/check.h"
#include "common/strands/byte_io.h"

namespace strandcast {
namespace {

Status check_pose(const StrandFixedPart& fixed) {
  const glm::dvec3& position = fixed.world_from_head.position_m;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(std::abs(position[axis]) <= kMaxHeadPositionM))  // also when not a number
      return make_error(ErrorCode::BadInput, "the head of tick {} lies at {} m, allowed is +-{}", fixed.tick,
                        position[axis], kMaxHeadPositionM);
  }
  const double length = glm::length(fixed.world_from_head.rotation);
  if (!(std::abs(length - 1.0) <= kRotationTolerance))
    return make_error(ErrorCode::BadInput, "the head's rotation of tick {} has the length {}, it must be 1",
                      fixed.tick, length);
  return {};
}

}  // namespace

void append_fixed_part(const SnapshotInfo& snapshot, uint64_t state_hash, uint8_t codec_number,
                       std::vector<std::byte>& payload) {
  const size_t begin = payload.size();
  const Pose& pose = snapshot.world_from_head;
  ByteWriter writer(payload);
  writer.put(codec_number);
  for (int i = 0; i < 3; ++i)
    writer.put(static_cast<uint8_t>(snapshot.bust >> (8 * i)));  // the rest: bust_flags()
  writer.put(snapshot.quantum_m);
  writer.put(snapshot.strand_count);
  writer.put(snapshot.vertex_count);
  writer.put(snapshot.tick);
  writer.put(snapshot.motion_time_ns);
  for (int axis = 0; axis < 3; ++axis) writer.put(pose.position_m[axis]);
  writer.put(pose.rotation.w);
  writer.put(pose.rotation.x);
  writer.put(pose.rotation.y);
  writer.put(pose.rotation.z);
  writer.put(state_hash);
  CHECK(payload.size() - begin == kStrandFixedBytes);
}

Result<FrameHeader> read_strand_header(std::span<const std::byte> message) {
  ASSIGN_OR_RETURN(const FrameHeader header, unpack_frame_header(message));
  if (header.opcode != Opcode::StrandKeyframe && header.opcode != Opcode::StrandDelta)
    return make_error(ErrorCode::BadInput, "opcode 0x{:02x} is no strand message",
                      static_cast<uint8_t>(header.opcode));
  if (header.sequence == 0)
    return make_error(ErrorCode::BadInput, "strand message has sequence number 0, they count from 1");
  return header;
}

Status check_numbers(const StrandMessage& message) {
  const StrandFixedPart& fixed = message.fixed;
  RETURN_IF_ERROR(check_pose(fixed));
  for (const int64_t time_ns :
       {message.header.sim_time_ns, message.header.send_time_ns, fixed.motion_time_ns}) {
    if (time_ns < -kMaxStrandTimeNs || time_ns > kMaxStrandTimeNs)
      return make_error(ErrorCode::BadInput, "tick {} has the time {} ns, allowed is +-{}", fixed.tick,
                        time_ns, kMaxStrandTimeNs);
  }
  return {};
}

Result<StrandMessage> read_strand_message(std::span<const std::byte> message, uint8_t codec_number,
                                          const StrandStreamLimits& limits) {
  StrandMessage result;
  ASSIGN_OR_RETURN(result.header, read_strand_header(message));
  ByteReader reader(message.subspan(kFrameHeaderBytes));
  StrandFixedPart& fixed = result.fixed;
  const auto codec = reader.take<uint8_t>();
  fixed.bust = BustCode{result.header.flags} << 24;
  for (int i = 0; i < 3; ++i) fixed.bust |= BustCode{reader.take<uint8_t>()} << (8 * i);
  fixed.quantum_m = reader.take<float>();
  fixed.strand_count = reader.take<uint32_t>();
  fixed.vertex_count = reader.take<uint32_t>();
  fixed.tick = reader.take<uint64_t>();
  fixed.motion_time_ns = reader.take<int64_t>();
  for (int axis = 0; axis < 3; ++axis) fixed.world_from_head.position_m[axis] = reader.take<double>();
  fixed.world_from_head.rotation.w = reader.take<double>();
  fixed.world_from_head.rotation.x = reader.take<double>();
  fixed.world_from_head.rotation.y = reader.take<double>();
  fixed.world_from_head.rotation.z = reader.take<double>();
  fixed.state_hash = reader.take<uint64_t>();
  if (!reader.ok())
    return make_error(ErrorCode::BadInput, "strand payload has {} bytes, its fixed part alone has {}",
                      result.header.payload_bytes, kStrandFixedBytes);
  if (codec != codec_number)
    return make_error(ErrorCode::BadInput, "strand payload is of codec {}, this stream uses {}", codec,
                      codec_number);
  if (fixed.strand_count != limits.strand_count || fixed.vertex_count != limits.vertex_count)
    return make_error(ErrorCode::BadInput,
                      "strand payload has {} x {} vertices, the stream was announced with {} x {}",
                      fixed.strand_count, fixed.vertex_count, limits.strand_count, limits.vertex_count);
  if (!(fixed.quantum_m > 0.0f && fixed.quantum_m <= kMaxQuantumM))
    return make_error(ErrorCode::BadInput, "lattice step {} m is not in (0, {}]", fixed.quantum_m,
                      kMaxQuantumM);
  RETURN_IF_ERROR(check_numbers(result));
  result.body = reader.rest();
  return result;
}

Snapshot make_snapshot(const StrandMessage& message) {
  Snapshot snapshot;
  snapshot.tick = message.fixed.tick;
  snapshot.sim_time_ns = message.header.sim_time_ns;
  snapshot.motion_time_ns = message.fixed.motion_time_ns;
  snapshot.world_from_head = message.fixed.world_from_head;
  snapshot.bust = message.fixed.bust;
  snapshot.strand_count = message.fixed.strand_count;
  snapshot.vertex_count = message.fixed.vertex_count;
  snapshot.quantum_m = message.fixed.quantum_m;
  return snapshot;
}

Status check_decoded(const Snapshot& snapshot, const StrandMessage& message) {
  bool is_inside = true;
  for (const int32_t value : snapshot.lattice) is_inside &= value > -kMaxLattice && value < kMaxLattice;
  return check_decoded(is_inside, is_inside ? state_hash(snapshot) : 0, message);
}

Status check_decoded(bool is_in_range, uint64_t state_hash, const StrandMessage& message) {
  if (!is_in_range)
    return make_error(ErrorCode::BadInput, "tick {} holds a lattice value outside +-{}", message.fixed.tick,
                      kMaxLattice - 1);
  if (state_hash != message.fixed.state_hash)
    return make_error(ErrorCode::BadInput, "tick {} decodes to state {:016x}, the server announced {:016x}",
                      message.fixed.tick, state_hash, message.fixed.state_hash);
  return {};
}

Status check_chain(const FrameHeader& header, uint32_t last_sequence) {
  if (header.opcode == Opcode::StrandKeyframe) return {};
  if (last_sequence == 0)
    return make_error(ErrorCode::Unavailable, "delta {} needs frame {}, but no keyframe has come yet",
                      header.sequence, header.base_sequence);
  if (header.base_sequence != last_sequence)
    return make_error(ErrorCode::Unavailable, "delta {} needs frame {}, the last one decoded is {}",
                      header.sequence, header.base_sequence, last_sequence);
  return {};
}

}  // namespace strandcast
