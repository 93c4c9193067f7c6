// What a predictor tells joiners, and goes on with itself.
#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/strands/step/lanes.h"
#include "common/strands/step/numbers.h"
#include "common/strands/step/predictor.h"
#include "common/strands/wrapping.h"

namespace strandcast::step {
namespace {

// What joiners are told is rounded to these steps, and those who watch pay for what was lost: on a walk 2.6
// (dftl) and 4.4 (direct_rod) bits a vertex in all. Twice as fine takes 3 to 6 bits more of a keyframe and
// saves half a bit of that.
constexpr float kVelocityStepMps = 1.0f / 512.0f;
constexpr float kChangeStepMps = 1.0f / 256.0f;
constexpr float kWayStepM = 1.0f / 8192.0f;  // beside velocity times the last substep
constexpr float kOffsetStepM = 1.0f / 16384.0f;
constexpr float kAxisStep = 1.0f / 16.0f;  // beside axes without twist
constexpr float kTensionStepM2ps2 = 1.0f / 8.0f;
constexpr double kMostTurnPerS = 1e6;
constexpr double kMostHistoryS = kMaxSubstepS;

/// One component of the strands of a slice, in steps, told beside what the vertex before has and how the
/// strand before went on from there.
class Component {
 public:
  explicit Component(uint32_t vertex_count) : strand_(vertex_count) {}

  /// One strand; value_at(v) gives what it has there.
  template <class ValueAt>
  void put_strand(ValueWriter& writer, ValueAt value_at) {
    SymbolStep* next = writer.begin_run(strand_.size());
    for (uint32_t v = 0; v < strand_.size(); ++v) {
      const int32_t value = value_at(v);
      tables_.put(wrapping_difference(value, expected(v)), writer, next);
      remember(v, value);
    }
    writer.end_run(next);
  }
  template <class Give>
  void take_strand(ValueReader& reader, Give give) {
    SymbolCursor cursor = reader.begin_run(strand_.size());
    for (uint32_t v = 0; v < strand_.size(); ++v) {
      const int32_t value = wrapping_sum(expected(v), tables_.take(reader, cursor));
      remember(v, value);
      give(v, value);
    }
    reader.end_run(cursor);
  }

 private:
  int32_t expected(uint32_t v) const {
    if (v == 0) return strand_[0];
    return wrapping_sum(last_, wrapping_difference(strand_[v], before_) / 2);
  }
  void remember(uint32_t v, int32_t value) {
    before_ = strand_[v];
    last_ = value;
    strand_[v] = value;
  }

  std::vector<int32_t> strand_;  // the one before, from vertex v on
  int32_t before_ = 0;           // of the strand before, at the vertex before
  int32_t last_ = 0;
  NumberTables tables_;
};

float at(const StrandBlocks& blocks, size_t place, uint32_t v, uint32_t axis) {
  return blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands];
}
float& at(StrandBlocks& blocks, size_t place, uint32_t v, uint32_t axis) {
  return blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands];
}
int32_t steps_of(float value, float step) {
  return static_cast<int32_t>(std::lrint(value * (1.0f / step)));
}

}  // namespace

/// In this order on the wire: later ones may be told beside those before.
std::vector<Predictor::StatePlane> Predictor::state_planes() const {
  std::vector<StatePlane> planes = {
      {PlaneRole::Velocity, kVelocityStepMps, kernel_.carries_way ? kTensionStepM2ps2 : 0.0f}};
  for (const PlaneRole role : kernel_.moving) {
    if (moving(role) == nullptr) continue;
    if (role == PlaneRole::Displacement)
      planes.push_back({role, kernel_.carries_way ? kWayStepM : kOffsetStepM, 0.0f, kernel_.carries_way});
    else
      planes.push_back({role, role == PlaneRole::RodAxis ? kAxisStep : kChangeStepMps});
  }
  return planes;
}

