#include "server/report/stream_codec.h"

#include <cmath>

#include "common/base/check.h"
#include "common/strands/strand_codec.h"

namespace strandcast {
namespace {

/// A strand codec of common/strands, used as server and viewer use it.
class OwnCodec final : public StreamCodec {
 public:
  static Result<std::unique_ptr<StreamCodec>> make(const std::string& name, float bound_m,
                                                   const StreamShape& shape) {
    auto codec = std::unique_ptr<OwnCodec>(new OwnCodec(name, shape));
    ASSIGN_OR_RETURN(codec->quantum_m_, lattice_step_m(name, bound_m));
    ASSIGN_OR_RETURN(codec->encoder_, make_strand_encoder(name));
    ASSIGN_OR_RETURN(codec->decoder_, codec->new_decoder());
    codec->encoder_->set_rest_shape(shape.rest_in_head_m);
    return std::unique_ptr<StreamCodec>(std::move(codec));
  }

  // Publishing: it happens once for all codecs and classes of a server.
  Status take(const StreamFrame& frame) override {
    QuantiseInput input;
    input.tick = frame.tick;
    input.sim_time_ns = frame.sim_time_ns;
    input.trail = frame.trail;
    input.world_from_head = frame.world_from_head;
    input.strand_count = shape_.strand_count;
    input.vertex_count = shape_.vertex_count;
    input.quantum_m = quantum_m_;
    input.position_in_head_m = frame.position_in_head_m;
    snapshot_ = quantise(input).snapshot;
    return {};
  }

  Result<std::vector<std::byte>> encode() override {
    const EncodedFramePtr frame = encoder_->encode(snapshot_);
    if (!frame) return make_error(ErrorCode::LimitExceeded, "codec '{}': a frame is too large", name_);
    return frame->message;
  }

  Status decode(std::span<const std::byte> message) override {
    ASSIGN_OR_RETURN(decoded_, decoder_->decode(message));
    return {};
  }

  std::vector<glm::vec3> decoded() const override { return positions_in_head(*decoded_); }

  // A viewer that begins with the keyframe must see what all others see.
  Result<size_t> join_bytes(const StreamFrame& frame) override {
    RETURN_IF_ERROR(take(frame));
    const JoinFrames join = encoder_->encode_for_join(snapshot_);
    if (!join.keyframe) return make_error(ErrorCode::LimitExceeded, "codec '{}': no keyframe", name_);
    ASSIGN_OR_RETURN(const auto joiner, new_decoder());
    ASSIGN_OR_RETURN(const auto joined, joiner->decode(join.keyframe->message));
    RETURN_IF_ERROR(decode(join.frame->message));
    if (state_hash(*joined) != state_hash(*decoded_))
      return make_error(ErrorCode::Internal, "codec '{}': a late joiner sees something else", name_);
    return join.keyframe->message.size();
  }

 private:
  OwnCodec(std::string name, const StreamShape& shape) : name_(std::move(name)), shape_(shape) {}

  Result<std::unique_ptr<StrandDecoder>> new_decoder() const {
    ASSIGN_OR_RETURN(std::unique_ptr<StrandDecoder> decoder,
                     make_strand_decoder(name_, {shape_.strand_count, shape_.vertex_count}));
    decoder->set_rest_shape(shape_.rest_in_head_m);
    return decoder;
  }

  std::string name_;
  StreamShape shape_;
  float quantum_m_ = 0.0f;
  std::unique_ptr<StrandEncoder> encoder_;
  std::unique_ptr<StrandDecoder> decoder_;
  Snapshot snapshot_;
  std::shared_ptr<const Snapshot> decoded_;
};

}  // namespace

std::vector<StreamCodecRow> own_stream_codecs(double bound_m) {
  std::vector<StreamCodecRow> rows;
  for (const StrandCodecInfo& info : strand_codecs()) {
    StreamCodecRow row;
    row.name = info.name;
    row.is_ours = true;
    row.is_temporal = info.name != "raw";
    row.bound_m = bound_m;
    row.make = [name = info.name, bound_m](const StreamShape& shape) {
      return OwnCodec::make(name, static_cast<float>(bound_m), shape);
    };
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace strandcast
