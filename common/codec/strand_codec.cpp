#include "common/codec/strand_codec.h"

#include "common/codec/strand_payload.h"
#include "common/groom/groom.h"

namespace strandcast {
namespace {

struct Row {
  StrandCodecInfo info;
  std::unique_ptr<StrandEncoder> (*make_encoder)();
  std::unique_ptr<StrandDecoder> (*make_decoder)(const StrandStreamLimits&);
  float (*lattice_step_m)(float bound_m);
};

const std::vector<Row>& rows() {
  static const std::vector<Row> table = {
      {{"delta", "lattice steps predicted from the last frame and the neighbouring vertices, entropy coded"},
       make_delta_encoder,
       make_delta_decoder,
       quantum_for_bound},
      {{"raw", "32-bit lattice values as they are, every frame a keyframe: the reference for tests"},
       make_raw_encoder,
       make_raw_decoder,
       quantum_for_bound},
      {{"tangent",
        "motion predicted along strands of known lengths, corrected as cheaply as the bound allows"},
       make_tangent_encoder,
       make_tangent_decoder,
       tangent_lattice_step_m},
  };
  return table;
}

Result<const Row*> find_row(const std::string& codec) {
  std::string known;
  for (const Row& row : rows()) {
    if (row.info.name == codec) return &row;
    known += (known.empty() ? "" : ", ") + row.info.name;
  }
  return make_error(ErrorCode::NotFound, "unknown strand codec '{}' (known: {})", codec.substr(0, 64), known);
}

}  // namespace

const std::vector<StrandCodecInfo>& strand_codecs() {
  static const std::vector<StrandCodecInfo> infos = [] {
    std::vector<StrandCodecInfo> list;
    for (const Row& row : rows()) list.push_back(row.info);
    return list;
  }();
  return infos;
}

Result<float> lattice_step_m(const std::string& codec, float bound_m) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  return row->lattice_step_m(bound_m);
}

Result<std::unique_ptr<StrandEncoder>> make_strand_encoder(const std::string& codec) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  return row->make_encoder();
}

Result<std::unique_ptr<StrandDecoder>> make_strand_decoder(const std::string& codec,
                                                           const StrandStreamLimits& limits) {
  ASSIGN_OR_RETURN(const Row* row, find_row(codec));
  if (limits.strand_count == 0 || limits.strand_count > kMaxStrandCount)
    return make_error(ErrorCode::LimitExceeded, "{} strands are not in 1..{}", limits.strand_count,
                      kMaxStrandCount);
  if (limits.vertex_count < kMinVertexCount || limits.vertex_count > kMaxVertexCount)
    return make_error(ErrorCode::LimitExceeded, "{} vertices per strand are not in {}..{}",
                      limits.vertex_count, kMinVertexCount, kMaxVertexCount);
  return row->make_decoder(limits);
}

}  // namespace strandcast
