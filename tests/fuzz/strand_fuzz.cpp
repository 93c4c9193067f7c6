// libFuzzer entry: one strand message for each codec. The first byte says how: with the bytes behind it as
// the whole message, or as a payload behind a valid header, or as the codec's body behind a valid header and
// fixed part; then decoded as the first frame or after a good keyframe. What decodes must be a valid
// snapshot.
#include <cstring>
#include <span>

#include "common/base/check.h"
#include "common/codec/strand_codec.h"
#include "common/codec/strand_payload.h"

namespace {

using namespace strandcast;

constexpr uint32_t kStrands = 5;
constexpr uint32_t kVertices = 4;

Snapshot small_snapshot() {
  Snapshot snapshot;
  snapshot.tick = 1;
  snapshot.strand_count = kStrands;
  snapshot.vertex_count = kVertices;
  snapshot.quantum_m = 1e-4f;
  for (int i = 0; i < static_cast<int>(3 * kStrands * kVertices); ++i)
    snapshot.lattice.push_back(37 * i % 100);
  return snapshot;
}

void check_valid(const Snapshot& snapshot) {
  CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
  CHECK(snapshot.strand_count == kStrands && snapshot.vertex_count == kVertices);
  CHECK(snapshot.quantum_m > 0.0f && is_finite(snapshot.world_from_head));
  for (const int32_t value : snapshot.lattice) CHECK(value > -kMaxLattice && value < kMaxLattice);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const uint8_t how = data[0];
  const auto bytes = std::as_bytes(std::span(data, size)).subspan(1);
  for (const StrandCodecInfo& codec : strand_codecs()) {
    auto encoder = make_strand_encoder(codec.name);
    auto decoder = make_strand_decoder(codec.name, {kStrands, kVertices});
    CHECK(encoder.ok() && decoder.ok());
    const EncodedFramePtr good = (*encoder)->encode(small_snapshot());
    if ((how & 1) != 0) CHECK((*decoder)->decode(good->message).ok());
    FrameHeader header = good->header;
    if ((how & 2) != 0) {
      header.opcode = Opcode::StrandDelta;
      header.base_sequence = header.sequence;
      header.sequence += 1;
    }
    std::vector<std::byte> message(bytes.begin(), bytes.end());
    if ((how & 4) != 0) {
      std::vector<std::byte> payload;
      if ((how & 8) != 0) {
        const auto fixed = std::span(good->message).subspan(kFrameHeaderBytes, kStrandFixedBytes);
        payload.assign(fixed.begin(), fixed.end());
      }
      payload.insert(payload.end(), bytes.begin(), bytes.end());
      message = make_encoded_frame(header, payload)->message;
    }
    if (const auto decoded = (*decoder)->decode(message)) check_valid(**decoded);
    // Whatever happened, a keyframe gets the viewer going again.
    CHECK((*decoder)->decode(good->message).ok());
  }
  return 0;
}