/// Strands whose last substep is known agree on how long it was; gives that.
float Predictor::share_history() {
  if (!kernel_.carries_way) return 0.0f;
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  float history_s = 0.0f;
  for (size_t place = 0; place < places_; ++place) {
    const float own = at(velocity, place, 0, 3);
    if (own > 0.0f && own <= static_cast<float>(kMostHistoryS) && history_s == 0.0f) history_s = own;
  }
  for (size_t place = 0; place < size_t{block_count()} * kBlockStrands; ++place) {
    float& own = at(velocity, place, 0, 3);
    own = own > 0.0f ? history_s : 0.0f;
  }
  return history_s;
}

void Predictor::settle(const tangent::Planes<int32_t>& decoded, float quantum_m) {
  state_.is_body_known = false;  // joiners do not
  put_positions(decoded, quantum_m);
  history_s_ = share_history();
  for (const StatePlane& plane : state_planes()) {
    StrandBlocks& vectors = *moving(plane.role);
    const StrandBlocks* about = nullptr;
    if (plane.role == PlaneRole::RodAxis) {
      if (found_axes_ == nullptr) found_axes_ = std::make_unique<StrandBlocks>(places_, vectors.row_count());
      find_axes(*found_axes_);
      about = found_axes_.get();
    } else if (plane.is_way) {
      about = moving(PlaneRole::Velocity);
    }
    for_blocks([&](uint32_t begin, uint32_t end) {
      settle_blocks(ground_.set, {vectors, about, plane.is_way ? moving(PlaneRole::VelocityChange) : nullptr,
                                  plane.is_way ? about : nullptr, plane.step, plane.w_step, begin, end});
    });
  }
}

/// Of order 2 the way lags behind the velocity by half of what that changed by.
float Predictor::way_velocity(size_t place, uint32_t v, uint32_t axis) const {
  return at(*moving(PlaneRole::Velocity), place, v, axis) -
         0.5f * at(*moving(PlaneRole::VelocityChange), place, v, axis);
}

void Predictor::write_slice(uint32_t slice, ValueWriter& writer) const {
  const tangent::Layout& layout = ground_.layout;
  const size_t begin = layout.slice_begin[slice];
  const size_t end = begin + layout.strands_in[slice];
  for (const StatePlane& plane : state_planes()) {
    const StrandBlocks& vectors = *moving(plane.role);
    const StrandBlocks& velocity = *moving(PlaneRole::Velocity);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Component component(vectors.row_count());
      for (size_t place = begin; place < end; ++place) {
        const float seconds = at(velocity, place, 0, 3);
        component.put_strand(writer, [&](uint32_t v) {
          float value = at(vectors, place, v, axis);
          if (plane.is_way) value -= seconds * way_velocity(place, v, axis);
          if (plane.role == PlaneRole::RodAxis) value -= at(*found_axes_, place, v, axis);
          return steps_of(value, plane.step);
        });
      }
    }
    if (plane.w_step == 0.0f) continue;
    Component component(vectors.row_count());
    for (size_t place = begin; place < end; ++place)
      component.put_strand(writer, [&](uint32_t v) {
        const float w = at(vectors, place, v, 3);
        return v == 0 ? static_cast<int32_t>(w > 0.0f) : steps_of(w, plane.w_step);
      });
  }
}

void Predictor::write_state(std::vector<std::byte>& bytes) const {
  ByteWriter to(bytes);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) to.put(state_.head.turn_per_s[column][row]);
  to.put(state_.head.step_index);
  to.put(history_s_);
  const uint32_t count = ground_.layout.slice_count();
  std::vector<ValueWriter> writers(count);
  std::vector<std::vector<std::byte>> slices(count);
  constexpr uint32_t kAtOnce = 4;
  const auto write_some = [&](uint32_t part) {
    const uint32_t begin = part * kAtOnce;
    const uint32_t end = std::min(begin + kAtOnce, count);
    for (uint32_t slice = begin; slice < end; ++slice) write_slice(slice, writers[slice]);
    ValueWriter::finish_all(std::span(writers).subspan(begin, end - begin),
                            std::span(slices).subspan(begin, end - begin));
  };
  tangent::for_each_part(tangent::encode_terms(ground_.layout, ground_.workers),
                         (count + kAtOnce - 1) / kAtOnce, write_some);
  for (const auto& slice : slices) to.put_bytes(slice);
}

