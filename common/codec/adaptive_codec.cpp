// The "adaptive" codec: the prediction of "delta", whose errors are entropy coded value by value with
// probabilities that depend on the errors near by and on where between two lattice points the prediction
// falls. Strands are worked on in slices along a curve through the roots. Layout in proto/WIRE.md.
#include <utility>

#include "common/base/check.h"
#include "common/codec/adaptive_slice.h"
#include "common/codec/byte_io.h"
#include "common/codec/strand_payload.h"
#include "common/codec/zstd_block.h"

namespace strandcast {
namespace {

constexpr uint8_t kAdaptiveCodecNumber = 2;
constexpr uint32_t kStrandsPerSlice = 1024;
constexpr int kTableLevel = 3;
constexpr size_t kWeightBytes = sizeof(PredictorWeights);
static_assert(kWeightBytes == kRowClassCount * kFeatureCount * sizeof(int16_t));

uint32_t bits_for(uint32_t count) {
  return static_cast<uint32_t>(std::bit_width(count - 1));
}

/// visit(place of a value in codec order, place in strand order) for every value.
template <class Visit>
void for_each_place(const AdaptiveChain& chain, Visit visit) {
  const size_t strands = chain.motion.strand_count;
  for (size_t row = 0; row < 3 * static_cast<size_t>(chain.motion.vertex_count); ++row)
    for (size_t s = 0; s < strands; ++s) visit(row * strands + s, row * strands + chain.order[s]);
}

class AdaptiveEncoder : public StrandEncoder {
 public:
  EncodedFramePtr encode(const Snapshot& snapshot) override {
    CHECK(snapshot.strand_count > 0 && snapshot.vertex_count > 0);
    CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
    const bool continues = snapshot.strand_count == last_.strand_count &&
                           snapshot.vertex_count == last_.vertex_count &&
                           snapshot.quantum_m == last_.quantum_m;
    const uint32_t base_sequence = sequence_++;
    EncodedFramePtr frame;
    if (continues && base_sequence != 0) {
      frame = encode_delta(snapshot, base_sequence);
      last_ = snapshot;
    } else {
      start_chain(snapshot);
      frame = encode_keyframe();
    }
    if (!frame) last_ = {};
    return frame;
  }

  EncodedFramePtr encode_keyframe() override {
    if (last_.lattice.empty()) return nullptr;
    for_each_place(chain_, [&](size_t to, size_t from) { chain_.motion.lattice[to] = last_.lattice[from]; });
    std::vector<std::byte> payload;
    append_fixed_part(last_, kAdaptiveCodecNumber, payload);
    ByteWriter(payload).put(chain_.slice_count);
    std::vector<std::byte> tables;
    zstd_.append(std::as_bytes(std::span(chain_.tables)), kTableLevel, tables);
    ByteWriter(payload).put(static_cast<uint32_t>(tables.size()));
    ByteWriter(payload).put_bytes(tables);
    for (uint32_t slice = 0; slice < chain_.slice_count; ++slice) {
      write_places(chain_.slice_begin(slice), chain_.slice_begin(slice + 1));
      writer_.finish(payload);
    }
    const AdaptiveChain still = without_history(chain_);
    frame_.resize(chain_.motion.lattice.size());
    frame_.velocity = edges_of(chain_.motion);
    write_slices(still, payload);
    frame_.velocity = chain_.motion.velocity;
    write_slices(still, payload);
    frame_.velocity = chain_.motion.residual;
    write_slices(still, payload);
    return make_encoded_frame(make_header(Opcode::StrandKeyframe, 0, last_.sim_time_ns), payload);
  }

 private:
  void start_chain(const Snapshot& snapshot) {
    last_ = snapshot;
    StrandChain& motion = chain_.motion;
    motion.strand_count = snapshot.strand_count;
    motion.vertex_count = snapshot.vertex_count;
    motion.lattice = snapshot.lattice;
    chain_.order = root_curve_order(motion);
    chain_.slice_count = std::clamp(snapshot.strand_count / kStrandsPerSlice, 1u, kMaxSliceCount);
    chain_.tables = make_first_tables();
    for_each_place(chain_, [&](size_t to, size_t from) { motion.lattice[to] = snapshot.lattice[from]; });
    motion.velocity.assign(motion.lattice.size(), 0);
    motion.residual.assign(motion.lattice.size(), 0);
    chain_.magnitude.assign(motion.lattice.size(), 0);
    for (uint32_t slice = 0; slice < chain_.slice_count; ++slice)
      find_neighbours(motion, chain_.slice_begin(slice), chain_.slice_begin(slice + 1));
  }

  EncodedFramePtr encode_delta(const Snapshot& snapshot, uint32_t base_sequence) {
    frame_.resize(snapshot.lattice.size());
    for_each_place(chain_, [&](size_t to, size_t from) {
      frame_.velocity[to] = wrapping_difference(snapshot.lattice[from], last_.lattice[from]);
    });
    std::vector<std::byte> payload;
    append_fixed_part(snapshot, kAdaptiveCodecNumber, payload);
    chain_.tables = write_slices(chain_, payload);
    std::swap(chain_.motion.velocity, frame_.velocity);
    std::swap(chain_.motion.residual, frame_.residual);
    std::swap(chain_.magnitude, frame_.magnitude);
    return make_encoded_frame(make_header(Opcode::StrandDelta, base_sequence, snapshot.sim_time_ns), payload);
  }

