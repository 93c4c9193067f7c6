// What a predictor tells joiners, and goes on with itself.
#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/strands/step/predictor.h"

namespace strandcast::step {
namespace {

// What joiners are told is rounded to these steps, and those who watch pay for what was lost: on a walk 2.4
// (dftl) and 4.9 (direct_rod) bits a vertex in all. Twice as fine takes 3 to 6 bits more of a keyframe and
// saves half a bit of that.
constexpr float kVelocityStepMps = 1.0f / 512.0f;
constexpr float kChangeStepMps = 1.0f / 64.0f;  // in four times as many steps watchers pay a third less
constexpr float kWayStepM = 1.0f / 6144.0f;  // beside velocity times the last substep; a third moves strands
constexpr float kOffsetStepM = 1.0f / 16384.0f;
constexpr float kTwistStep = 1.0f / 32.0f;  // of the tangent of half of it
constexpr int32_t kMostTwistSteps = 256;
constexpr float kTiniestEdgeM2 = 1e-14f;
constexpr float kTensionStepM2ps2 = 1.0f / 8.0f;
constexpr double kMostTurnPerS = 1e6;
constexpr double kMostHistoryS = kMaxSubstepS;

int32_t steps_of(float value, float step) {
  return static_cast<int32_t>(std::lrint(value * (1.0f / step)));
}

}  // namespace

/// In this order on the wire: later ones may be told beside those before.
std::vector<Predictor::StatePlane> Predictor::state_planes() const {
  std::vector<StatePlane> planes;
  if (is_fine() && kernel_.carries_way) return planes;
  if (!is_fine())
    planes.push_back({PlaneRole::Velocity, kVelocityStepMps, kernel_.carries_way ? kTensionStepM2ps2 : 0.0f});
  for (const PlaneRole role : kernel_.moving) {
    if (role == PlaneRole::VelocityChange) planes.push_back({role, kChangeStepMps});
    if (role == PlaneRole::Displacement)
      planes.push_back({role, kernel_.carries_way ? kWayStepM : kOffsetStepM, 0.0f, kernel_.carries_way});
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
  rounding_ = Rounding::Coarse;
  state_.is_body_known = false;  // joiners do not
  put_positions(decoded, quantum_m);
  history_s_ = share_history();
  settle_planes();
  if (moving(PlaneRole::RodAxis) == nullptr) return;
  twist(
      [](const TwistedAxis& of, int32_t, int32_t) {
        const float turned = 1.0f + dot_of(of.axis, of.found);
        const float tangent = turned > 1e-3f ? dot_of(of.axis, of.side) / turned : 0.0f;
        return std::clamp(steps_of(tangent, kTwistStep), -kMostTwistSteps, kMostTwistSteps);
      },
      turn_of_steps);
}

void Predictor::settle_planes() {
  for (const StatePlane& plane : state_planes()) {
    StrandBlocks& vectors = *moving(plane.role);
    const StrandBlocks* about = plane.is_way ? moving(PlaneRole::Velocity) : nullptr;
    for_blocks([&](uint32_t begin, uint32_t end) {
      settle_blocks(ground_.set, {vectors, about, about, plane.step, plane.w_step, begin, end});
    });
  }
}

Predictor::TwistTurn Predictor::turn_of_steps(int32_t steps) {
  const float t = kTwistStep * static_cast<float>(steps);
  return {1.0f - t * t, 2.0f * t, 1.0f / (1.0f + t * t)};
}

/// Turns axes without twist about the strands as they lie, by the steps that steps_of_axis(axis, steps, those
/// of the vertex before) gives.
void Predictor::twist(StepsOfAxis steps_of_axis, TwistTurn (*turn_of)(int32_t)) {
  StrandBlocks& axes = *moving(PlaneRole::RodAxis);
  twist_steps_.resize(size_t{block_count()} * kBlockStrands * model_.vertex_count);
  const StrandBlocks& position = *moving(PlaneRole::Position);
  StrandBlocks found_axes(places_, axes.row_count());
  find_axes(found_axes);
  for_blocks([&](uint32_t block_begin, uint32_t block_end) {
    for (size_t place = size_t{block_begin} * kBlockStrands; place < size_t{block_end} * kBlockStrands;
         ++place) {
      glm::vec3 along(0.0f);
      for (uint32_t v = 1; v < axes.row_count(); ++v) {
        const glm::vec3 edge = vector_at(position, place, v) - vector_at(position, place, v - 1);
        const float squared = dot_of(edge, edge);
        if (squared > kTiniestEdgeM2) along = edge * (1.0f / std::sqrt(squared));
        const glm::vec3 found = vector_at(found_axes, place, v);
        const glm::vec3 side(along.y * found.z - along.z * found.y, along.z * found.x - along.x * found.z,
                             along.x * found.y - along.y * found.x);
        int32_t& steps = twist_steps_[place * axes.row_count() + v];
        const int32_t before = v > 1 ? twist_steps_[place * axes.row_count() + v - 1] : 0;
        steps = steps_of_axis({vector_at(axes, place, v), found, side}, steps, before);
        const TwistTurn turn = turn_of(steps);
        for (uint32_t axis = 0; axis < 3; ++axis) {
          const auto i = static_cast<int>(axis);
          at(axes, place, v, axis) = (turn.cosine * found[i] + turn.sine * side[i]) * turn.scale;
        }
        at(axes, place, v, 3) = 0.0f;
      }
    }
  });
}

void Predictor::write_slice(uint32_t slice, ValueWriter& writer) const {
  ComponentTables tables;
  write_planes(slice, tables, writer);
}

void Predictor::write_planes(uint32_t slice, ComponentTables& tables, ValueWriter& writer) const {
  size_t number = 0;
  const tangent::Layout& layout = ground_.layout;
  const size_t begin = layout.slice_begin[slice];
  const size_t end = begin + layout.strands_in[slice];
  for (const StatePlane& plane : state_planes()) {
    const StrandBlocks& vectors = *moving(plane.role);
    const StrandBlocks& velocity = *moving(PlaneRole::Velocity);
    for (uint32_t axis = 0; axis < 3; ++axis) {
      Component component(layout, beside(), slice, vectors.row_count(), tables[number++]);
      for (size_t place = begin; place < end; ++place) {
        const float seconds = at(velocity, place, 0, 3);
        component.put_strand(place, writer, [&](uint32_t v) {
          float value = at(vectors, place, v, axis);
          if (plane.is_way) value -= seconds * at(velocity, place, v, axis);
          return steps_of(value, plane.step);
        });
      }
    }
    if (plane.w_step == 0.0f) continue;
    Component component(layout, beside(), slice, vectors.row_count(), tables[number++]);
    for (size_t place = begin; place < end; ++place)
      component.put_strand(place, writer, [&](uint32_t v) {
        const float w = at(vectors, place, v, 3);
        return v == 0 ? static_cast<int32_t>(w > 0.0f) : steps_of(w, plane.w_step);
      });
  }
  if (moving(PlaneRole::RodAxis) == nullptr) return;
  Component component(layout, beside(), slice, model_.vertex_count, tables[number++]);
  for (size_t place = begin; place < end; ++place)
    component.put_strand(place, writer,
                         [&](uint32_t v) { return twist_steps_[place * model_.vertex_count + v]; });
}

void Predictor::write_state(std::vector<std::byte>& bytes) const {
  ByteWriter to(bytes);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) to.put(state_.head.turn_per_s[column][row]);
  to.put(state_.head.step_index);
  to.put(history_s_);
  if (rounding_ == Rounding::Fine) guess_.write(bytes);
  if (is_fine()) {
    ValueWriter writer;
    write_fine(writer);
    return writer.finish(bytes);
  }
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
  ComponentTables tables;
  read_planes(slice, history_s, tables, reader);
}

void Predictor::read_planes(uint32_t slice, float history_s, ComponentTables& tables, ValueReader& reader) {
  size_t number = 0;
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
      Component component(layout, beside(), slice, vectors.row_count(), tables[number++]);
      for (size_t place = begin; place < end; ++place)
        component.take_strand(place, reader, [&](uint32_t v, int32_t value) {
          at(vectors, place, v, axis) = in_steps(value, plane.step);
        });
    }
    if (plane.w_step == 0.0f) continue;
    Component component(layout, beside(), slice, vectors.row_count(), tables[number++]);
    for (size_t place = begin; place < end; ++place)
      component.take_strand(place, reader, [&](uint32_t v, int32_t value) {
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
          const float expected = seconds * at(velocity, place, v, axis);
          at(way, place, v, axis) = expected + at(way, place, v, axis);
        }
    }
  }
  if (moving(PlaneRole::RodAxis) == nullptr) return;
  Component component(layout, beside(), slice, model_.vertex_count, tables[number++]);
  for (size_t place = begin; place < end; ++place)
    component.take_strand(place, reader, [&](uint32_t v, int32_t value) {
      constexpr int32_t kMostFineSteps = 1 << 20;
      const int32_t most = is_fine() ? kMostFineSteps : kMostTwistSteps;
      twist_steps_[place * model_.vertex_count + v] = std::clamp(value, -most, most);
    });
}

