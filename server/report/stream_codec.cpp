#include "server/report/stream_codec.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/strands/strand_codec.h"
#include "server/report/shared_run.h"

namespace strandcast {
namespace {

/// Whose strands a simulation goes on from.
enum class CodedHair { ItsOwn, OfViewers };

/// A strand codec of common/strands, used as server and viewer use it.
class OwnCodec final : public StreamCodec {
 public:
  static Result<std::unique_ptr<StreamCodec>> make(const std::string& name, float bound_m,
                                                   std::optional<WindTold> wind, const StreamShape& shape,
                                                   CodedHair hair = CodedHair::ItsOwn) {
    auto codec = std::unique_ptr<OwnCodec>(new OwnCodec(name, shape));
    ASSIGN_OR_RETURN(codec->quantum_m_, lattice_step_m(name, bound_m));
    ASSIGN_OR_RETURN(codec->encoder_, make_strand_encoder(name));
    ASSIGN_OR_RETURN(codec->decoder_, codec->new_decoder());
    if (wind) codec->told_wind_.emplace(*wind);
    if (hair == CodedHair::OfViewers) codec->shared_.emplace(codec->quantum_m_);
    codec->encoder_->set_rest_shape(shape.rest_in_head_m);
    return std::unique_ptr<StreamCodec>(std::move(codec));
  }

  // Publishing: it happens once for all codecs and classes of a server.
  Status take(const StreamFrame& frame) override {
    snapshot_ = on_lattice(frame, quantum_m_);
    if (told_wind_) snapshot_.trail = told_wind_->trail(snapshot_.trail);
    if (!shared_) return {};
    snapshot_ = shared_->published(frame);
    shared_->step(snapshot_);
    shared_->put_strands(snapshot_);
    return {};
  }

  Result<std::vector<std::byte>> encode() override {
    if (shared_) encoder_->set_state(shared_->copy());
    const EncodedFramePtr frame = encoder_->encode(snapshot_);
    if (shared_) shared_->follow(encoder_->take_shared(), snapshot_);
    if (!frame) return make_error(ErrorCode::LimitExceeded, "codec '{}': a frame is too large", name_);
    return frame->message;
  }

  Status decode(std::span<const std::byte> message) override {
    ASSIGN_OR_RETURN(decoded_, decoder_->decode(message));
    return {};
  }

  std::vector<glm::vec3> decoded() const override { return positions_in_head(*decoded_); }
  const std::vector<glm::vec3>& meant(const StreamFrame& frame) const override {
    return shared_ && shared_->is_active() && !shared_->in_head_m().empty() ? shared_->in_head_m()
                                                                            : frame.position_in_head_m;
  }

  // A viewer that begins with the keyframe must see what all others see.
  Result<size_t> join_bytes(const StreamFrame& frame) override {
    RETURN_IF_ERROR(take(frame));
    if (shared_) encoder_->set_state(shared_->copy());
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
  std::optional<ToldWind> told_wind_;
  std::optional<SharedRun> shared_;
  Snapshot snapshot_;
  std::shared_ptr<const Snapshot> decoded_;
};

}  // namespace

Snapshot on_lattice(const StreamFrame& frame, float quantum_m) {
  QuantiseInput input;
  static_cast<SnapshotInfo&>(input) = frame.published;
  input.quantum_m = quantum_m;
  input.position_in_head_m = frame.position_in_head_m;
  Snapshot snapshot = frame.published;
  snapshot.quantum_m = quantum_m;
  snapshot.lattice = quantise(input).snapshot.lattice;
  return snapshot;
}

const char* to_string(WindTold told) {
  switch (told) {
    case WindTold::Known:
      return "known";
    case WindTold::Mean:
      return "mean";
    case WindTold::Unknown:
      return "unknown";
  }
  return "";
}

std::shared_ptr<const StepTrail> ToldWind::trail(const std::shared_ptr<const StepTrail>& whole) {
  if (told_ == WindTold::Known || whole == nullptr || whole->scene == nullptr) return whole;
  if (whole->scene != whole_scene_) {
    auto scene = std::make_shared<StepScene>(*whole->scene);
    scene->waves.clear();
    whole_scene_ = whole->scene;
    told_scene_ = std::move(scene);
  }
  auto told = std::make_shared<StepTrail>(*whole);
  told->scene = told_scene_;
  for (StepTick& tick : told->ticks) {
    tick.has_waves = false;
    if (told_ == WindTold::Unknown) tick.wind_mps = glm::dvec3(0.0);
  }
  return told;
}

std::vector<StreamCodecRow> own_stream_codecs(double bound_m) {
  std::vector<StreamCodecRow> rows;
  for (const StrandCodecInfo& info : strand_codecs()) {
    StreamCodecRow row;
    row.name = info.name;
    row.is_ours = true;
    row.is_temporal = info.name != "raw";
    row.bound_m = bound_m;
    std::vector<std::optional<WindTold>> winds = {std::nullopt};
    if (info.predicts) winds.assign(std::begin(kWindsTold), std::end(kWindsTold));
    for (const std::optional<WindTold> wind : winds) {
      row.wind = wind;
      row.make = [name = info.name, bound_m, wind](const StreamShape& shape) {
        return OwnCodec::make(name, static_cast<float>(bound_m), wind, shape);
      };
      rows.push_back(row);
    }
  }
  return rows;
}

StreamCodecRow exact_stream_codec(double bound_m) {
  StreamCodecRow row;
  row.name = kExactCodec;
  row.is_ours = row.is_temporal = true;
  row.bound_m = bound_m;
  row.make = [bound_m](const StreamShape& shape) {
    return OwnCodec::make("step", static_cast<float>(bound_m), std::nullopt, shape, CodedHair::OfViewers);
  };
  return row;
}

}  // namespace strandcast
