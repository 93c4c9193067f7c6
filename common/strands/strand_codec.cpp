#include "common/strands/strand_codec.h"

#include <cstring>
#include <utility>

#include "common/base/text.h"
#include "common/strands/strand_limits.h"
#include "common/strands/strand_payload.h"
#include "common/strands/strand_prefix.h"
#include "common/strands/tangent/codec.h"

namespace strandcast {
namespace {

struct Row {
  StrandCodecInfo info;
  std::unique_ptr<StrandDecoder> (*make_decoder)(const StrandStreamLimits&, WorkerPool&);
  float (*lattice_step_m)(float bound_m);
};

// Measured by `step_bench --classes yes` (2,000 and 10,000 x 16, `dftl` and `direct_rod`, built-in heads and
// captured ones). Within 20 % for tangent; for step too at 60 Hz. How rarer frames of step fare hangs on the
// solver: the rest takes 1/6 of the bytes a second at 10 Hz with `dftl`, and more than at 60 Hz with
// `direct_rod`.
constexpr StrandByteModel kTangentBytes = {100.0, 0.0, 0.92, 0.54, 0.6};
constexpr StrandByteModel kStepBytes = {130.0, 30.0, 1.0, 0.5, 0.55};

// What makes a codec that needs no workers.
template <std::unique_ptr<StrandDecoder> (*make)(const StrandStreamLimits&)>
std::unique_ptr<StrandDecoder> on_calling_thread(const StrandStreamLimits& limits, WorkerPool&) {
  return make(limits);
}

const std::vector<Row>& rows() {
  static const std::vector<Row> table = {
      {{"delta",
        "lattice steps predicted from the last frame and the neighbouring vertices, entropy coded",
        false,
        {},
        1.0,
        kTangentBytes},
       on_calling_thread<make_delta_decoder>,
       quantum_for_bound},
      {{"raw", "32-bit lattice values as they are, every frame a keyframe: the reference for tests"},
       on_calling_thread<make_raw_decoder>,
       quantum_for_bound},
      {{"tangent",
        "motion predicted along strands of known lengths, corrected as cheaply as the bound allows",
        false,
        {},
        1.0,
        kTangentBytes},
       tangent::make_decoder,
       tangent::lattice_step_m},
      {{"step", "as tangent, predicted by steps of the announced solver, whose work the decoder does too",
        true, "tangent", 0.05, kStepBytes},
       tangent::make_step_decoder,
       tangent::lattice_step_m},
  };
  return table;
}

Result<const Row*> find_row(const std::string& codec) {
  constexpr size_t kMaxShownChars = 64;
  std::string known;
  for (const Row& row : rows()) {
    if (row.info.name == codec) return &row;
    known += (known.empty() ? "" : ", ") + row.info.name;
  }
  return make_error(ErrorCode::NotFound, "unknown strand codec '{}' (known: {})",
                    excerpt(codec, kMaxShownChars), known);
}

/// A decoder for as many strands as the newest keyframe has.
class PrefixDecoder final : public StrandDecoder {
 public:
  PrefixDecoder(const Row& row, const StrandStreamLimits& limits, WorkerPool& workers)
      : row_(row),
        limits_(limits),
        workers_(workers),
        strand_count_(limits.strand_count),
        decoder_(row.make_decoder(limits, workers)) {}

  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m) override {
    const bool fits = rest_in_head_m.size() == size_t{limits_.strand_count} * limits_.vertex_count;
    rest_in_head_m_.clear();
    if (fits) rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
    strand_count_ = limits_.strand_count;
    decoder_ = make_decoder(strand_count_);
  }

  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> message) override {
    const uint32_t count = keyframe_strand_count(message);
    if (count == 0 || count == strand_count_ || count > limits_.strand_count)
      return decoder_->decode(message);
    // Until the keyframe has proved right, what there is stays.
    std::unique_ptr<StrandDecoder> decoder = make_decoder(count);
    ASSIGN_OR_RETURN(std::shared_ptr<const Snapshot> snapshot, decoder->decode(message));
    decoder_ = std::move(decoder);
    strand_count_ = count;
    return snapshot;
  }

 private:
  std::unique_ptr<StrandDecoder> make_decoder(uint32_t strand_count) const {
    auto decoder = row_.make_decoder({strand_count, limits_.vertex_count}, workers_);
    decoder->set_rest_shape(prefix_of_shape(rest_in_head_m_, limits_.vertex_count, strand_count));
    return decoder;
  }

  /// What a keyframe says before anything of it is checked; 0 for all else.
  static uint32_t keyframe_strand_count(std::span<const std::byte> message) {
    uint32_t count = 0;
    if (message.size() < kFrameHeaderBytes + kStrandFixedBytes) return 0;
    if (static_cast<Opcode>(message[0]) != Opcode::StrandKeyframe) return 0;
    std::memcpy(&count, message.data() + kFrameHeaderBytes + kStrandCountOffset, sizeof count);
    return count;
  }

  const Row& row_;
  const StrandStreamLimits limits_;
  WorkerPool& workers_;
  std::vector<glm::vec3> rest_in_head_m_;  // of all strands
  uint32_t strand_count_;                  // of decoder_
  std::unique_ptr<StrandDecoder> decoder_;
};

}  // namespace

const std::vector<StrandCodecInfo>& strand_codecs() {
  static const std::vector<StrandCodecInfo> infos = [] {
    std::vector<StrandCodecInfo> list;
    for (const Row& row : rows()) list.push_back(row.info);
    return list;
  }();
  return infos;
}

Result<StrandCodecInfo> strand_codec_info(const std::string& codec) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  return row->info;
}

Result<float> lattice_step_m(const std::string& codec, float bound_m) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  return row->lattice_step_m(bound_m);
}

Result<std::unique_ptr<StrandDecoder>> make_strand_decoder(const std::string& codec,
                                                           const StrandStreamLimits& limits,
                                                           WorkerPool& workers) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  if (limits.strand_count == 0 || limits.strand_count > kMaxStrandCount)
    return make_error(ErrorCode::LimitExceeded, "{} strands are not in 1..{}", limits.strand_count,
                      kMaxStrandCount);
  if (limits.vertex_count < kMinVertexCount || limits.vertex_count > kMaxVertexCount)
    return make_error(ErrorCode::LimitExceeded, "{} vertices per strand are not in {}..{}",
                      limits.vertex_count, kMinVertexCount, kMaxVertexCount);
  return std::unique_ptr<StrandDecoder>(std::make_unique<PrefixDecoder>(*row, limits, workers));
}

}  // namespace strandcast
