#include "common/base/check.h"
#include "common/strands/byte_io.h"
#include "common/strands/strand_payload.h"

namespace strandcast {
namespace {

constexpr uint8_t kRawCodecNumber = 0;

class RawEncoder : public StrandEncoder {
 public:
  EncodedFramePtr encode(const Snapshot& snapshot) override {
    CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
    std::vector<std::byte> payload;
    payload.reserve(kStrandFixedBytes + snapshot.lattice.size() * sizeof(int32_t));
    append_fixed_part(snapshot, state_hash(snapshot), kRawCodecNumber, payload);
    ByteWriter(payload).put_bytes(std::as_bytes(std::span(snapshot.lattice)));
    FrameHeader header;
    header.opcode = Opcode::StrandKeyframe;
    header.flags = bust_flags(snapshot);
    header.sequence = ++sequence_;
    header.sim_time_ns = snapshot.sim_time_ns;
    return make_encoded_frame(header, payload);
  }
  JoinFrames encode_for_join(const Snapshot& snapshot) override {
    const EncodedFramePtr keyframe = encode(snapshot);
    return {keyframe, keyframe};
  }

 private:
  uint32_t sequence_ = 0;
};

class RawDecoder : public StrandDecoder {
 public:
  explicit RawDecoder(const StrandStreamLimits& limits) : limits_(limits) {}

  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> bytes) override {
    ASSIGN_OR_RETURN(const StrandMessage message, read_strand_message(bytes, kRawCodecNumber, limits_));
    if (message.header.opcode != Opcode::StrandKeyframe)
      return make_error(ErrorCode::BadInput, "codec 'raw' has keyframes only");
    auto snapshot = std::make_shared<Snapshot>(make_snapshot(message));
    const size_t expected_bytes = 3 * snapshot->plane_size() * sizeof(int32_t);
    if (message.body.size() != expected_bytes)
      return make_error(ErrorCode::BadInput, "raw strand body has {} bytes, expected {}", message.body.size(),
                        expected_bytes);
    snapshot->lattice.resize(3 * snapshot->plane_size());
    std::memcpy(snapshot->lattice.data(), message.body.data(), expected_bytes);
    RETURN_IF_ERROR(check_decoded(*snapshot, message));
    return std::shared_ptr<const Snapshot>(std::move(snapshot));
  }

 private:
  StrandStreamLimits limits_;
};

}  // namespace

std::unique_ptr<StrandEncoder> make_raw_encoder() {
  return std::make_unique<RawEncoder>();
}
std::unique_ptr<StrandDecoder> make_raw_decoder(const StrandStreamLimits& limits) {
  return std::make_unique<RawDecoder>(limits);
}

}  // namespace strandcast