Status Predictor::read_state(ByteReader& bytes, const Pose& pose, Rounding rounding) {
  rounding_ = rounding;
  if (is_fine()) velocity_steps_.assign(3 * size_t{places_} * model_.vertex_count, 0);
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
  if (rounding_ == Rounding::Fine) {
    ASSIGN_OR_RETURN(guess_, VelocityGuess::read(bytes));
  }
  twist_steps_.assign(size_t{block_count()} * kBlockStrands * model_.vertex_count, 0);
  std::vector<ValueReader> readers(is_fine() ? 1 : ground_.layout.slice_count());
  for (ValueReader& reader : readers) {
    ASSIGN_OR_RETURN(const auto rest, reader.open(bytes.rest()));
    bytes.take_bytes(bytes.rest().size() - rest.size());
  }
  if (is_fine())
    read_fine(readers.front());
  else
    tangent::for_each_part(tangent::decode_terms(ground_.layout, ground_.workers),
                           ground_.layout.slice_count(),
                           [&](uint32_t slice) { read_slice(slice, history_s_, readers[slice]); });
  for (const ValueReader& reader : readers)
    if (!reader.is_spent())
      return make_error(ErrorCode::BadInput, "the state that steps go on from does not end where it should");
  return {};
}

void Predictor::place(const tangent::Planes<int32_t>& decoded, float quantum_m) {
  put_positions(decoded, quantum_m);
  if (is_fine()) place_velocities();
  if (moving(PlaneRole::RodAxis) == nullptr) return;
  twist([](const TwistedAxis&, int32_t steps, int32_t) { return steps; },
        is_fine() ? turn_of_fine_steps : turn_of_steps);
}

}  // namespace strandcast::step
