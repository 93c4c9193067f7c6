#include "common/strands/step/predictor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/step/lanes.h"

namespace strandcast::step {
namespace {

using tangent::kNoStrand;

/// Share of what a frame corrects that the velocity takes on.
constexpr double kGain = 0.5;
/// Blocks that a worker takes at once.
constexpr size_t kBlockGrain = 32;
/// Faster than this nothing starts: it jumped.
constexpr double kMostStartMps = 20.0;

/// Steps of what a joiner is told of a plane, per axis; w keeps kKeptBits of its float's.
float step_of(PlaneRole role) {
  switch (role) {
    case PlaneRole::Velocity:
    case PlaneRole::VelocityChange:
      return 1.0f / 1024.0f;  // m/s
    case PlaneRole::Displacement:
      return 1.0f / 65536.0f;  // m
    default:
      return 1.0f / 1024.0f;  // of a unit vector
  }
}
constexpr uint32_t kDroppedBits = 12;
constexpr int32_t kMostSteps = 1 << 24;
constexpr size_t kMostStepBytes = 5;

Turn turn_of(const glm::dquat& rotation) {
  const glm::dmat3 matrix = glm::mat3_cast(rotation);
  Turn turn;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      turn[static_cast<size_t>(row)][static_cast<size_t>(column)] = static_cast<float>(matrix[column][row]);
  return turn;
}

glm::dvec3 vector_at(const StrandBlocks& blocks, size_t place, uint32_t row) {
  const auto block = static_cast<uint32_t>(place / kBlockStrands);
  const size_t lane = place % kBlockStrands;
  return {blocks.row(block, row, 0)[lane], blocks.row(block, row, 1)[lane], blocks.row(block, row, 2)[lane]};
}
void put_vector(StrandBlocks& blocks, size_t place, uint32_t row, const glm::vec3& value) {
  const auto block = static_cast<uint32_t>(place / kBlockStrands);
  const size_t lane = place % kBlockStrands;
  for (uint32_t axis = 0; axis < 3; ++axis)
    blocks.row(block, row, axis)[lane] = value[static_cast<int>(axis)];
}
float& w_at(StrandBlocks& blocks, size_t place, uint32_t row) {
  return blocks.row(static_cast<uint32_t>(place / kBlockStrands), row, 3)[place % kBlockStrands];
}

/// As carried_axis() of shaders/sim/direct_rod_state.glsl.
glm::dvec3 carried(const glm::dvec3& axis, const glm::dvec3& from, const glm::dvec3& to) {
  constexpr double kFoldedBack = 1e-3;
  const double sum = std::max(1.0 + glm::dot(from, to), kFoldedBack);
  glm::dvec3 result = axis - (glm::dot(axis, to) / sum) * (from + to);
  result -= to * glm::dot(result, to);
  const double length = std::sqrt(glm::dot(result, result));
  return length > 0.0 ? result / length : axis;
}

/// The float with its last bits left out: as many as a joiner is told.
float kept(float value) {
  uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  bits &= ~0u << kDroppedBits;
  std::memcpy(&value, &bits, sizeof bits);
  return value;
}
int32_t steps_of(float value, float step) {
  const float steps = value / step;
  if (!(std::abs(steps) < static_cast<float>(kMostSteps))) return 0;
  return static_cast<int32_t>(std::lrint(steps));
}

void copy_blocks(const std::unique_ptr<StrandBlocks>& from, std::unique_ptr<StrandBlocks>& to) {
  if (from == nullptr) {
    to.reset();
    return;
  }
  if (to == nullptr || to->size() != from->size())
    to = std::make_unique<StrandBlocks>(from->strand_count(), from->row_count());
  std::memcpy(to->data(), from->data(), from->size() * sizeof(float));
}

}  // namespace

Result<std::unique_ptr<Predictor>> Predictor::make(StepModel model, const PredictorGround& ground) {
  const tangent::Layout& layout = ground.layout;
  if (ground.rest_in_head_m.size() != size_t{layout.strand_count} * layout.vertex_count)
    return make_error(ErrorCode::Unsupported, "strands without a rest shape cannot be predicted by a step");
  CHECK(find_step_kernel(model.kernel.shader_path) != nullptr);
  CHECK(model.strand_count == layout.strand_count && model.vertex_count == layout.vertex_count);
  std::unique_ptr<Predictor> predictor(new Predictor(std::move(model), ground));
  RETURN_IF_ERROR(predictor->prepare());
  return predictor;
}

Predictor::Predictor(StepModel model, const PredictorGround& ground)
    : model_(std::move(model)),
      ground_(ground),
      kernel_(*find_step_kernel(model_.kernel.shader_path)),
      places_(ground.layout.no_neighbour()) {}

uint32_t Predictor::block_count() const {
  return strandcast::block_count(places_);
}

Status Predictor::prepare() {
  const uint32_t vertex_count = ground_.layout.vertex_count;
  const auto sets = lane_sets();
  const auto set = std::find(sets.begin(), sets.end(), ground_.set) != sets.end() ? ground_.set
                   : sets.empty() ? simd::InstructionSet::Plain
                                  : sets.back();
  const LaneKernel* kernel = find_lane_kernel(model_.kernel, set);
  KernelDesc follicle;
  follicle.shader_path = "sim/follicle_limit.comp";
  follicle.meets_air = false;
  const auto twist = model_.kernel.variant.find("HAS_TWIST");
  const bool has_twist = twist != model_.kernel.variant.end() && twist->second != 0;
  follicle.variant = {{"MEMORY", !kernel_.carries_way ? 0 : has_twist ? 2 : 1}};
  const LaneKernel* follicle_kernel = find_lane_kernel(follicle, set);
  if (kernel == nullptr || follicle_kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                      model_.kernel.shader_path);
  LaneWork work{places_, vertex_count, true, true, &ground_.workers, Priority::Encoding};
  program_.emplace(*kernel, model_.kernel, work);
  work.has_turbulence = false;
  follicle_program_.emplace(*follicle_kernel, follicle, work);
  const auto make = [&](uint32_t rows) { return std::make_unique<StrandBlocks>(places_, rows); };
  const auto at = [](auto& planes, PlaneRole role) -> auto& {
    return planes[static_cast<size_t>(role)];
  };
  at(fixed_, PlaneRole::Rest) = make(vertex_count);
  for (const PlaneRole role : kernel_.fixed)
    at(fixed_, role) = make(role == PlaneRole::RodEdge ? vertex_count : kRodStrandRows);
  at(state_.planes, PlaneRole::Position) = make(vertex_count);
  at(state_.planes, PlaneRole::Velocity) = make(vertex_count);
  for (const PlaneRole role : kernel_.moving)
    if (role != PlaneRole::RodAxis || has_twist) at(state_.planes, role) = make(vertex_count);
  fill_rest();
  fill_fixed();
  return {};
}

StrandBlocks* Predictor::moving(PlaneRole role) const {
  return state_.planes[static_cast<size_t>(role)].get();
}

/// As make_strand_layout(): rest positions, segments, and how far along its strand a vertex is.
void Predictor::fill_rest() {
  const tangent::Layout& layout = ground_.layout;
  StrandBlocks& rest = *fixed_[static_cast<size_t>(PlaneRole::Rest)];
  StrandBlocks& position = *moving(PlaneRole::Position);
  std::vector<double> arc_m(layout.vertex_count);
  const size_t places = size_t{block_count()} * kBlockStrands;
  for (size_t place = 0; place < places; ++place) {
    // Where no strand is, one more of the first: kernels work on whole blocks.
    uint32_t strand = place < places_ ? layout.strand_at[place] : kNoStrand;
    if (strand == kNoStrand) strand = layout.strand_at[0];
    double length_m = 0.0;
    glm::dvec3 before(0.0);
    for (uint32_t v = 0; v < layout.vertex_count; ++v) {
      const glm::vec3 point = ground_.rest_in_head_m[v * size_t{layout.strand_count} + strand];
      const glm::dvec3 edge = glm::dvec3(point) - before;
      const double segment_m =
          v == 0 ? 0.0 : std::sqrt((edge.x * edge.x + edge.y * edge.y) + edge.z * edge.z);
      length_m += segment_m;
      arc_m[v] = length_m;
      put_vector(rest, place, v, point);
      w_at(rest, place, v) = static_cast<float>(segment_m);
      put_vector(position, place, v, point);
      before = point;
    }
    for (uint32_t v = 0; v < layout.vertex_count; ++v)
      w_at(position, place, v) = length_m > 0.0 ? static_cast<float>(arc_m[v] / length_m) : 0.0f;
  }
}

void Predictor::fill_fixed() {
  const tangent::Layout& layout = ground_.layout;
  for (const PlaneRole role : kernel_.fixed) {
    const auto& values = role == PlaneRole::RodEdge ? model_.rod_edge : model_.rod_strand;
    StrandBlocks& blocks = *fixed_[static_cast<size_t>(role)];
    CHECK(values.size() == size_t{blocks.row_count()} * layout.strand_count);
    for (size_t place = 0; place < size_t{block_count()} * kBlockStrands; ++place) {
      uint32_t strand = place < places_ ? layout.strand_at[place] : kNoStrand;
      if (strand == kNoStrand) strand = layout.strand_at[0];
      for (uint32_t row = 0; row < blocks.row_count(); ++row) {
        const glm::vec4& value = values[row * size_t{layout.strand_count} + strand];
        put_vector(blocks, place, row, glm::vec3(value));
        w_at(blocks, place, row) = value.w;
      }
    }
  }
  // Kept in the blocks from now on.
  model_.rod_edge = {};
  model_.rod_strand = {};
}

void Predictor::set_scene(const StepScene& scene) {
  scene_ = scene;
}

void Predictor::put_positions(const tangent::Planes<int32_t>& decoded, float quantum_m) {
  const tangent::Layout& layout = ground_.layout;
  StrandBlocks& position = *moving(PlaneRole::Position);
  const glm::dmat3 turn = glm::mat3_cast(state_.pose.rotation);
  for (size_t place = 0; place < places_; ++place) {
    if (layout.strand_at[place] == kNoStrand) continue;
    for (uint32_t v = 0; v < layout.vertex_count; ++v) {
      const size_t at = v * size_t{layout.stride} + place;
      const glm::dvec3 point(decoded[0][at], decoded[1][at], decoded[2][at]);
      put_vector(position, place, v, glm::vec3(turn * (static_cast<double>(quantum_m) * point)));
    }
  }
}

void Predictor::start(const Decoded& now, const Decoded& before, double seconds, float quantum_m) {
  const tangent::Layout& layout = ground_.layout;
  state_.pose = now.world_from_head;
  state_.head = HeadPath::at_rest(now.world_from_head.rotation);
  put_positions(now.lattice, quantum_m);
  for (const PlaneRole role : kernel_.moving)
    if (StrandBlocks* blocks = moving(role)) std::fill_n(blocks->data(), blocks->size(), 0.0f);
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  std::fill_n(velocity.data(), velocity.size(), 0.0f);
  if (seconds > 0.0) {
    const glm::dmat3 turn = glm::mat3_cast(before.world_from_head.rotation);
    const glm::dvec3 shift = before.world_from_head.position_m - now.world_from_head.position_m;
    for (size_t place = 0; place < places_; ++place) {
      if (layout.strand_at[place] == kNoStrand) continue;
      for (uint32_t v = 0; v < layout.vertex_count; ++v) {
        const size_t at = v * size_t{layout.stride} + place;
        const glm::dvec3 point(before.lattice[0][at], before.lattice[1][at], before.lattice[2][at]);
        const glm::dvec3 was = turn * (static_cast<double>(quantum_m) * point) + shift;
        const glm::dvec3 speed = (vector_at(*moving(PlaneRole::Position), place, v) - was) / seconds;
        if (glm::dot(speed, speed) < kMostStartMps * kMostStartMps)
          put_vector(velocity, place, v, glm::vec3(speed));
      }
    }
  }
  find_axes();
}

/// Frames without twist along the strands as they are: what direct_rod's kernel does for a strand that it
/// puts back to rest.
void Predictor::find_axes() {
  StrandBlocks* axes = moving(PlaneRole::RodAxis);
  if (axes == nullptr) return;
  const tangent::Layout& layout = ground_.layout;
  const StrandBlocks& edge = *fixed_[static_cast<size_t>(PlaneRole::RodEdge)];
  const StrandBlocks& strand = *fixed_[static_cast<size_t>(PlaneRole::RodStrand)];
  const StrandBlocks& position = *moving(PlaneRole::Position);
  const glm::dmat3 turn = glm::mat3_cast(state_.pose.rotation);
  for (size_t place = 0; place < size_t{block_count()} * kBlockStrands; ++place) {
    glm::dvec3 before = turn * vector_at(strand, place, 0);
    glm::dvec3 axis = turn * vector_at(strand, place, 1);
    for (uint32_t v = model_.pinned_root_count; v < layout.vertex_count; ++v) {
      const glm::dvec3 way = vector_at(position, place, v) - vector_at(position, place, v - 1);
      const double length = std::sqrt(glm::dot(way, way));
      const glm::dvec3 direction = length > 1e-9 ? way / length : before;
      const glm::dvec3 joint =
          v == model_.pinned_root_count ? glm::dvec3(0.0, 0.0, 1.0) : vector_at(edge, place, v);
      const glm::dvec3 tangent = joint.x * axis + joint.y * glm::cross(before, axis) + joint.z * before;
      const glm::dvec3 unstrained = 2.0 * glm::dot(tangent, before) * tangent - before;
      axis = carried(carried(axis, before, unstrained), unstrained, direction);
      put_vector(*axes, place, v, glm::vec3(axis));
      before = direction;
    }
  }
}

/// All vectors of the state, as rebase() of a solver.
void Predictor::turn(const glm::dquat& by) {
  const glm::dmat3 matrix = glm::mat3_cast(by);
  for (const auto& blocks : state_.planes) {
    if (blocks == nullptr) continue;
    for (size_t place = 0; place < size_t{block_count()} * kBlockStrands; ++place)
      for (uint32_t v = 0; v < blocks->row_count(); ++v)
        put_vector(*blocks, place, v, glm::vec3(matrix * vector_at(*blocks, place, v)));
  }
}

void Predictor::run(const StepInput& input) {
  const uint32_t tail = model_.vertex_count - model_.pinned_tail_count;
  const StrandCounts counts{places_, model_.vertex_count, model_.pinned_root_count, tail};
  StepBlock block = make_step_block(input, model_.parameters, counts, state_.head);
  block.follicle_cosine = scene_.follicle_cosine;
  block.follicle_sine = scene_.follicle_sine;
  LanePlanes planes{};
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    planes[role] = fixed_[role] ? fixed_[role].get() : state_.planes[role].get();
  program_->run(block, input.colliders.size(), planes);
  if (has_follicle_limit(input) && model_.pinned_tail_count == 0 &&
      model_.pinned_root_count < model_.vertex_count) {
    if (!kernel_.carries_way) planes[static_cast<size_t>(PlaneRole::Displacement)] = nullptr;
    follicle_program_->run(block, input.colliders.size(), planes);
  }
  state_.head.advance(input);
}

void Predictor::advance(std::span<const StepTick> ticks, double end_time_s) {
  for (size_t i = 0; i < ticks.size(); ++i) {
    const StepTick& tick = ticks[i];
    if (tick.carried_to) turn(state_.head.rebase(tick.carried_to->rotation));
    const double time_s = end_time_s - scene_.step_s * static_cast<double>(ticks.size() - 1 - i);
    for (const StepInput& substep : substeps_of(scene_, tick, state_.pose, time_s)) run(substep);
    state_.pose = tick.world_from_head;
  }
}

void Predictor::expect(float quantum_m, tangent::Planes<int32_t>& lattice) const {
  const Turn head_from_world = turn_of(glm::conjugate(limited_rotation(state_.pose.rotation)));
  tangent::encode_terms(ground_.layout, ground_.workers)
      .for_ranges(block_count(), kBlockGrain, [&](size_t begin, size_t end) {
        expect_blocks(ground_.set, {ground_.layout, *moving(PlaneRole::Position), head_from_world, quantum_m,
                                    lattice, static_cast<uint32_t>(begin), static_cast<uint32_t>(end)});
      });
}

void Predictor::correct(const Correction& of) {
  const double gain = kernel_.carries_way ? 1.5 * kGain : kGain;  // a rod's rates are of second order
  const auto per_second = static_cast<float>(of.seconds > 0.0 ? gain / of.seconds : 0.0);
  const Turn world_from_head = turn_of(limited_rotation(state_.pose.rotation));
  const bool keeps_way = kernel_.carries_way;
  tangent::encode_terms(ground_.layout, ground_.workers)
      .for_ranges(block_count(), kBlockGrain, [&](size_t begin, size_t end) {
        correct_blocks(
            ground_.set,
            {ground_.layout, of.expected, of.decoded, world_from_head, of.quantum_m, per_second,
             model_.pinned_root_count, model_.vertex_count - model_.pinned_tail_count,
             *moving(PlaneRole::Position), *moving(PlaneRole::Velocity),
             keeps_way ? moving(PlaneRole::Displacement) : nullptr, moving(PlaneRole::VelocityChange),
             moving(PlaneRole::RodAxis), static_cast<uint32_t>(begin), static_cast<uint32_t>(end)});
      });
}

template <class Visit>
void Predictor::for_state_planes(Visit visit) const {
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (state_.planes[role] != nullptr && role != static_cast<size_t>(PlaneRole::Position))
      visit(*state_.planes[role], step_of(static_cast<PlaneRole>(role)));
}

void Predictor::settle(const tangent::Planes<int32_t>& decoded, float quantum_m) {
  put_positions(decoded, quantum_m);
  for_state_planes([&](StrandBlocks& blocks, float step) {
    for (uint32_t block = 0; block < block_count(); ++block)
      for (uint32_t v = 0; v < blocks.row_count(); ++v) {
        for (uint32_t axis = 0; axis < 3; ++axis) {
          float* row = blocks.row(block, v, axis);
          for (uint32_t lane = 0; lane < kBlockStrands; ++lane)
            row[lane] = step * static_cast<float>(steps_of(row[lane], step));
        }
        float* row = blocks.row(block, v, 3);
        for (uint32_t lane = 0; lane < kBlockStrands; ++lane) row[lane] = kept(row[lane]);
      }
  });
}

size_t Predictor::most_state_bytes() const {
  size_t floats = 0;
  for_state_planes([&](const StrandBlocks& blocks, float) { floats += blocks.size(); });
  return floats * kMostStepBytes + 1024;
}

// Differences along the strand, then all of one component together: they are alike.
void Predictor::write_state(std::vector<std::byte>& bytes) const {
  ByteWriter to(bytes);
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) to.put(state_.head.turn_per_s[column][row]);
  to.put(state_.head.step_index);
  for_state_planes([&](const StrandBlocks& blocks, float step) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (size_t place = 0; place < places_; ++place) {
        int32_t before = 0;
        for (uint32_t v = 0; v < blocks.row_count(); ++v) {
          const float value =
              blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands];
          const int32_t now = steps_of(value, step);
          uint32_t left = fold_sign(now - before);
          for (; left >= 0x80; left >>= 7) bytes.push_back(static_cast<std::byte>(left | 0x80u));
          bytes.push_back(static_cast<std::byte>(left));
          before = now;
        }
      }
    for (size_t place = 0; place < places_; ++place)
      for (uint32_t v = 0; v < blocks.row_count(); ++v)
        to.put(blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, 3)[place % kBlockStrands]);
  });
}

