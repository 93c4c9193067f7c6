// The "tangent" codec: made for strands. Positions are predicted from the motion of the strand and of its
// neighbours and from the known length of each segment; what is coded are two small integers across the
// segment, chosen as cheap as the announced bound allows. Every decoded vertex lies within that bound.
// Layout in proto/WIRE.md.
#include "common/strands/tangent/codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/worker_pool.h"
#include "common/strands/byte_io.h"
#include "common/strands/step/steps.h"
#include "common/strands/strand_payload.h"
#include "common/strands/tangent/chain.h"
#include "common/strands/tangent/fine_symbols.h"
#include "common/strands/tangent/order.h"
#include "common/strands/wrapping.h"
#include "common/strands/zstd_block.h"

namespace strandcast::tangent {
namespace {

constexpr uint8_t kTangentNumber = 5;
constexpr uint8_t kStepNumber = 16;
/// The same, whose fine anchors are told otherwise (Rounding).
constexpr uint8_t kThirdFineNumber = 15;
constexpr uint8_t kSecondFineNumber = 14;
constexpr uint8_t kFirstFineNumber = 13;
/// Of the release 0.2.0: the same without fine anchors and graded fields.
constexpr uint8_t kFirstStepNumber = 12;
constexpr int kTableLevel = 3;
constexpr uint8_t kAnchorFlag = 1;

/// Of a delta, as it is on the wire; followed by the weights of the shape when it is an anchor, those of
/// the motion, and the slices.
struct BodyHead {
  uint8_t flags = 0;
  uint8_t length_blend = 0;
};

/// By what frames may be predicted.
enum class Prediction { Motion, Steps };
constexpr uint8_t codec_number(Prediction prediction) {
  return prediction == Prediction::Steps ? kStepNumber : kTangentNumber;
}

constexpr step::Rounding fine_of(uint8_t number) {
  if (number == kFirstFineNumber) return step::Rounding::FirstFine;
  if (number == kSecondFineNumber) return step::Rounding::SecondFine;
  return number == kThirdFineNumber ? step::Rounding::ThirdFine : step::Rounding::Fine;
}

/// Has the frame be an anchor that is rounded so.
void be_anchor(Frame& frame, step::Rounding rounding) {
  frame.anchor_share = rounding == step::Rounding::Coarse ? 1.0f : kFineShare;
  frame.beside = step::beside_of(rounding);
}

/// Flags of an exact frame, which has no integers.
constexpr uint8_t kExactFlags = step::kStepFlag | step::kSparseFlag;

/// Returns whether every vertex is where the step led, within one lattice step: floats round differently.
bool is_foretold(const Planes<int32_t>& expected, const Planes<int32_t>& target) {
  for (size_t axis = 0; axis < 3; ++axis)
    for (size_t i = 0; i < target[axis].size(); ++i)
      if (wrapping_difference(expected[axis][i], target[axis][i]) + 1u > 2u) return false;
  return true;
}

/// How many slices a thread works on side by side, so that every thread has some.
uint32_t slices_at_once(const Layout& layout, const WorkerPool::Terms& terms) {
  return std::clamp(layout.slice_count() / terms.workers(), 1u, kMostSlicesAtOnce);
}

/// work(first, count) for all slices, some of them at a time.
template <class Work>
void for_each_slices(const Layout& layout, const WorkerPool::Terms& terms, Work work) {
  const uint32_t count = layout.slice_count();
  const uint32_t at_once = slices_at_once(layout, terms);
  for_each_part(terms, (count + at_once - 1) / at_once,
                [&](uint32_t group) { work(group * at_once, std::min(at_once, count - group * at_once)); });
}

class Encoder final : public StrandEncoder {
 public:
  Encoder(WorkerPool& workers, simd::InstructionSet set, Prediction prediction)
      : workers_(workers), set_(set), number_(codec_number(prediction)) {
    if (prediction == Prediction::Steps) steps_.emplace(workers, set);
  }

  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m) override {
    rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
    if (steps_) steps_->set_rest_shape(rest_in_head_m);
    has_chain_ = false;
  }

  EncodedFramePtr encode(const Snapshot& snapshot) override {
    return continues(snapshot) ? checked(encode_delta(snapshot)) : start(snapshot);
  }

  JoinFrames encode_for_join(const Snapshot& snapshot) override {
    if (!continues(snapshot)) {
      const EncodedFramePtr keyframe = start(snapshot);
      return {keyframe, keyframe};
    }
    JoinFrames frames = encode_anchor(snapshot, Followers::Some);
    checked(frames.frame);
    return frames;
  }

