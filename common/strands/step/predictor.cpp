#include "common/strands/step/predictor.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "common/strands/step/lanes.h"

namespace strandcast::step {
namespace {

using tangent::kNoStrand;

/// Share of what a frame corrects that the velocity takes on. From 0.3 to 0.75 bits differ by some
/// hundredths, on walks as on wild clips; all of it takes a tenth to a fifth more.
constexpr double kGain = 0.45;

Turn turn_of(const glm::dquat& rotation) {
  const glm::dmat3 matrix = glm::mat3_cast(rotation);
  Turn turn;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      turn[static_cast<size_t>(row)][static_cast<size_t>(column)] = static_cast<float>(matrix[column][row]);
  return turn;
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

/// To memory that is there already, where it fits.
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
  if (size_t{layout.no_neighbour()} * layout.vertex_count > kMostStepVertices)
    return make_error(ErrorCode::Unsupported, "{} x {} vertices to predict by steps, at most {} are",
                      layout.strand_count, layout.vertex_count, kMostStepVertices);
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
  const bool has_twist = model_.kernel.variant_of("HAS_TWIST") != 0;
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
  return tells_volume(model_) ? prepare_volume(set) : Status{};
}

/// Places without a strand have no hair.
Status Predictor::prepare_volume(simd::InstructionSet set) {
  const StrandBlocks& rest = *fixed_[static_cast<size_t>(PlaneRole::Rest)];
  std::vector<glm::vec4> rest_in_head_m(size_t{places_} * model_.vertex_count);
  std::vector<float> hairs(places_);
  for (uint32_t place = 0; place < places_; ++place) {
    hairs[place] = ground_.layout.strand_at[place] == kNoStrand ? 0.0f : 1.0f;
    for (uint32_t v = 0; v < model_.vertex_count; ++v)
      for (uint32_t axis = 0; axis < 4; ++axis)
        rest_in_head_m[size_t{v} * places_ + place][static_cast<int>(axis)] =
            rest.row(place / kBlockStrands, v, axis)[place % kBlockStrands];
  }
  const VolumeStrands strands{places_, model_.vertex_count, rest_in_head_m, hairs};
  VolumeOptions options;
  options.workers = &ground_.workers;
  options.priority = Priority::Encoding;
  options.set = ground_.set;
  ASSIGN_OR_RETURN(volume_, VolumeLaw::make(strands, model_.volume, options));
  const KernelDesc desc = volume_->kernel(kernel_.carries_way);
  const LaneKernel* kernel = find_lane_kernel(desc, set);
  if (kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                      desc.shader_path);
  volume_program_.emplace(
      *kernel, desc,
      LaneWork{places_, model_.vertex_count, false, true, &ground_.workers, Priority::Encoding});
  volume_table_.resize(volume_->most_elements());
  const std::vector<glm::vec4>& density = volume_->rest_density();
  auto blocks = std::make_unique<StrandBlocks>(places_, static_cast<uint32_t>(density.size() / places_));
  pack_blocks(std::span<const glm::vec4>(density), *blocks);
  fixed_[static_cast<size_t>(PlaneRole::RestDensity)] = std::move(blocks);
  volume_->forget_rest_density();
  return {};
}

void Predictor::run_volume(const StepInput& input, const StepBlock& block, const LanePlanes& planes) {
  if (input.begins_step) {
    const auto view = [&](PlaneRole role) { return planes[static_cast<size_t>(role)]->view(); };
    const PlaneRole motion = kernel_.carries_way ? PlaneRole::Displacement : PlaneRole::Velocity;
    volume_->fill(block, {view(PlaneRole::Position), view(motion), kernel_.carries_way}, volume_table_);
  }
  LaneTables tables{};
  tables[static_cast<size_t>(TableRole::Volume)] = {&volume_table_.data()->x,
                                                    static_cast<uint32_t>(volume_table_.size())};
  volume_program_->run(block, 0, planes, tables);
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
  const Turn turn = turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    place_blocks(ground_.set,
                 {ground_.layout, decoded, turn, quantum_m, *moving(PlaneRole::Position), begin, end});
  });
}

void Predictor::start(const Decoded& now, const Decoded& before, double seconds, float quantum_m) {
  state_.pose = now.world_from_head;
  state_.head = HeadPath::at_rest(now.world_from_head.rotation);
  put_positions(now.lattice, quantum_m);
  for (const PlaneRole role : kernel_.moving)
    if (StrandBlocks* blocks = moving(role)) std::fill_n(blocks->data(), blocks->size(), 0.0f);
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  std::fill_n(velocity.data(), velocity.size(), 0.0f);
  if (seconds > 0.0) {
    const Turn turn = turn_of(limited_rotation(before.world_from_head.rotation));
    const glm::vec3 shift(before.world_from_head.position_m - now.world_from_head.position_m);
    for_blocks([&](uint32_t begin, uint32_t end) {
      start_blocks(ground_.set, {ground_.layout,
                                 before.lattice,
                                 turn,
                                 {shift.x, shift.y, shift.z},
                                 quantum_m,
                                 static_cast<float>(1.0 / seconds),
                                 *moving(PlaneRole::Position),
                                 velocity,
                                 begin,
                                 end});
    });
  }
  if (StrandBlocks* axes = moving(PlaneRole::RodAxis)) find_axes(*axes);
}

/// Frames without twist along the strands as they are.
void Predictor::find_axes(StrandBlocks& axes) const {
  const Turn turn = turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    axes_blocks(ground_.set, {*fixed_[static_cast<size_t>(PlaneRole::RodEdge)],
                              *fixed_[static_cast<size_t>(PlaneRole::RodStrand)], turn,
                              model_.pinned_root_count, *moving(PlaneRole::Position), axes, begin, end});
  });
}

/// All vectors of the state, as rebase() of a solver.
void Predictor::turn(const glm::dquat& by) {
  const Turn matrix = turn_of(by);
  for (const auto& blocks : state_.planes)
    if (blocks != nullptr)
      for_blocks([&](uint32_t begin, uint32_t end) {
        turn_blocks(ground_.set, {matrix, *blocks, begin, end});
      });
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
  if (volume_) run_volume(input, block, planes);
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
  for_blocks([&](uint32_t begin, uint32_t end) {
    expect_blocks(ground_.set, {ground_.layout, *moving(PlaneRole::Position), head_from_world, quantum_m,
                                lattice, begin, end});
  });
}

void Predictor::correct(const Correction& of) {
  const auto per_second = static_cast<float>(of.seconds > 0.0 ? kGain / of.seconds : 0.0);
  const Turn world_from_head = turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    correct_blocks(ground_.set,
                   {ground_.layout, of.expected, of.decoded, world_from_head, of.quantum_m, per_second,
                    model_.pinned_root_count, model_.vertex_count - model_.pinned_tail_count,
                    *moving(PlaneRole::Position), *moving(PlaneRole::Velocity),
                    kernel_.carries_way ? moving(PlaneRole::Displacement) : nullptr,
                    moving(PlaneRole::VelocityChange), moving(PlaneRole::RodAxis), begin, end});
  });
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
