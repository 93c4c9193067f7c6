#include "server/report/peers/lattice_peer.h"

#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "server/report/peers/frame_order.h"
#include "server/report/peers/temporal_predictor.h"

namespace strandcast {
namespace {

class LatticePeer final : public StreamCodec {
 public:
  LatticePeer(const LatticePeerDesc& desc, const StreamShape& shape)
      : desc_(desc),
        order_(shape),
        coder_(desc.make_coder()),
        planes_(IntegerPlanes::make(shape.strand_count, shape.vertex_count)) {}

  Status take(const StreamFrame& frame) override {
    sorted_m_ = order_.sorted(frame.position_in_head_m);
    return {};
  }

  Result<std::vector<std::byte>> encode() override {
    const size_t plane_size = planes_.plane_size();
    const double steps_per_m = 1.0 / static_cast<double>(desc_.quantum_m);
    for (size_t i = 0; i < plane_size; ++i)
      for (int axis = 0; axis < 3; ++axis)
        planes_.value[static_cast<size_t>(axis) * plane_size + i] =
            static_cast<int32_t>(std::lrint(static_cast<double>(sorted_m_[i][axis]) * steps_per_m));
    if (desc_.prediction == PeerPrediction::None) return coder_->encode(planes_, IntegerKind::Positions);

    const TemporalWeights weights = encoder_.fit(planes_);
    ASSIGN_OR_RETURN(std::vector<std::byte> message,
                     coder_->encode(encoder_.residual(planes_, weights), encoder_.next_kind()));
    const auto head = std::as_bytes(std::span(weights));
    message.insert(message.begin(), head.begin(), head.end());
    encoder_.advance(planes_);
    return message;
  }

  Status decode(std::span<const std::byte> message) override {
    TemporalWeights weights{};
    const bool is_temporal = desc_.prediction == PeerPrediction::Temporal;
    const size_t head_bytes = is_temporal ? sizeof(weights) : 0;
    if (message.size() < head_bytes) return make_error(ErrorCode::BadInput, "the message is too short");
    ASSIGN_OR_RETURN(decoded_,
                     coder_->decode(message.subspan(head_bytes), planes_.strand_count, planes_.vertex_count));
    if (!is_temporal) return {};
    std::memcpy(weights.data(), message.data(), sizeof(weights));
    decoded_ = decoder_.restored(decoded_, weights);
    decoder_.advance(decoded_);
    return {};
  }

  std::vector<glm::vec3> decoded() const override {
    const size_t plane_size = decoded_.plane_size();
    const double quantum_m = desc_.quantum_m;
    std::vector<glm::vec3> sorted(plane_size);
    for (size_t i = 0; i < plane_size; ++i)
      for (int axis = 0; axis < 3; ++axis)
        sorted[i][axis] =
            static_cast<float>(decoded_.value[static_cast<size_t>(axis) * plane_size + i] * quantum_m);
    return order_.restored(sorted);
  }

  // A chain begun anew: what follows is coded for everybody as if this were its first frame.
  Result<size_t> join_bytes(const StreamFrame& frame) override {
    RETURN_IF_ERROR(take(frame));
    encoder_ = {};
    decoder_ = {};
    ASSIGN_OR_RETURN(const std::vector<std::byte> message, encode());
    RETURN_IF_ERROR(decode(message));
    return message.size();
  }

 private:
  LatticePeerDesc desc_;
  FrameOrder order_;
  std::unique_ptr<IntegerCoder> coder_;
  std::vector<glm::vec3> sorted_m_;
  IntegerPlanes planes_;
  IntegerPlanes decoded_;
  TemporalPredictor encoder_;
  TemporalPredictor decoder_;
};

}  // namespace

std::unique_ptr<StreamCodec> make_lattice_peer(const LatticePeerDesc& desc, const StreamShape& shape) {
  CHECK(desc.quantum_m > 0.0f && desc.make_coder != nullptr);
  return std::make_unique<LatticePeer>(desc, shape);
}

}  // namespace strandcast