  void set_state(std::shared_ptr<const SharedState> state) override {
    if (steps_) steps_->set_state(std::move(state));
  }
  uint64_t step_count() const override { return steps_ ? steps_->step_count() : 0; }
  std::shared_ptr<SharedUpdate> take_shared(SharedStates which) override {
    if (!steps_ || !has_chain_ || which == SharedStates::None) return nullptr;
    auto update = steps_->take_shared(which, layout_, chain_.history);
    if (update != nullptr) update->sequence = sequence_;
    return update;
  }

 private:
  /// Whether anybody has the frame before an anchor.
  enum class Followers { None, Some };
  using Slices = std::vector<std::vector<std::byte>>;
  /// Of what a frame decodes to.
  struct State {
    const SnapshotInfo& info;
    uint64_t hash;
  };

  bool continues(const Snapshot& snapshot) const {
    return has_chain_ && snapshot.strand_count == layout_.strand_count &&
           snapshot.vertex_count == layout_.vertex_count && snapshot.quantum_m == chain_.history.quantum_m;
  }

  EncodedFramePtr start(const Snapshot& snapshot) {
    CHECK(snapshot.strand_count > 0 && snapshot.vertex_count > 0 && snapshot.quantum_m > 0.0f);
    CHECK(snapshot.lattice.size() == 3 * snapshot.plane_size());
    const bool has_rest = rest_in_head_m_.size() == snapshot.plane_size();
    layout_ =
        make_layout(snapshot.strand_count, snapshot.vertex_count,
                    has_rest ? std::span<const glm::vec3>(rest_in_head_m_) : std::span<const glm::vec3>());
    chain_.reset(layout_);
    chain_.history.quantum_m = snapshot.quantum_m;
    // As if the strands had always been where they are: the first frame is an anchor that nobody follows.
    for (auto& plane : target_) plane.assign(layout_.plane_size(), 0);
    take(snapshot);
    chain_.history.lattice = target_;
    chain_.history.head.pose = snapshot.world_from_head;
    frame_.resize(layout_);
    next_sizes_.reset(layout_);
    no_sizes_.reset(layout_);
    has_chain_ = true;
    if (steps_) steps_->restart(snapshot, layout_);
    return checked(encode_anchor(snapshot, Followers::None).keyframe);
  }

  /// Too large a frame ends the chain.
  EncodedFramePtr checked(EncodedFramePtr frame) {
    if (frame == nullptr) has_chain_ = false;
    return frame;
  }

  void take(const Snapshot& snapshot) {
    for_each_part(encode_terms(layout_, workers_), 3 * layout_.vertex_count, [&](uint32_t row) {
      take_row(set_, {layout_, snapshot, target_, row % 3, row / 3});
    });
  }

  /// What every frame begins with.
  void begin(const Snapshot& snapshot, Followers followers) {
    flags_ = 0;
    const bool has_steps = steps_ && followers == Followers::Some;
    if (has_steps) steps_->begin(snapshot, layout_);
    if (!has_steps || !steps_->is_handing()) take(snapshot);
    if (has_steps) flags_ = steps_->predict(snapshot, layout_, chain_.history, target_);
    is_foretold_ = has_steps && flags_ == kExactFlags && snapshot.bust == steps_->chest() &&
                   (steps_->is_handing() || is_foretold(chain_.history.lattice, target_));
    if (has_steps && steps_->is_handing() && !is_foretold_) target_ = chain_.history.lattice;
    if ((flags_ & step::kStepFlag) != 0)
      frame_.head = {snapshot.world_from_head, {}};
    else
      frame_.head = chain_.history.head.followed_by(snapshot.world_from_head, snapshot.quantum_m);
    if ((flags_ & step::kSparseFlag) == 0)
      fit_motion(set_, layout_, chain_.history, target_, workers_, frame_);
    writers_.resize(layout_.slice_count());
  }

  /// What every frame ends with.
  void end(const Snapshot& snapshot) {
    remember(chain_.history, frame_);
    if (steps_) steps_->finish(snapshot, frame_, chain_.history);
    chain_.head.follow(snapshot, (flags_ & kAnchorFlag) != 0);
  }

  EncodedFramePtr encode_delta(const Snapshot& snapshot) {
    begin(snapshot, Followers::Some);
    if (is_foretold_) return encode_exact(snapshot);
    if ((flags_ & step::kSparseFlag) != 0) return encode_sparse(snapshot);
    for (auto& escapes : frame_.codes.escapes) escapes.clear();
    std::vector<Tables> tables(layout_.slice_count(), chain_.tables);
    Slices slices(layout_.slice_count());
    for_each_slices(layout_, encode_terms(layout_, workers_), [&](uint32_t first, uint32_t count) {
      for (uint32_t slice = first; slice < first + count; ++slice) {
        quantise_slice(set_, {{layout_, chain_.history, slice, frame_}, target_});
        write_symbols(
            set_, {layout_, slice, frame_.codes, chain_.sizes, next_sizes_, tables[slice], writers_[slice]});
      }
      finish(first, count, slices);
    });
    chain_.tables = mean_tables(tables);
    end(snapshot);
    chain_.learn(next_sizes_);
    return make_delta(state_of(snapshot), slices);
  }