void Predictor::read_slice(uint32_t slice, float history_s, ValueReader& reader) {
  const tangent::Layout& layout = ground_.layout;
  const size_t begin = layout.slice_begin[slice];
  const size_t end = begin + layout.strands_in[slice];
  const auto in_steps = [](int32_t steps, float step) {
    constexpr auto kMost = static_cast<int32_t>(kMostSteps);
    return step * static_cast<float>(std::clamp(steps, -kMost, kMost));
  };
  for (const StatePlane& plane : state_planes()) {
    StrandBlocks& vectors = *moving(plane.role);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Component component(vectors.row_count());
      for (size_t place = begin; place < end; ++place)
        component.take_strand(reader, [&](uint32_t v, int32_t value) {
          at(vectors, place, v, axis) = in_steps(value, plane.step);
        });
    }
    if (plane.w_step == 0.0f) continue;
    Component component(vectors.row_count());
    for (size_t place = begin; place < end; ++place)
      component.take_strand(reader, [&](uint32_t v, int32_t value) {
        at(vectors, place, v, 3) = v > 0 ? in_steps(value, plane.w_step) : value > 0 ? history_s : 0.0f;
      });
  }
  for (const StatePlane& plane : state_planes()) {
    if (!plane.is_way) continue;
    StrandBlocks& way = *moving(plane.role);
    const StrandBlocks& velocity = *moving(PlaneRole::Velocity);
    for (size_t place = begin; place < end; ++place) {
      const float seconds = at(velocity, place, 0, 3);
      for (uint32_t v = 0; v < way.row_count(); ++v)
        for (uint32_t axis = 0; axis < 3; ++axis) {
          const float expected = seconds * way_velocity(place, v, axis);
          at(way, place, v, axis) = expected + at(way, place, v, axis);
        }
    }
  }
}

Status Predictor::read_state(ByteReader& bytes, const Pose& pose) {
  state_.pose = pose;
  state_.head = HeadPath::at_rest(pose.rotation);
  bool are_usable = true;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) {
      const auto value = bytes.take<double>();
      are_usable &= std::abs(value) <= kMostTurnPerS;
      state_.head.turn_per_s[column][row] = value;
    }
  state_.head.step_index = bytes.take<uint32_t>();
  history_s_ = bytes.take<float>();
  are_usable &= history_s_ >= 0.0f && history_s_ <= static_cast<float>(kMostHistoryS);
  if (!bytes.ok() || !are_usable)
    return make_error(ErrorCode::BadInput, "the state that steps go on from is cut off or no numbers");
  std::vector<ValueReader> readers(ground_.layout.slice_count());
  for (ValueReader& reader : readers) {
    ASSIGN_OR_RETURN(const auto rest, reader.open(bytes.rest()));
    bytes.take_bytes(bytes.rest().size() - rest.size());
  }
  tangent::for_each_part(tangent::decode_terms(ground_.layout, ground_.workers), ground_.layout.slice_count(),
                         [&](uint32_t slice) { read_slice(slice, history_s_, readers[slice]); });
  for (const ValueReader& reader : readers)
    if (!reader.is_spent())
      return make_error(ErrorCode::BadInput, "the state that steps go on from does not end where it should");
  return {};
}

void Predictor::place(const tangent::Planes<int32_t>& decoded, float quantum_m) {
  put_positions(decoded, quantum_m);
  StrandBlocks* axes = moving(PlaneRole::RodAxis);
  if (axes == nullptr) return;
  if (found_axes_ == nullptr) found_axes_ = std::make_unique<StrandBlocks>(places_, axes->row_count());
  find_axes(*found_axes_);
  for (size_t i = 0; i < axes->size(); ++i) axes->data()[i] = found_axes_->data()[i] + axes->data()[i];
}

}  // namespace strandcast::step