  /// Appends frame_.velocity as motion after `chain`; gives the tables as they are afterwards.
  SymbolTables write_slices(const AdaptiveChain& chain, std::vector<std::byte>& payload) {
    const PredictorWeights weights = fit_weights(chain.motion, frame_.velocity);
    ByteWriter(payload).put_bytes(std::as_bytes(std::span(&weights, 1)));
    std::vector<SymbolTables> tables(chain.slice_count, chain.tables);
    for (uint32_t slice = 0; slice < chain.slice_count; ++slice) {
      write_motion(chain, weights, slice, frame_, tables[slice], writer_);
      writer_.finish(payload);
    }
    return mean_tables(tables);
  }

  /// Where the strands of a slice come from and which are their neighbours.
  void write_places(size_t begin, size_t end) {
    SymbolTable table = make_first_tables().front();
    for (size_t s = begin; s < end; ++s) {
      writer_.put_bits(chain_.order[s], bits_for(chain_.motion.strand_count));
      for (const uint32_t n : {chain_.motion.neighbour[s], chain_.motion.second_neighbour[s]})
        writer_.put(static_cast<uint32_t>(s) - n, table, 0);
    }
  }

  FrameHeader make_header(Opcode opcode, uint32_t base_sequence, int64_t sim_time_ns) const {
    FrameHeader header;
    header.opcode = opcode;
    header.sequence = sequence_;
    header.base_sequence = base_sequence;
    header.sim_time_ns = sim_time_ns;
    return header;
  }

  uint32_t sequence_ = 0;
  Snapshot last_;
  AdaptiveChain chain_;
  AdaptiveFrame frame_;
  ValueWriter writer_;
  ZstdCompressor zstd_;
};

class AdaptiveDecoder : public StrandDecoder {
 public:
  explicit AdaptiveDecoder(const StrandStreamLimits& limits) : limits_(limits) {}

  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> bytes) override {
    ASSIGN_OR_RETURN(const StrandMessage message, read_strand_message(bytes, kAdaptiveCodecNumber, limits_));
    RETURN_IF_ERROR(check_chain(message.header, sequence_));
    auto snapshot = std::make_shared<Snapshot>(make_snapshot(message));
    if (message.header.opcode == Opcode::StrandKeyframe)
      RETURN_IF_ERROR(read_keyframe(message, *snapshot));
    else
      RETURN_IF_ERROR(read_delta(message, *snapshot));
    sequence_ = message.header.sequence;
    last_ = std::move(snapshot);
    return last_;
  }

 private:
  Status read_keyframe(const StrandMessage& message, Snapshot& snapshot) {
    AdaptiveChain chain;
    StrandChain& motion = chain.motion;
    motion.strand_count = limits_.strand_count;
    motion.vertex_count = limits_.vertex_count;
    ByteReader body(message.body);
    chain.slice_count = body.take<uint32_t>();
    if (chain.slice_count < 1 || chain.slice_count > std::min(kMaxSliceCount, motion.strand_count))
      return make_error(ErrorCode::BadInput, "keyframe has {} slices, not 1..{}", chain.slice_count,
                        std::min(kMaxSliceCount, motion.strand_count));
    const auto table_bytes = body.take<uint32_t>();
    const auto packed_tables = body.take_bytes(table_bytes);
    if (!body.ok())
      return make_error(ErrorCode::BadInput, "symbol tables of {} bytes are cut off, the keyframe has {}",
                        table_bytes, message.body.size());
    if (auto filled = zstd_.fill(packed_tables, std::as_writable_bytes(std::span(chain.tables))); !filled)
      return at("symbol tables", filled.error());
    RETURN_IF_ERROR(check_tables(chain.tables));

    chain.order.resize(motion.strand_count);
    motion.neighbour.resize(motion.strand_count);
    motion.second_neighbour.resize(motion.strand_count);
    std::span<const std::byte> rest = body.rest();
    std::vector<bool> is_placed(motion.strand_count);
    for (uint32_t slice = 0; slice < chain.slice_count; ++slice) {
      ASSIGN_OR_RETURN(rest, reader_.open(rest));
      RETURN_IF_ERROR(read_places(chain, chain.slice_begin(slice), chain.slice_begin(slice + 1), is_placed));
      RETURN_IF_ERROR(check_spent(slice));
    }
    const AdaptiveChain still = without_history(chain);
    SymbolTables unused;
    for (auto* values : {&motion.lattice, &motion.velocity, &motion.residual}) {
      ASSIGN_OR_RETURN(rest, read_slices(still, rest, unused));
      *values = frame_.velocity;
    }
    RETURN_IF_ERROR(check_nothing_left(rest));
    motion.lattice = lattice_of(motion, std::move(motion.lattice));
    snapshot.lattice.resize(motion.lattice.size());
    for_each_place(chain, [&](size_t from, size_t to) { snapshot.lattice[to] = motion.lattice[from]; });
    RETURN_IF_ERROR(check_decoded(snapshot, message));
    chain.magnitude.resize(motion.residual.size());
    for (size_t i = 0; i < chain.magnitude.size(); ++i)
      chain.magnitude[i] = residual_magnitude(motion.residual[i]);
    chain_ = std::move(chain);
    return {};
  }