  /// After begin(), for a frame that steps tell nearly all of.
  EncodedFramePtr encode_sparse(const Snapshot& snapshot) {
    for (auto& escapes : frame_.codes.escapes) escapes.clear();
    for_each_part(encode_terms(layout_, workers_), layout_.slice_count(), [&](uint32_t slice) {
      quantise_step(set_, {{layout_, chain_.history, slice, frame_}, target_});
    });
    next_blocks_.resize(chain_.blocks.size());
    write_sparse({layout_, chain_.sizes, next_sizes_, chain_.blocks, next_blocks_, chain_.sparse_tables},
                 frame_.codes, writers_[0]);
    remember_step(chain_.history, frame_);
    steps_->finish(snapshot, frame_, chain_.history);
    chain_.head.follow(snapshot, false);
    chain_.learn(next_sizes_);
    std::swap(chain_.blocks, next_blocks_);
    Slices slices(1);
    writers_[0].finish(slices[0]);
    frame_.length_blend = 0;
    return make_delta(state_of(snapshot), slices);
  }

  /// After begin(), for a frame that steps tell all of.
  EncodedFramePtr encode_exact(const Snapshot& snapshot) {
    steps_->finish_exact(snapshot);
    remember_exact(chain_.history, snapshot.world_from_head);
    chain_.forget_integers(layout_);
    std::vector<std::byte> head;
    chain_.head.write(snapshot, head);
    chain_.head.follow(snapshot, false);
    std::vector<std::byte> payload;
    ByteWriter writer(payload);
    writer.put(static_cast<uint8_t>(number_ | step::kExactBit));
    writer.put(state_of(snapshot).hash);
    steps_->append_bytes(head, payload);
    return make_encoded_frame(delta_header(snapshot), payload);
  }

  JoinFrames encode_anchor(const Snapshot& snapshot, Followers followers) {
    begin(snapshot, followers);
    const bool is_exact = is_foretold_;
    if (is_exact) target_ = chain_.history.lattice;
    if ((flags_ & step::kSparseFlag) != 0) {
      // Who joins is told of the shape, which needs weights.
      flags_ &= static_cast<uint8_t>(~step::kSparseFlag);
      fit_motion(set_, layout_, chain_.history, target_, workers_, frame_);
    }
    flags_ |= kAnchorFlag;
    if (is_exact) flags_ |= step::kFineFlag;
    const step::Rounding rounding = is_exact ? step::Rounding::Fine : step::Rounding::Coarse;
    be_anchor(frame_, rounding);
    if (steps_) steps_->begin_anchor(rounding);
    frame_.shape_weights =
        fit_shape(set_, layout_, {layout_.*frame_.beside, is_exact}, snapshot.quantum_m, target_, workers_);
    for (auto& escapes : frame_.shape_codes.escapes) escapes.clear();
    Slices slices(layout_.slice_count());
    Slices shape_slices(layout_.slice_count());
    const auto quantise = [&](uint32_t slice) {
      quantise_anchor(set_, {{layout_, chain_.history, slice, frame_}, target_});
    };
    for (uint32_t slice = 0; is_exact && slice < layout_.slice_count(); ++slice) quantise(slice);
    for_each_slices(layout_, encode_terms(layout_, workers_), [&](uint32_t first, uint32_t count) {
      for (uint32_t slice = first; slice < first + count; ++slice) {
        if (!is_exact) quantise(slice);
        if (followers == Followers::None) continue;
        Tables tables = chain_.tables;
        write_symbols(set_,
                      {layout_, slice, frame_.codes, chain_.sizes, next_sizes_, tables, writers_[slice]});
      }
      if (followers == Followers::Some) finish(first, count, slices);
      if (is_exact) return;
      for (uint32_t slice = first; slice < first + count; ++slice) {
        Tables tables = chain_.tables;
        write_symbols(set_,
                      {layout_, slice, frame_.shape_codes, no_sizes_, next_sizes_, tables, writers_[slice]});
      }
      finish(first, count, shape_slices);
    });
    if (is_exact) {
      chain_.forget_tables();
      shape_slices.resize(1);
      write_fine(layout_, frame_.shape_codes, writers_[0]);
      writers_[0].finish(shape_slices[0]);
    }
    end(snapshot);
    chain_.forget_motion(layout_);
    if (steps_) steps_->settle(chain_.history);
    const State state = state_of(snapshot);
    JoinFrames frames;
    if (followers == Followers::Some)
      frames.frame = make_delta(state, slices);
    else
      ++sequence_;
    frames.keyframe = make_keyframe(state, shape_slices);
    return frames;
  }

