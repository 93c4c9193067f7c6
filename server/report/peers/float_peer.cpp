#include <cstring>

#include "common/strands/zstd_block.h"
#include "server/report/peers/frame_order.h"
#include "server/report/peers/peer_codecs.h"

namespace strandcast {
namespace {

constexpr int kFloatLevel = 3;

/// 32-bit floats through zstd: nothing is lost.
class FloatPeer final : public StreamCodec {
 public:
  explicit FloatPeer(const StreamShape& shape) : order_(shape), decoded_(shape.plane_size()) {}

  Status take(const StreamFrame& frame) override {
    sorted_m_ = order_.sorted(frame.position_in_head_m);
    return {};
  }
  Result<std::vector<std::byte>> encode() override {
    std::vector<std::byte> message;
    compressor_.append(std::as_bytes(std::span(sorted_m_)), kFloatLevel, message);
    return message;
  }
  Status decode(std::span<const std::byte> message) override {
    return decompressor_.fill(message, std::as_writable_bytes(std::span(decoded_)));
  }
  std::vector<glm::vec3> decoded() const override { return order_.restored(decoded_); }
  Result<size_t> join_bytes(const StreamFrame& frame) override {
    RETURN_IF_ERROR(take(frame));
    ASSIGN_OR_RETURN(const std::vector<std::byte> message, encode());
    return message.size();
  }

 private:
  FrameOrder order_;
  std::vector<glm::vec3> sorted_m_;
  std::vector<glm::vec3> decoded_;
  ZstdCompressor compressor_;
  ZstdDecompressor decompressor_;
};

}  // namespace

std::unique_ptr<StreamCodec> make_float_peer(const StreamShape& shape) {
  return std::make_unique<FloatPeer>(shape);
}

}  // namespace strandcast
