// What a predictor tells joiners of frames that steps foretell, and goes on with itself: everybody takes the
// rounded strands over, the simulation too, so that roundings are too fine to be seen.
#include <algorithm>
#include <cmath>
#include <utility>

#include "common/strands/step/predictor.h"

namespace strandcast::step {
namespace {

/// How velocities are rounded, and what is expected of a vertex. Edges hardly grow, so that smaller steps
/// along them cost little and leave more of the bound to those across.
struct FineRule {
  float across_mps, along_mps;
  /// Of how the last three vertices before go on otherwise than their neighbours.
  std::array<float, 3> share;
  float reach_squared;  // 0: the nearest steps; else the fewest along an edge that are as near
};
constexpr FineRule kFirstRule{1.0f / 880.0f, 1.0f / 880.0f, {0.9f, 0.0f, 0.0f}, 0.0f};
constexpr float kNearlyHalf = 0.4999f;  // of a step; rounds up what is beyond one
constexpr float kAcrossMps = 1.0f / 810.0f;
constexpr float kAlongMps = 1.0f / 1080.0f;
/// 0.99 mm/s at most.
constexpr FineRule kRule{kAcrossMps,
                         kAlongMps,
                         {1.55f, -1.0f, 0.28f},
                         0.5f * kAcrossMps* kAcrossMps + 0.25f * kAlongMps* kAlongMps};
const FineRule& rule_of(Rounding rounding) {
  return rounding == Rounding::FirstFine ? kFirstRule : kRule;
}

constexpr float kShortestSquared = 1e-14f;
constexpr int32_t kStepsOfQuarter = 32;                                // of a turn; a power of two
constexpr float kTwistTangent = 0.82842712f / float{kStepsOfQuarter};  // of half a step's angle, in the mean
constexpr uint32_t kTurnMask = uint32_t{4 * kStepsOfQuarter - 1};

/// Of everything that is told finely.
struct FineTables {
  std::array<NumberTables, 3> velocity;  // across edges, along them
  Predictor::ComponentTables component;
};

/// A vector's parts along an edge and across it.
struct EdgeFrame {
  glm::vec3 along{0.0f, 1.0f, 0.0f};
  glm::vec3 first;
  glm::vec3 second;