  void finish(uint32_t first, uint32_t count, Slices& slices) {
    ValueWriter::finish_all(std::span(writers_).subspan(first, count),
                            std::span(slices).subspan(first, count));
  }

  /// Returns the state of the history's last frame.
  State state_of(const SnapshotInfo& info) const {
    return {info, hash_planes(layout_, chain_.history.lattice, info)};
  }

  FrameHeader delta_header(const SnapshotInfo& info) {
    FrameHeader header;
    header.opcode = Opcode::StrandDelta;
    header.base_sequence = sequence_++;
    header.sequence = sequence_;
    header.sim_time_ns = info.sim_time_ns;
    return header;
  }

  /// Of the next frame of the chain, with a body for everybody who follows.
  EncodedFramePtr make_delta(const State& state, const Slices& slices) {
    const BodyHead head{flags_, frame_.length_blend};
    std::vector<std::byte> body;
    body.reserve(sizeof(head) + sizeof(frame_.weights) + sizeof(frame_.shape_weights) + layout_.plane_size());
    ByteWriter writer(body);
    writer.put_bytes(std::as_bytes(std::span(&head, 1)));
    if (steps_) steps_->append_bytes({}, body);
    if ((flags_ & kAnchorFlag) != 0) writer.put_bytes(std::as_bytes(std::span(frame_.shape_weights)));
    if ((flags_ & step::kSparseFlag) == 0) {
      ValueWriter weights;
      write_weights(motion_class_count(layout_), frame_.weights, weights);
      weights.finish(body);
    }
    for (const auto& slice : slices) writer.put_bytes(slice);
    return make_frame(delta_header(state.info), state, body);
  }

  /// Of the same frame, for a joiner.
  EncodedFramePtr make_keyframe(const State& state, const Slices& slices) {
    std::vector<std::byte> body(sizeof(uint32_t));
    body.reserve(2 * layout_.plane_size());
    std::vector<std::byte> tables(sizeof(Tables) + (steps_ ? sizeof(SparseTables) : 0));
    std::memcpy(tables.data(), &chain_.tables, sizeof(Tables));
    if (steps_) std::memcpy(tables.data() + sizeof(Tables), &chain_.sparse_tables, sizeof(SparseTables));
    zstd_.append(tables, kTableLevel, body);
    const auto packed_bytes = static_cast<uint32_t>(body.size() - sizeof(uint32_t));
    std::memcpy(body.data(), &packed_bytes, sizeof packed_bytes);
    ByteWriter writer(body);
    if (steps_) steps_->append_state(body);
    writer.put_bytes(std::as_bytes(std::span(frame_.shape_weights)));
    for (const auto& slice : slices) writer.put_bytes(slice);
    FrameHeader header;
    header.opcode = Opcode::StrandKeyframe;
    header.sequence = sequence_;
    header.sim_time_ns = state.info.sim_time_ns;
    return make_frame(header, state, body);
  }

  EncodedFramePtr make_frame(FrameHeader header, const State& state, std::span<const std::byte> body) const {
    std::vector<std::byte> payload;
    payload.reserve(kStrandFixedBytes + body.size());
    header.flags = bust_flags(state.info);
    append_fixed_part(state.info, state.hash, number_, payload);
    ByteWriter(payload).put_bytes(body);
    return make_encoded_frame(header, payload);
  }

  WorkerPool& workers_;
  simd::InstructionSet set_;
  const uint8_t number_;
  std::optional<step::EncoderSteps> steps_;
  std::vector<glm::vec3> rest_in_head_m_;
  Layout layout_;
  Chain chain_;
  uint8_t flags_ = 0;         // of the frame at work
  bool is_foretold_ = false;  // steps tell all of it
  Frame frame_;
  SymbolSizes next_sizes_;
  SymbolSizes no_sizes_;
  BlockCounts next_blocks_;
  // Kept for their memory.
  Planes<int32_t> target_;
  std::vector<ValueWriter> writers_;
  ZstdCompressor zstd_;
  uint32_t sequence_ = 0;
  bool has_chain_ = false;
};

class Decoder final : public StrandDecoder {
 public:
  Decoder(const StrandStreamLimits& limits, WorkerPool& workers, simd::InstructionSet set,
          std::unique_ptr<step::StepReader> steps)
      : set_(set),
        number_(codec_number(steps ? Prediction::Steps : Prediction::Motion)),
        steps_(std::move(steps)),
        limits_(limits),
        workers_(workers) {}

