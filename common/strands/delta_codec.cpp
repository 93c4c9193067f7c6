// The "delta" codec. A frame is the residual of the lattice velocity against a prediction whose weights the
// encoder fits to each frame and sends along (strand_predictor.h). A keyframe carries the whole chain state,
// so that a late joiner continues on the deltas everybody else gets.
#include "common/base/check.h"
#include "common/strands/byte_io.h"
#include "common/strands/residual_coder.h"
#include "common/strands/strand_payload.h"
#include "common/strands/strand_predictor.h"

namespace strandcast {
namespace {

constexpr uint8_t kDeltaCodecNumber = 1;
constexpr int kKeyframeLevel = 3;
constexpr int kDeltaLevel = 1;
constexpr size_t kWeightBytes = kRowClassCount * kFeatureCount * sizeof(int16_t);

/// Lattice value of a vertex guessed from the vertices before it on its own and on the neighbour's strand.
struct ShapeGuess {
  const StrandChain& chain;
  const int32_t* lattice;  // one axis

  int32_t operator()(uint32_t vertex_index, uint32_t s) const {
    const size_t stride = chain.strand_count;
    const uint32_t n = chain.neighbour[s];
    const int32_t* row = lattice + vertex_index * stride;
    if (vertex_index == 0) return n == s ? 0 : row[n];
    const int32_t* parent = row - stride;
    const bool has_grandparent = vertex_index >= 2;
    const int32_t own_step = has_grandparent ? wrapping_difference(parent[s], (parent - stride)[s]) : 0;
    const int32_t neighbour_step = n == s ? own_step : wrapping_difference(row[n], parent[n]);
    const int32_t step = has_grandparent ? wrapping_sum(own_step, neighbour_step) >> 1 : neighbour_step;
    return wrapping_sum(parent[s], step);
  }
};

/// visit(index, guess) for every lattice value, in an order in which a guess needs visited values only.
template <class Visit>
void for_each_guess(const StrandChain& chain, const int32_t* lattice, Visit visit) {
  for (size_t axis = 0; axis < 3; ++axis) {
    const size_t axis_begin = axis * chain.plane_size();
    const ShapeGuess guess{chain, lattice + axis_begin};
    for (uint32_t vertex_index = 0; vertex_index < chain.vertex_count; ++vertex_index) {
      const size_t row_begin = axis_begin + static_cast<size_t>(vertex_index) * chain.strand_count;
      for (uint32_t s = 0; s < chain.strand_count; ++s) visit(row_begin + s, guess(vertex_index, s));
    }
  }
}

std::vector<int32_t> neighbour_distances(const std::vector<uint32_t>& neighbour) {
  std::vector<int32_t> distance(neighbour.size());
  for (size_t s = 0; s < distance.size(); ++s) distance[s] = static_cast<int32_t>(s - neighbour[s]);
  return distance;
}

Result<std::vector<uint32_t>> neighbours_from(const std::vector<int32_t>& distance) {
  std::vector<uint32_t> neighbour(distance.size());
  for (size_t s = 0; s < distance.size(); ++s) {
    if (distance[s] < 0 || static_cast<size_t>(distance[s]) > s)
      return make_error(ErrorCode::BadInput, "neighbour of strand {} lies {} strands before it", s,
                        distance[s]);
    neighbour[s] = static_cast<uint32_t>(s) - static_cast<uint32_t>(distance[s]);
  }
  return neighbour;
}

class DeltaEncoder : public StrandEncoder {
 public:
  EncodedFramePtr encode(const Snapshot& snapshot) override {
    CHECK(snapshot.strand_count > 0 && snapshot.vertex_count > 0);
    CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
    const bool continues = snapshot.strand_count == chain_.strand_count &&
                           snapshot.vertex_count == chain_.vertex_count &&
                           snapshot.quantum_m == last_.quantum_m;
    const uint32_t base_sequence = sequence_++;
    last_ = snapshot;
    last_.lattice.clear();  // kept in the chain
    EncodedFramePtr frame;
    if (continues && base_sequence != 0) {
      frame = encode_delta(snapshot, base_sequence);
    } else {
      start_chain(snapshot);
      frame = encode_chain(snapshot);
    }
    if (!frame) chain_ = {};
    return frame;
  }