Status Predictor::read_state(ByteReader& bytes, const Pose& pose) {
  constexpr double kMostTurn = 1e6;
  state_.pose = pose;
  state_.head = HeadPath::at_rest(pose.rotation);
  bool are_usable = true;
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) {
      const auto value = bytes.take<double>();
      are_usable &= std::abs(value) <= kMostTurn;
      state_.head.turn_per_s[column][row] = value;
    }
  state_.head.step_index = bytes.take<uint32_t>();
  for_state_planes([&](StrandBlocks& blocks, float step) {
    for (uint32_t axis = 0; axis < 3; ++axis)
      for (size_t place = 0; place < places_; ++place) {
        uint32_t now = 0;
        for (uint32_t v = 0; v < blocks.row_count(); ++v) {
          uint32_t folded = 0;
          for (uint32_t shift = 0; shift < 32; shift += 7) {
            const auto byte = bytes.take<uint8_t>();
            folded |= static_cast<uint32_t>(byte & 0x7fu) << shift;
            if ((byte & 0x80u) == 0) break;
          }
          now += static_cast<uint32_t>(unfold_sign(folded));
          blocks.row(static_cast<uint32_t>(place / kBlockStrands), v, axis)[place % kBlockStrands] =
              step * static_cast<float>(static_cast<int32_t>(now));
        }
      }
    for (size_t place = 0; place < places_; ++place)
      for (uint32_t v = 0; v < blocks.row_count(); ++v) w_at(blocks, place, v) = bytes.take<float>();
  });
  if (!bytes.ok() || !are_usable)
    return make_error(ErrorCode::BadInput, "the state that steps go on from is cut off or no numbers");
  return {};
}

void Predictor::save() {
  for (size_t role = 0; role < kPlaneRoleCount; ++role) copy_blocks(state_.planes[role], saved_.planes[role]);
  saved_.head = state_.head;
  saved_.pose = state_.pose;
}

void Predictor::restore() {
  std::swap(state_.planes, saved_.planes);
  state_.head = saved_.head;
  state_.pose = saved_.pose;
}

}  // namespace strandcast::step