  void set_rest_shape(std::span<const glm::vec3> rest_in_head_m) override {
    const bool fits = rest_in_head_m.size() == size_t{limits_.strand_count} * limits_.vertex_count;
    reset_layout(fits ? rest_in_head_m : std::span<const glm::vec3>());
  }

  Result<std::shared_ptr<const Snapshot>> decode(std::span<const std::byte> bytes) override {
    if (is_exact(bytes)) return decode_exact(bytes);
    const uint8_t number = spoken_number(bytes);
    ASSIGN_OR_RETURN(const StrandMessage message, read_strand_message(bytes, number, limits_));
    RETURN_IF_ERROR(check_chain(message.header, sequence_));
    if (layout_.strand_count == 0) reset_layout({});
    auto snapshot = std::make_shared<Snapshot>(make_snapshot(message));
    if (message.header.opcode == Opcode::StrandKeyframe)
      RETURN_IF_ERROR(read_keyframe(message, number, *snapshot));
    else
      RETURN_IF_ERROR(read_delta(message, *snapshot));
    chain_number_ = number;
    sequence_ = message.header.sequence;
    return std::shared_ptr<const Snapshot>(std::move(snapshot));
  }

 private:
  /// Number that a message may have, a keyframe any that is known; one of another number is refused.
  uint8_t spoken_number(std::span<const std::byte> bytes) const {
    if (steps_ == nullptr || bytes.size() <= kFrameHeaderBytes) return number_;
    const auto told =
        static_cast<uint8_t>(std::to_integer<uint8_t>(bytes[kFrameHeaderBytes]) & ~step::kExactBit);
    if (bytes[0] != std::byte{uint8_t(Opcode::StrandKeyframe)}) return chain_number_;
    return told >= kFirstStepNumber && told < number_ ? told : number_;
  }
  bool is_exact(std::span<const std::byte> bytes) const {
    return steps_ && bytes.size() > kFrameHeaderBytes &&
           bytes[0] == std::byte{uint8_t(Opcode::StrandDelta)} &&
           (std::to_integer<uint8_t>(bytes[kFrameHeaderBytes]) ^ step::kExactBit) == spoken_number(bytes);
  }

  Result<std::shared_ptr<const Snapshot>> decode_exact(std::span<const std::byte> bytes) {
    StrandMessage message;
    ASSIGN_OR_RETURN(message.header, read_strand_header(bytes));
    RETURN_IF_ERROR(check_chain(message.header, sequence_));
    ByteReader head(bytes.subspan(kFrameHeaderBytes + 1));
    message.fixed.state_hash = head.take<uint64_t>();
    message.body = head.rest();
    head.take<uint16_t>();  // the check
    const size_t head_begin = head.rest().size();
    RETURN_IF_ERROR(chain_.head.read(head, message));
    RETURN_IF_ERROR(check_numbers(message));
    auto snapshot = std::make_shared<Snapshot>(make_snapshot(message));
    const step::Moment moment{snapshot->tick, snapshot->sim_time_ns, snapshot->world_from_head};
    ByteReader body(message.body);
    RETURN_IF_ERROR(
        steps_->begin({kExactFlags, head_begin - head.rest().size()}, moment, layout_, body, chain_.history));
    snapshot->bust = steps_->chest();
    Status status = give(message, chain_.history.lattice, *snapshot);
    if (status && !body.rest().empty())
      status = make_error(ErrorCode::BadInput, "{} bytes follow an exact frame", body.rest().size());
    if (!status) {
      steps_->abandon(chain_.history);
      return status.error();
    }
    // Only now, with everything checked, the state moves on.
    remember_exact(chain_.history, snapshot->world_from_head);
    steps_->finish_exact(moment);
    chain_.forget_integers(layout_);
    chain_.head.follow(*snapshot, false);
    sequence_ = message.header.sequence;
    return std::shared_ptr<const Snapshot>(std::move(snapshot));
  }

  void reset_layout(std::span<const glm::vec3> rest_in_head_m) {
    layout_ = make_layout(limits_.strand_count, limits_.vertex_count, rest_in_head_m);
    frame_.resize(layout_);
    next_sizes_.reset(layout_);
    no_sizes_.reset(layout_);
    sequence_ = 0;
    if (steps_) steps_->restart(rest_in_head_m);
  }