  /// Of the edge from a to b; edges without length go on as the one before.
  void aim(const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 edge = b - a;
    const float squared = dot_of(edge, edge);
    if (squared > kShortestSquared) along = edge * (1.0f / std::sqrt(squared));
    const float sign = along.z >= 0.0f ? 1.0f : -1.0f;
    const float p = -1.0f / (sign + along.z);
    const float q = along.x * along.y * p;
    first = {1.0f + sign * (along.x * along.x * p), sign * q, -sign * along.x};
    second = {q, sign + along.y * along.y * p, -along.y};
  }
  /// Parts across, and the one along as it is given.
  glm::vec3 parts_of(const glm::vec3& vector, float part_along) const {
    return {dot_of(vector, first), dot_of(vector, second), part_along};
  }
  glm::vec3 sum_of(const glm::vec3& parts) const {
    return (parts.x * first + parts.y * second) + parts.z * along;
  }
};

/// Slices whose neighbours are of any slice come one after the other.
template <class Work>
void for_slices(const PredictorGround& ground, Rounding rounding, const Work& work) {
  const uint32_t count = ground.layout.slice_count();
  if (rounding < Rounding::ThirdFine)
    return tangent::for_each_part(tangent::encode_terms(ground.layout, ground.workers), count, work);
  for (uint32_t slice = 0; slice < count; ++slice) work(slice);
}
/// How velocities change along strands, w = along their edges; those of place i are in row i + 1, and the
/// first strands follow zeros.
std::vector<glm::vec4> no_changes(const tangent::Layout& layout) {
  return std::vector<glm::vec4>(size_t{layout.stride + 1} * layout.vertex_count, glm::vec4(0.0f));
}
/// First vertex of a slice and the one after its last, strand by strand.
std::pair<size_t, size_t> vertices_of(const tangent::Layout& layout, uint32_t slice) {
  const size_t first = layout.slice_begin[slice];
  return {first * layout.vertex_count, (first + layout.strands_in[slice]) * layout.vertex_count};
}

/// Of a change of velocity, what is no noise: roundings alone make strands at rest move by as much.
float beyond_noise(float change_mps) {
  constexpr float kNoiseMps = 0.004f;
  const float above = change_mps < kNoiseMps ? kNoiseMps : change_mps;
  const float below = change_mps > -kNoiseMps ? -kNoiseMps : change_mps;
  return (above - kNoiseMps) + (below + kNoiseMps);
}

int32_t whole_steps_of(float value) {
  const float low = value > -kMostSteps ? value : -kMostSteps;  // also what is no number
  const float within = low < kMostSteps ? low : kMostSteps;
  constexpr float kRounder = 12582912.0f;  // 1.5 * 2^23: floats there are whole numbers
  return static_cast<int32_t>((within + kRounder) - kRounder);
}

/// Whole steps for what velocities are beside what is expected of them.
std::array<int32_t, 3> steps_of(const glm::vec3& apart_mps, const FineRule& rule) {
  std::array<int32_t, 3> steps = {whole_steps_of(apart_mps.x * (1.0f / rule.across_mps)),
                                  whole_steps_of(apart_mps.y * (1.0f / rule.across_mps)),
                                  whole_steps_of(apart_mps.z * (1.0f / rule.along_mps))};
  const float x = apart_mps.x - rule.across_mps * static_cast<float>(steps[0]);
  const float y = apart_mps.y - rule.across_mps * static_cast<float>(steps[1]);
  const float left = rule.reach_squared - (x * x + y * y);
  if (left <= 0.0f) return steps;
  const float beyond = std::abs(apart_mps.z) - std::sqrt(left);
  const auto fewest =
      beyond > 0.0f ? std::abs(whole_steps_of(beyond * (1.0f / rule.along_mps) + kNearlyHalf)) : 0;
  if (fewest < std::abs(steps[2])) steps[2] = steps[2] < 0 ? -fewest : fewest;
  return steps;
}

}  // namespace

/// Visits the velocities of a slice beside what is expected from the vertices before and the neighbours:
/// across an edge how they go on there, along it how fast theirs grow, which is next to nothing.
/// steps(first, apart_mps) gives three whole numbers; `changes`: those of slices before, to be gone on with.
/// Not of Rounding::Fine.
template <class Steps>
void Predictor::visit_velocities(uint32_t slice, std::vector<glm::vec4>& changes, Steps steps) {
  const tangent::Layout& layout = ground_.layout;
  const uint32_t vertex_count = model_.vertex_count;
  const FineRule& rule = rule_of(rounding_);
  const glm::vec3 step_mps(rule.across_mps, rule.across_mps, rule.along_mps);
  const StrandBlocks& position = *moving(PlaneRole::Position);
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  const size_t begin = layout.slice_begin[slice];
  for (size_t place = begin; place < begin + layout.strands_in[slice]; ++place) {
    const auto changes_at = [&](size_t other) { return changes.data() + (other + 1) * vertex_count; };
    std::array<const glm::vec4*, 2> beside;
    for (size_t i = 0; i < beside.size(); ++i) {
      const size_t near = this->beside()[i][place];
      const glm::vec4* const before = place == begin ? changes.data() : changes_at(place - 1);
      beside[i] = near == layout.no_neighbour() ? before : changes_at(near);
    }
    EdgeFrame frame;
    std::array<glm::vec3, 3> apart{};  // of the vertices before, the last one first
    glm::vec3 speed(0.0f);
    for (uint32_t v = 0; v < vertex_count; ++v) {
      const glm::vec4 near = 0.5f * (beside[0][v] + beside[1][v]);
      const glm::vec3 expected = glm::vec3(near) + ((rule.share[0] * apart[0] + rule.share[1] * apart[1]) +
                                                    rule.share[2] * apart[2]);
      const glm::vec3 wanted = vector_at(velocity, place, v) - speed;
      if (v > 0) frame.aim(vector_at(position, place, v - 1), vector_at(position, place, v));
      const glm::vec3 about = v > 0 ? frame.parts_of(expected, near.w) : expected;
      const glm::vec3 parts = v > 0 ? frame.parts_of(wanted, dot_of(wanted, frame.along)) : wanted;
      const std::array<int32_t, 3> found = steps(3 * (place * vertex_count + v), parts - about);
      glm::vec3 rounded;
      for (int i = 0; i < 3; ++i)
        rounded[i] = about[i] + step_mps[i] * static_cast<float>(found[static_cast<size_t>(i)]);
      const glm::vec3 change = v > 0 ? frame.sum_of(rounded) : rounded;
      changes_at(place)[v] = glm::vec4(change, v > 0 ? rounded.z : 0.0f);
      apart = {v > 0 ? change - glm::vec3(near) : glm::vec3(0.0f), apart[0], apart[1]};
      speed += change;
      for (uint32_t axis = 0; axis < 3; ++axis) at(velocity, place, v, axis) = speed[static_cast<int>(axis)];
    }
  }
}

/// Forgets what a step finds again (find_history).
void Predictor::forget_history() {
  state_.is_body_known = false;  // joiners do not
  if (!kernel_.carries_way) return;
  state_.is_history_known = false;
  for (const PlaneRole role : {PlaneRole::Displacement, PlaneRole::VelocityChange}) {
    StrandBlocks& blocks = *moving(role);
    std::fill_n(blocks.data(), blocks.size(), 0.0f);
  }
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  for (uint32_t block = 0; block < block_count(); ++block)
    for (uint32_t v = 0; v < model_.vertex_count; ++v)
      std::fill_n(velocity.row(block, v, 3), kBlockStrands, 0.0f);
}

GuessedVelocities Predictor::guessed_velocities() const {
  return GuessedVelocities({ground_.layout, beside(), *moving(PlaneRole::Position),
                            glm::mat3(state_.head.turn_per_s), model_.vertex_count, model_.pinned_root_count,
                            ground_.set});
}

void Predictor::settle_finely(const tangent::Planes<int32_t>& decoded, float quantum_m, Rounding rounding,
                              const VelocityGuess* told) {
  rounding_ = rounding;
  forget_history();
  put_positions(decoded, quantum_m);
  velocity_steps_.resize(3 * size_t{places_} * model_.vertex_count);
  if (rounding_ == Rounding::Fine) {
    StrandBlocks& velocity = *moving(PlaneRole::Velocity);
    GuessedVelocities velocities = guessed_velocities();
    guess_ = told != nullptr ? *told : velocities.fit(velocity);
    velocities.settle(guess_, velocity, velocity_steps_);
  } else {
    std::vector<glm::vec4> changes = no_changes(ground_.layout);
    for_slices(ground_, rounding_, [&](uint32_t slice) {
      visit_velocities(slice, changes, [&](size_t first, const glm::vec3& apart_mps) {
        const std::array<int32_t, 3> found = steps_of(apart_mps, rule_of(rounding_));
        std::copy(found.begin(), found.end(), &velocity_steps_[first]);
        return found;
      });
    });
  }
  settle_planes();
  if (moving(PlaneRole::RodAxis) == nullptr) return;
  twist(
      [](const TwistedAxis& of, int32_t, int32_t before) {
        const float c = dot_of(of.axis, of.found);
        const float s = dot_of(of.axis, of.side);
        const bool is_beside = std::abs(s) > std::abs(c);
        const int32_t quarter = is_beside ? (s > 0.0f ? 1 : 3) : (c > 0.0f ? 0 : 2);
        const float c_there = is_beside ? std::abs(s) : std::abs(c);
        const float s_there = quarter == 0 ? s : quarter == 1 ? -c : quarter == 2 ? -s : c;
        const float steps = s_there / (1.0f + c_there) / kTwistTangent;
        const int32_t turned = kStepsOfQuarter * quarter +
                               std::clamp(whole_steps_of(steps), -kStepsOfQuarter / 2, kStepsOfQuarter / 2);
        // The nearest to the one before that means the same.
        const uint32_t way = static_cast<uint32_t>(turned - before + 2 * kStepsOfQuarter) & kTurnMask;
        return before + static_cast<int32_t>(way) - 2 * kStepsOfQuarter;
      },
      turn_of_fine_steps);
}

Predictor::TwistTurn Predictor::turn_of_fine_steps(int32_t steps) {
  const uint32_t turned = (static_cast<uint32_t>(steps) + uint32_t{kStepsOfQuarter / 2}) & kTurnMask;
  const auto beside = static_cast<int32_t>(turned % uint32_t{kStepsOfQuarter}) - kStepsOfQuarter / 2;
  const float t = kTwistTangent * static_cast<float>(beside);
  const float c = 1.0f - t * t;
  const float s = 2.0f * t;
  const float scale = 1.0f / (1.0f + t * t);
  switch (turned / uint32_t{kStepsOfQuarter}) {
    case 0:
      return {c, s, scale};
    case 1:
      return {-s, c, scale};
    case 2:
      return {-c, -s, scale};
    default:
      return {s, -c, scale};
  }
}

/// Visits the steps of a slice's velocities in the order of the stream; code(i, part, beside) has a step's
/// index, which of the three parts it is, and the sum of sizes beside it: of the two vertices before, of the
/// neighbours there, and of the other part across, there or at the vertex before.
template <class Code>
void Predictor::visit_steps_beside(uint32_t slice, Code code) const {
  if (rounding_ != Rounding::Fine) return visit_earlier_steps_beside(slice, code);
  constexpr std::array<size_t, 3> kOrder = {2, 0, 1};  // how far along an edge says how far across
  const tangent::Layout& layout = ground_.layout;
  const uint32_t vertex_count = model_.vertex_count;
  const uint32_t first = guess_.are_roots_carried ? model_.pinned_root_count : 0;
  const size_t begin = layout.slice_begin[slice];
  for (size_t place = begin; place < begin + layout.strands_in[slice]; ++place) {
    std::array<size_t, 2> near;
    for (size_t i = 0; i < near.size(); ++i) {
      near[i] = beside()[i][place];
      if (near[i] == layout.no_neighbour()) near[i] = place > begin ? place - 1 : places_;
    }
    const auto size_at = [&](size_t other, uint32_t v, size_t part) {
      return other < places_ ? fold_sign(velocity_steps_[3 * (other * vertex_count + v) + part]) : 0u;
    };
    for (uint32_t v = first; v < vertex_count; ++v)
      for (const size_t part : kOrder) {
        uint32_t sum = size_at(near[0], v, part) + size_at(near[1], v, part);
        if (v >= 1) sum += 2 * size_at(place, v - 1, part);
        if (v >= 2) sum += size_at(place, v - 2, part);
        if (part == 0) {
          sum += (size_at(near[0], v, 1) + size_at(near[1], v, 1)) / 2;
          if (v >= 1) sum += size_at(place, v - 1, 1);
        } else if (part == 1) {
          sum += 2 * size_at(place, v, 0);
          if (v >= 1) sum += size_at(place, v - 1, 0) / 2;
        }
        code(3 * (place * vertex_count + v) + part, part, sum);
      }
  }
}

/// As visit_steps_beside(), of numbers before.
template <class Code>
void Predictor::visit_earlier_steps_beside(uint32_t slice, Code code) const {
  const tangent::Layout& layout = ground_.layout;
  const size_t row = 3 * size_t{model_.vertex_count};
  const size_t begin = layout.slice_begin[slice];
  const auto size_at = [&](size_t i) { return fold_sign(velocity_steps_[i]); };
  for (size_t place = begin; place < begin + layout.strands_in[slice]; ++place)
    for (size_t at = 0; at < row; ++at) {
      const size_t i = place * row + at;
      uint32_t sum = (at >= 3 ? 2 * size_at(i - 3) : 0) + (at >= 6 ? size_at(i - 6) : 0);
      for (const std::vector<uint32_t>& neighbour : beside()) {
        const size_t near = neighbour[place];
        if (near != layout.no_neighbour())
          sum += size_at(near * row + at);
        else if (place > begin)
          sum += size_at(i - row);
      }
      if (at % 3 == 1) sum += 2 * size_at(i - 1);
      code(i, at % 3, sum);
    }
}

/// All slices by the same tables, one after the other: learning anew would cost more than they gain by
/// threads.
void Predictor::write_fine(ValueWriter& writer) const {
  FineTables tables;
  for (auto& kept : tables.component) kept.is_fine = rounding_ == Rounding::Fine;
  for (uint32_t slice = 0; slice < ground_.layout.slice_count(); ++slice) {
    visit_steps_beside(slice, [&](size_t i, size_t part, uint32_t beside) {
      tables.velocity[part].put_beside(velocity_steps_[i], beside, writer);
    });
    write_planes(slice, tables.component, writer);
  }
}

void Predictor::read_fine(ValueReader& reader) {
  constexpr auto kMost = static_cast<int32_t>(kMostSteps);
  FineTables tables;
  for (auto& kept : tables.component) kept.is_fine = rounding_ == Rounding::Fine;
  for (uint32_t slice = 0; slice < ground_.layout.slice_count(); ++slice) {
    if (rounding_ == Rounding::FirstFine) {
      const auto [begin, end] = vertices_of(ground_.layout, slice);
      for (size_t i = 3 * begin; i < 3 * end; ++i)
        velocity_steps_[i] = std::clamp(tables.velocity[i % 3 / 2].take(reader), -kMost, kMost);
    } else {
      visit_steps_beside(slice, [&](size_t i, size_t part, uint32_t beside) {
        velocity_steps_[i] = std::clamp(tables.velocity[part].take_beside(beside, reader), -kMost, kMost);
      });
    }
    read_planes(slice, history_s_, tables.component, reader);
  }
}

void Predictor::place_velocities() {
  forget_history();
  if (rounding_ == Rounding::Fine)
    return guessed_velocities().place(guess_, velocity_steps_, *moving(PlaneRole::Velocity));
  std::vector<glm::vec4> changes = no_changes(ground_.layout);
  for_slices(ground_, rounding_, [&](uint32_t slice) {
    visit_velocities(slice, changes, [&](size_t first, const glm::vec3&) {
      return std::array{velocity_steps_[first], velocity_steps_[first + 1], velocity_steps_[first + 2]};
    });
  });
}

/// What strands remember of the last substep follows from where they are and how fast: it is what the next
/// one would leave behind if there had been none before. The way is that of a velocity that changes evenly.
void Predictor::find_history(const StepInput& first) {
  constexpr float kHalf = 0.5f;
  state_.is_history_known = true;
  const auto seconds = static_cast<float>(limited_substep_s(first));
  const auto for_rows = [&](const auto& work) {
    for_blocks([&](uint32_t begin, uint32_t end) {
      for (uint32_t block = begin; block < end; ++block)
        for (uint32_t v = 0; v < model_.vertex_count; ++v) work(block, v);
    });
  };
  const auto way_with = [&](StrandBlocks& way, const StrandBlocks& velocity) {
    for_rows([&](uint32_t block, uint32_t v) {
      for (size_t i = 0; i < 3 * kBlockStrands; ++i)
        way.row(block, v, 0)[i] = seconds * velocity.row(block, v, 0)[i];
    });
  };
  way_with(*moving(PlaneRole::Displacement), *moving(PlaneRole::Velocity));
  State known;
  copy(state_, known);
  std::unique_ptr<StrandBlocks> field_before;
  copy_blocks(field_before_, field_before);
  run(first);
  std::swap(field_before_, field_before);
  std::swap(state_, known);
  const auto found = [&](PlaneRole role) -> const StrandBlocks& {
    return *known.planes[static_cast<size_t>(role)];
  };
  const uint32_t tail = model_.free_end();
  for_rows([&](uint32_t block, uint32_t v) {
    const bool is_free = v >= model_.pinned_root_count && v < tail;
    const float half_s = is_free ? kHalf * seconds : 0.0f;
    float* const velocity = moving(PlaneRole::Velocity)->row(block, v, 0);
    float* const way = moving(PlaneRole::Displacement)->row(block, v, 0);
    const float* const next = found(PlaneRole::Velocity).row(block, v, 0);
    for (size_t i = 0; i < 3 * kBlockStrands; ++i) way[i] -= half_s * beyond_noise(next[i] - velocity[i]);
    constexpr size_t kW = 3 * kBlockStrands;
    for (size_t i = 0; i < kW; ++i)
      moving(PlaneRole::VelocityChange)->row(block, v, 0)[i] =
          beyond_noise(found(PlaneRole::VelocityChange).row(block, v, 0)[i]);
    std::copy_n(next + kW, kBlockStrands, velocity + kW);
    std::copy_n(found(PlaneRole::Displacement).row(block, v, 3), kBlockStrands, way + kW);
    if (StrandBlocks* axes = moving(PlaneRole::RodAxis))
      std::copy_n(found(PlaneRole::RodAxis).row(block, v, 3), kBlockStrands, axes->row(block, v, 3));
  });
}

}  // namespace strandcast::step