  JoinFrames encode_for_join(const Snapshot& snapshot) override {
    const EncodedFramePtr frame = encode(snapshot);
    const bool is_keyframe = frame == nullptr || frame->header.opcode == Opcode::StrandKeyframe;
    return {frame, is_keyframe ? frame : encode_chain(snapshot)};
  }

 private:
  void start_chain(const Snapshot& snapshot) {
    chain_.strand_count = snapshot.strand_count;
    chain_.vertex_count = snapshot.vertex_count;
    chain_.lattice = snapshot.lattice;
    chain_.velocity.assign(snapshot.lattice.size(), 0);
    chain_.residual.assign(snapshot.lattice.size(), 0);
    find_neighbours(chain_);
  }

  EncodedFramePtr encode_delta(const Snapshot& snapshot, uint32_t base_sequence) {
    std::vector<int32_t> velocity(snapshot.lattice.size());
    for (size_t i = 0; i < velocity.size(); ++i)
      velocity[i] = wrapping_difference(snapshot.lattice[i], chain_.lattice[i]);
    const PredictorWeights weights = fit_weights(chain_, velocity);
    std::vector<int32_t> residual = find_residual(chain_, weights, velocity);

    std::vector<std::byte> payload;
    append_fixed_part(snapshot, state_hash(snapshot), kDeltaCodecNumber, payload);
    ByteWriter(payload).put_bytes(std::as_bytes(std::span(&weights, 1)));
    planes_.append(residual, kDeltaLevel, payload);

    chain_.lattice = snapshot.lattice;
    chain_.velocity = std::move(velocity);
    chain_.residual = std::move(residual);
    return make_encoded_frame(make_header(Opcode::StrandDelta, base_sequence, snapshot), payload);
  }

  EncodedFramePtr encode_chain(const Snapshot& snapshot) {
    std::vector<int32_t> shape(chain_.lattice.size());
    for_each_guess(chain_, chain_.lattice.data(), [&](size_t i, int32_t guess) {
      shape[i] = wrapping_difference(chain_.lattice[i], guess);
    });
    std::vector<std::byte> payload;
    append_fixed_part(snapshot, state_hash(snapshot), kDeltaCodecNumber, payload);
    planes_.append(neighbour_distances(chain_.neighbour), kKeyframeLevel, payload);
    planes_.append(neighbour_distances(chain_.second_neighbour), kKeyframeLevel, payload);
    planes_.append(shape, kKeyframeLevel, payload);
    planes_.append(chain_.velocity, kKeyframeLevel, payload);
    planes_.append(chain_.residual, kKeyframeLevel, payload);
    return make_encoded_frame(make_header(Opcode::StrandKeyframe, 0, snapshot), payload);
  }

  FrameHeader make_header(Opcode opcode, uint32_t base_sequence, const SnapshotInfo& snapshot) const {
    FrameHeader header;
    header.opcode = opcode;
    header.sequence = sequence_;
    header.base_sequence = base_sequence;
    header.flags = bust_flags(snapshot);
    header.sim_time_ns = snapshot.sim_time_ns;
    return header;
  }

  uint32_t sequence_ = 0;
  Snapshot last_;  // without its lattice
  StrandChain chain_;
  PlaneEncoder planes_;
};

class DeltaDecoder : public StrandDecoder {
 public:
  explicit DeltaDecoder(const StrandStreamLimits& limits) : limits_(limits) {}

  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> bytes) override {
    ASSIGN_OR_RETURN(const StrandMessage message, read_strand_message(bytes, kDeltaCodecNumber, limits_));
    RETURN_IF_ERROR(check_chain(message.header, sequence_));
    if (message.header.opcode == Opcode::StrandDelta && message.fixed.quantum_m != quantum_m_)
      return make_error(ErrorCode::BadInput, "lattice step changes from {} to {} m within a chain",
                        quantum_m_, message.fixed.quantum_m);
    auto decoded =
        message.header.opcode == Opcode::StrandKeyframe ? read_keyframe(message) : read_delta(message);
    if (!decoded) return decoded.error();
    auto snapshot = std::make_shared<Snapshot>(make_snapshot(message));
    snapshot->lattice = decoded->lattice;
    RETURN_IF_ERROR(check_decoded(*snapshot, message));
    // Only now, with everything checked, the state moves on.
    chain_ = std::move(decoded).value();
    sequence_ = message.header.sequence;
    quantum_m_ = message.fixed.quantum_m;
    return std::shared_ptr<const Snapshot>(std::move(snapshot));
  }