  Status read_keyframe(const StrandMessage& message, uint8_t number, Snapshot& snapshot) {
    Chain chain;
    chain.reset(layout_);
    chain.history.quantum_m = message.fixed.quantum_m;
    ByteReader body(message.body);
    const auto table_bytes = body.take<uint32_t>();
    const auto packed = body.take_bytes(table_bytes);
    const step::Moment moment{snapshot.tick, snapshot.sim_time_ns, snapshot.world_from_head, snapshot.bust};
    step::Rounding rounding = step::Rounding::Coarse;
    if (steps_ && body.ok()) {
      ASSIGN_OR_RETURN(rounding, steps_->read_state(body, moment, layout_, fine_of(number)));
    }
    be_anchor(frame_, rounding);
    take_into(body, frame_.shape_weights);
    if (!body.ok())
      return make_error(ErrorCode::BadInput, "keyframe of {} bytes is cut off in its tables or weights",
                        message.body.size());
    RETURN_IF_ERROR(read_tables(packed, chain));
    const auto place = [&](uint32_t slice) { place_shape(set_, {layout_, chain.history, slice, frame_}); };
    Tables tables = chain.tables;
    if (rounding == step::Rounding::Fine) {
      RETURN_IF_ERROR(read_fine_shape(body.rest(), frame_.shape_codes));
      for (uint32_t slice = 0; slice < layout_.slice_count(); ++slice) place(slice);
    } else if (rounding != step::Rounding::Coarse) {
      RETURN_IF_ERROR(read_slices_in_turn(body.rest(), tables, frame_.shape_codes));
      for (uint32_t slice = 0; slice < layout_.slice_count(); ++slice) place(slice);
    } else {
      RETURN_IF_ERROR(read_slices(body.rest(), tables, no_sizes_, frame_.shape_codes, place));
    }
    RETURN_IF_ERROR(give(message, frame_.lattice, snapshot));
    // Only now, with everything checked, the state moves on.
    frame_.head = {snapshot.world_from_head, {}};
    remember(chain.history, frame_);
    chain.forget_motion(layout_);
    chain.head.follow(snapshot, true);
    chain_ = std::move(chain);
    if (steps_) steps_->take_over(moment, chain_.history);
    return {};
  }

  Status read_delta(const StrandMessage& message, Snapshot& snapshot) {
    if (message.fixed.quantum_m != chain_.history.quantum_m)
      return make_error(ErrorCode::BadInput, "lattice step changes from {} to {} m within a chain",
                        chain_.history.quantum_m, message.fixed.quantum_m);
    ByteReader body(message.body);
    ASSIGN_OR_RETURN(const BodyHead head, read_head(body));
    const step::Moment moment{snapshot.tick, snapshot.sim_time_ns, snapshot.world_from_head};
    if (steps_)
      RETURN_IF_ERROR(
          steps_->begin({head.flags, 0, fine_of(chain_number_)}, moment, layout_, body, chain_.history));
    Learnt learnt{chain_.tables, chain_.sparse_tables};
    const bool is_sparse = (head.flags & step::kSparseFlag) != 0;
    const Status status = is_sparse ? read_sparse_positions(body, message, snapshot, learnt)
                                    : read_positions(head, body, message, snapshot, learnt.tables);
    if (!status) {
      if (steps_) steps_->abandon(chain_.history);
      return status;
    }
    // Only now, with everything checked, the state moves on.
    (is_sparse ? remember_step : remember)(chain_.history, frame_);
    if (steps_) steps_->finish(moment, frame_, chain_.history);
    chain_.head.follow(snapshot, (head.flags & kAnchorFlag) != 0);
    if ((head.flags & kAnchorFlag) != 0) {
      chain_.forget_motion(layout_);
      if ((head.flags & step::kFineFlag) != 0) chain_.forget_tables();
      if (steps_) steps_->settle(chain_.history);
      return {};
    }
    chain_.tables = learnt.tables;
    chain_.sparse_tables = learnt.sparse;
    chain_.learn(next_sizes_);
    if (is_sparse) std::swap(chain_.blocks, next_blocks_);
    return {};
  }

  /// Tables that a frame leaves behind.
  struct Learnt {
    Tables tables;
    SparseTables sparse;
  };

  Status read_sparse_positions(ByteReader& body, const StrandMessage& message, Snapshot& snapshot,
                               Learnt& learnt) {
    ValueReader reader;
    ASSIGN_OR_RETURN(const auto rest, reader.open(body.rest()));
    if (!rest.empty())
      return make_error(ErrorCode::BadInput, "{} bytes follow the integers of a strand payload", rest.size());
    next_blocks_.resize(chain_.blocks.size());
    read_sparse({layout_, chain_.sizes, next_sizes_, chain_.blocks, next_blocks_, learnt.sparse}, reader,
                frame_.codes);
    if (!reader.is_spent())
      return make_error(ErrorCode::BadInput, "the integers do not end where their symbols end");
    frame_.head = {snapshot.world_from_head, {}};
    for_each_part(decode_terms(layout_, workers_), layout_.slice_count(), [&](uint32_t slice) {
      place_step(set_, {layout_, chain_.history, slice, frame_});
    });
    return give(message, frame_.lattice, snapshot);
  }

