// Apart from strand_codec.cpp: who only decodes links no encoder.
#include <utility>

#include "common/base/check.h"
#include "common/strands/strand_codec.h"
#include "common/strands/strand_payload.h"
#include "common/strands/strand_prefix.h"
#include "common/strands/tangent/codec.h"

namespace strandcast {
namespace {

std::unique_ptr<StrandEncoder> make_encoder_of(const std::string& codec, WorkerPool& workers) {
  if (codec == "delta") return make_delta_encoder();
  if (codec == "raw") return make_raw_encoder();
  if (codec == "tangent") return tangent::make_encoder(workers);
  CHECK(codec == "step");
  return tangent::make_step_encoder(workers);
}

/// Gives the codec the rest shape of those strands that the snapshots have.
class PrefixEncoder final : public StrandEncoder {
 public:
  explicit PrefixEncoder(std::unique_ptr<StrandEncoder> encoder) : encoder_(std::move(encoder)) {}

  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m) override {
    rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
    strand_count_ = 0;
  }
  EncodedFramePtr encode(const Snapshot& snapshot) override {
    adopt(snapshot);
    return encoder_->encode(snapshot);
  }
  JoinFrames encode_for_join(const Snapshot& snapshot) override {
    adopt(snapshot);
    return encoder_->encode_for_join(snapshot);
  }
  std::shared_ptr<SharedUpdate> take_shared(SharedStates which) override {
    return encoder_->take_shared(which);
  }
  void set_state(std::shared_ptr<const SharedState> state) override { encoder_->set_state(std::move(state)); }
  uint64_t step_count() const override { return encoder_->step_count(); }

 private:
  void adopt(const Snapshot& snapshot) {
    if (snapshot.strand_count == strand_count_) return;
    strand_count_ = snapshot.strand_count;
    encoder_->set_rest_shape(prefix_of_shape(rest_in_head_m_, snapshot.vertex_count, strand_count_));
  }

  std::unique_ptr<StrandEncoder> encoder_;
  std::vector<glm::vec3> rest_in_head_m_;
  uint32_t strand_count_ = 0;  // of the newest snapshot; 0 = none since the rest shape was set
};

}  // namespace

Result<std::unique_ptr<StrandEncoder>> make_strand_encoder(const std::string& codec, WorkerPool& workers) {
  ASSIGN_OR_RETURN(const StrandCodecInfo info, strand_codec_info(codec));
  return std::unique_ptr<StrandEncoder>(std::make_unique<PrefixEncoder>(make_encoder_of(info.name, workers)));
}

}  // namespace strandcast