 private:
  Result<StrandChain> read_keyframe(const StrandMessage& message) {
    StrandChain chain;
    chain.strand_count = limits_.strand_count;
    chain.vertex_count = limits_.vertex_count;
    std::vector<int32_t> distance(chain.strand_count);
    auto rest = planes_.fill(message.body, distance);
    if (!rest) return at("neighbours", rest.error());
    ASSIGN_OR_RETURN(chain.neighbour, neighbours_from(distance));
    rest = planes_.fill(*rest, distance);
    if (!rest) return at("second neighbours", rest.error());
    ASSIGN_OR_RETURN(chain.second_neighbour, neighbours_from(distance));
    chain.lattice.resize(3 * chain.plane_size());
    rest = planes_.fill(*rest, chain.lattice);
    if (!rest) return at("shape", rest.error());
    for_each_guess(chain, chain.lattice.data(), [&](size_t i, int32_t guess) {
      chain.lattice[i] = wrapping_sum(chain.lattice[i], guess);
    });
    chain.velocity.resize(chain.lattice.size());
    rest = planes_.fill(*rest, chain.velocity);
    if (!rest) return at("velocity", rest.error());
    chain.residual.resize(chain.lattice.size());
    rest = planes_.fill(*rest, chain.residual);
    if (!rest) return at("residual", rest.error());
    RETURN_IF_ERROR(check_nothing_left(*rest));
    return chain;
  }

  Result<StrandChain> read_delta(const StrandMessage& message) {
    ByteReader reader(message.body);
    const auto weight_bytes = reader.take_bytes(kWeightBytes);
    if (!reader.ok())
      return make_error(ErrorCode::BadInput, "delta of {} bytes has no room for its weights",
                        message.body.size());
    PredictorWeights weights;
    static_assert(sizeof(weights) == kWeightBytes);
    std::memcpy(&weights, weight_bytes.data(), kWeightBytes);
    StrandChain chain;
    chain.strand_count = chain_.strand_count;
    chain.vertex_count = chain_.vertex_count;
    chain.residual.resize(3 * chain.plane_size());
    auto rest = planes_.fill(reader.rest(), chain.residual);
    if (!rest) return at("residual", rest.error());
    RETURN_IF_ERROR(check_nothing_left(*rest));
    chain.velocity = find_velocity(chain_, weights, chain.residual);
    chain.lattice.resize(chain.velocity.size());
    for (size_t i = 0; i < chain.lattice.size(); ++i)
      chain.lattice[i] = wrapping_sum(chain_.lattice[i], chain.velocity[i]);
    chain.neighbour = chain_.neighbour;
    chain.second_neighbour = chain_.second_neighbour;
    return chain;
  }

  static Status check_nothing_left(std::span<const std::byte> rest) {
    if (rest.empty()) return {};
    return make_error(ErrorCode::BadInput, "{} bytes follow the last block of a strand payload", rest.size());
  }

  StrandStreamLimits limits_;
  StrandChain chain_;
  uint32_t sequence_ = 0;
  float quantum_m_ = 0.0f;
  PlaneDecoder planes_;
};

}  // namespace

std::unique_ptr<StrandEncoder> make_delta_encoder() {
  return std::make_unique<DeltaEncoder>();
}
std::unique_ptr<StrandDecoder> make_delta_decoder(const StrandStreamLimits& limits) {
  return std::make_unique<DeltaDecoder>(limits);
}

}  // namespace strandcast