  Status read_tables(std::span<const std::byte> packed, Chain& chain) {
    std::vector<std::byte> tables(sizeof(Tables) + (steps_ ? sizeof(SparseTables) : 0));
    if (auto filled = zstd_.fill(packed, tables); !filled) return at("symbol tables", filled.error());
    std::memcpy(&chain.tables, tables.data(), sizeof(Tables));
    if (steps_) std::memcpy(&chain.sparse_tables, tables.data() + sizeof(Tables), sizeof(SparseTables));
    RETURN_IF_ERROR(check_tables(chain.tables));
    RETURN_IF_ERROR(check_tables(chain.sparse_tables.block));
    return check_tables(chain.sparse_tables.vertex);
  }

  Result<BodyHead> read_head(ByteReader& body) const {
    BodyHead head;
    take_into(body, head);
    if (!body.ok()) return make_error(ErrorCode::BadInput, "a delta has no room for what it begins with");
    const auto known = static_cast<uint8_t>(kAnchorFlag | (steps_ ? step::kFlags : 0));
    if ((head.flags & ~known) != 0)
      return make_error(ErrorCode::BadInput, "strand payload has flags {}, known is {}", head.flags, known);
    const bool is_sparse = (head.flags & step::kSparseFlag) != 0;
    if (is_sparse && ((head.flags & step::kStepFlag) == 0 || (head.flags & kAnchorFlag) != 0))
      return make_error(ErrorCode::BadInput, "strand payload has flags {}, which do not go together",
                        head.flags);
    const bool is_fine = (head.flags & step::kFineFlag) != 0;
    if (is_fine && ((head.flags & step::kStepFlag) == 0 || (head.flags & kAnchorFlag) == 0))
      return make_error(ErrorCode::BadInput, "strand payload has flags {}, which do not go together",
                        head.flags);
    if (head.length_blend > kMaxLengthBlend)
      return make_error(ErrorCode::BadInput,
                        "strand payload blends lengths by {}/16, at most {} are possible", head.length_blend,
                        kMaxLengthBlend);
    return head;
  }

  /// Reads what follows the steps of a delta; `tables` learn from it.
  Status read_positions(const BodyHead& head, ByteReader& body, const StrandMessage& message,
                        Snapshot& snapshot, Tables& tables) {
    const bool is_anchor = (head.flags & kAnchorFlag) != 0;
    if (is_anchor) take_into(body, frame_.shape_weights);
    if (!body.ok())
      return make_error(ErrorCode::BadInput, "{} bytes have no room for what a delta begins with",
                        message.body.size());
    frame_.length_blend = head.length_blend;
    const bool is_fine = (head.flags & step::kFineFlag) != 0;
    be_anchor(frame_, is_fine ? fine_of(chain_number_) : step::Rounding::Coarse);
    if ((head.flags & step::kStepFlag) != 0)
      frame_.head = {snapshot.world_from_head, {}};
    else
      frame_.head = chain_.history.head.followed_by(snapshot.world_from_head, snapshot.quantum_m);
    ValueReader weights;
    ASSIGN_OR_RETURN(const auto slices, weights.open(body.rest()));
    read_weights(motion_class_count(layout_), frame_.weights, weights);
    if (!weights.is_spent())
      return make_error(ErrorCode::BadInput, "the weights do not end where their symbols end");
    frame_.apply_weights();
    const auto place = [&](uint32_t slice) {
      (is_anchor ? place_anchor : place_slice)(set_, {layout_, chain_.history, slice, frame_});
    };
    RETURN_IF_ERROR(read_slices(slices, tables, chain_.sizes, frame_.codes, [&](uint32_t slice) {
      if (!is_fine) place(slice);
    }));
    for (uint32_t slice = 0; is_fine && slice < layout_.slice_count(); ++slice) place(slice);
    return give(message, frame_.lattice, snapshot);
  }

  /// Reads the symbols of all slices into `codes` and calls place(slice) for each; bytes left over are
  /// an error. Afterwards `tables` holds what the slices learnt.
  template <class Place>
  Status read_slices(std::span<const std::byte> source, Tables& tables, const SymbolSizes& sizes,
                     Codes& codes, Place place) {
    std::vector<ValueReader> readers(layout_.slice_count());
    ASSIGN_OR_RETURN(const auto rest, open_slices(source, readers));
    if (!rest.empty())
      return make_error(ErrorCode::BadInput, "{} bytes follow the last slice of a strand payload",
                        rest.size());
    std::vector<Tables> learnt(layout_.slice_count(), tables);
    for_each_slices(layout_, decode_terms(layout_, workers_), [&](uint32_t begin, uint32_t count) {
      std::vector<SliceSymbols> symbols;
      for (uint32_t slice = begin; slice < begin + count; ++slice)
        symbols.push_back({slice, learnt[slice], readers[slice]});
      read_symbols(set_, {layout_, sizes, codes, next_sizes_, symbols});
      for (const SliceSymbols& done : symbols) place(done.slice);
    });
    RETURN_IF_ERROR(check_spent(readers));
    tables = mean_tables(learnt);
    return {};
  }