  Status read_delta(const StrandMessage& message, Snapshot& snapshot) {
    if (message.fixed.quantum_m != last_->quantum_m)
      return make_error(ErrorCode::BadInput, "lattice step changes from {} to {} m within a chain",
                        last_->quantum_m, message.fixed.quantum_m);
    SymbolTables tables;
    ASSIGN_OR_RETURN(const auto rest, read_slices(chain_, message.body, tables));
    RETURN_IF_ERROR(check_nothing_left(rest));
    snapshot.lattice.resize(frame_.velocity.size());
    for_each_place(chain_, [&](size_t from, size_t to) {
      snapshot.lattice[to] = wrapping_sum(last_->lattice[to], frame_.velocity[from]);
    });
    RETURN_IF_ERROR(check_decoded(snapshot, message));
    // Only now, with everything checked, the state moves on.
    chain_.tables = tables;
    std::swap(chain_.motion.velocity, frame_.velocity);
    std::swap(chain_.motion.residual, frame_.residual);
    std::swap(chain_.magnitude, frame_.magnitude);
    return {};
  }

  /// Fills frame_ with what write_slices wrote and gives the bytes behind it.
  Result<std::span<const std::byte>> read_slices(const AdaptiveChain& chain,
                                                 std::span<const std::byte> source,
                                                 SymbolTables& tables_afterwards) {
    ByteReader body(source);
    const auto weight_bytes = body.take_bytes(kWeightBytes);
    if (!body.ok())
      return make_error(ErrorCode::BadInput, "{} bytes have no room for the weights", source.size());
    PredictorWeights weights;
    std::memcpy(&weights, weight_bytes.data(), kWeightBytes);
    std::vector<SymbolTables> tables(chain.slice_count, chain.tables);
    frame_.resize(chain.motion.velocity.size());
    std::span<const std::byte> rest = body.rest();
    for (uint32_t slice = 0; slice < chain.slice_count; ++slice) {
      ASSIGN_OR_RETURN(rest, reader_.open(rest));
      read_motion(chain, weights, slice, frame_, tables[slice], reader_);
      RETURN_IF_ERROR(check_spent(slice));
    }
    tables_afterwards = mean_tables(tables);
    return rest;
  }

  Status read_places(AdaptiveChain& chain, size_t begin, size_t end, std::vector<bool>& is_placed) {
    SymbolTable table = make_first_tables().front();
    for (size_t s = begin; s < end; ++s) {
      const uint32_t strand = reader_.take_bits(bits_for(chain.motion.strand_count));
      if (strand >= chain.motion.strand_count || is_placed[strand])
        return make_error(ErrorCode::BadInput, "place {} holds strand {}, which is {}", s, strand,
                          strand < chain.motion.strand_count ? "placed already" : "not one of them");
      is_placed[strand] = true;
      chain.order[s] = strand;
      for (auto* neighbour : {&chain.motion.neighbour, &chain.motion.second_neighbour}) {
        const uint32_t distance = reader_.take(table, 0);
        if (distance > s - begin)
          return make_error(ErrorCode::BadInput, "neighbour of place {} lies {} places before it", s,
                            distance);
        (*neighbour)[s] = static_cast<uint32_t>(s) - distance;
      }
    }
    return {};
  }

  static Status check_tables(const SymbolTables& tables) {
    for (size_t i = 0; i < kTableCount; ++i) {
      bool is_rising = tables[i].start[0] == 0;
      for (uint32_t k = 0; k < kSymbolCount; ++k) is_rising &= tables[i].share(k) > 0;
      if (!is_rising) return make_error(ErrorCode::BadInput, "symbol table {} does not rise from 0", i);
    }
    return {};
  }

  Status check_spent(uint32_t slice) const {
    if (reader_.is_spent()) return {};
    return make_error(ErrorCode::BadInput, "slice {} does not end where its symbols end", slice);
  }

  static Status check_nothing_left(std::span<const std::byte> rest) {
    if (rest.empty()) return {};
    return make_error(ErrorCode::BadInput, "{} bytes follow the last slice of a strand payload", rest.size());
  }

  StrandStreamLimits limits_;
  uint32_t sequence_ = 0;
  std::shared_ptr<const Snapshot> last_;
  AdaptiveChain chain_;
  AdaptiveFrame frame_;
  ValueReader reader_;
  ZstdDecompressor zstd_;
};

}  // namespace

std::unique_ptr<StrandEncoder> make_adaptive_encoder() {
  return std::make_unique<AdaptiveEncoder>();
}
std::unique_ptr<StrandDecoder> make_adaptive_decoder(const StrandStreamLimits& limits) {
  return std::make_unique<AdaptiveDecoder>(limits);
}

}  // namespace strandcast