  Status read_fine_shape(std::span<const std::byte> source, Codes& codes) {
    ValueReader reader;
    ASSIGN_OR_RETURN(const auto rest, reader.open(source));
    if (!rest.empty())
      return make_error(ErrorCode::BadInput, "{} bytes follow the last slice of a strand payload",
                        rest.size());
    read_fine(layout_, reader, codes);
    if (!reader.is_spent())
      return make_error(ErrorCode::BadInput, "a fine anchor does not end where its symbols end");
    return {};
  }

  /// Reads `codes` of a fine anchor's slices as of numbers before today's, each with the tables that the one
  /// before ended with.
  Status read_slices_in_turn(std::span<const std::byte> source, Tables& tables, Codes& codes) {
    std::vector<ValueReader> readers(layout_.slice_count());
    ASSIGN_OR_RETURN(const auto rest, open_slices(source, readers));
    if (!rest.empty())
      return make_error(ErrorCode::BadInput, "{} bytes follow the last slice of a strand payload",
                        rest.size());
    for (uint32_t slice = 0; slice < layout_.slice_count(); ++slice) {
      SliceSymbols symbols[] = {{slice, tables, readers[slice]}};
      read_symbols(set_, {layout_, no_sizes_, codes, next_sizes_, symbols, frame_.beside});
    }
    return check_spent(readers);
  }

  /// The decoded positions, once they are checked.
  Status give(const StrandMessage& message, const Planes<int32_t>& lattice, Snapshot& snapshot) const {
    snapshot.lattice.resize(3 * snapshot.plane_size());
    const HashedLattice given = give_planes(layout_, lattice, snapshot);
    return check_decoded(given.is_valid, given.state_hash, message);
  }

  static Result<std::span<const std::byte>> open_slices(std::span<const std::byte> rest,
                                                        std::vector<ValueReader>& readers) {
    for (ValueReader& reader : readers) {
      ASSIGN_OR_RETURN(rest, reader.open(rest));
    }
    return rest;
  }

  static Status check_spent(const std::vector<ValueReader>& readers) {
    for (size_t slice = 0; slice < readers.size(); ++slice)
      if (!readers[slice].is_spent())
        return make_error(ErrorCode::BadInput, "slice {} does not end where its symbols end", slice);
    return {};
  }

  static Status check_tables(std::span<const SymbolTable> tables) {
    for (size_t i = 0; i < tables.size(); ++i) {
      bool is_rising = tables[i].start[0] == 0;
      for (uint32_t k = 1; k < kSymbolCount; ++k) is_rising &= tables[i].start[k] > tables[i].start[k - 1];
      if (!is_rising) return make_error(ErrorCode::BadInput, "symbol table {} does not rise from 0", i);
    }
    return {};
  }

  template <class T>
  static void take_into(ByteReader& reader, T& value) {
    const auto bytes = reader.take_bytes(sizeof(T));
    if (bytes.size() == sizeof(T)) std::memcpy(&value, bytes.data(), sizeof(T));
  }

  simd::InstructionSet set_;
  const uint8_t number_;
  uint8_t chain_number_ = number_;  // of its keyframe
  const std::unique_ptr<step::StepReader> steps_;
  StrandStreamLimits limits_;
  WorkerPool& workers_;
  Layout layout_;
  Chain chain_;
  Frame frame_;
  SymbolSizes next_sizes_;
  SymbolSizes no_sizes_;
  BlockCounts next_blocks_;
  ZstdDecompressor zstd_;
  uint32_t sequence_ = 0;
};

}  // namespace

float lattice_step_m(float bound_m) {
  CHECK(bound_m >= kMinBoundM);
  return std::nextafter(bound_m / static_cast<float>(kStepsPerBound), 0.0f);
}

std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers) {
  return make_encoder(workers, simd::widest_set());
}
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers) {
  return make_decoder(limits, workers, simd::widest_set());
}
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers) {
  return make_step_encoder(workers, simd::widest_set());
}
std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers, simd::InstructionSet set) {
  return std::make_unique<Encoder>(workers, set, Prediction::Motion);
}
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set) {
  return make_decoder(limits, workers, set, nullptr);
}
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set,
                                            std::unique_ptr<step::StepReader> steps) {
  return std::make_unique<Decoder>(limits, workers, set, std::move(steps));
}
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers, simd::InstructionSet set) {
  return std::make_unique<Encoder>(workers, set, Prediction::Steps);
}

}  // namespace strandcast::tangent
