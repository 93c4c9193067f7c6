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

Turn step_turn_of(const glm::dquat& rotation) {
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
  const bool has_twist = model_.kernel.variant_of("HAS_TWIST") != 0;
  const KernelDesc follicle =
      follicle_limit_kernel(pass_memory(kernel_.carries_way, has_twist && kernel_.carries_way));
  const LaneKernel* follicle_kernel = find_lane_kernel(follicle, set);
  if (kernel == nullptr || follicle_kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                      model_.kernel.shader_path);
  LaneWork work{places_, vertex_count, true, true, &ground_.workers, ground_.priority};
  // Gusts pull by the model's own drag alone.
  work.has_turbulence = model_.parameters.air_drag_per_s > 0.0;
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
  if (!model_.has_tail.empty()) RETURN_IF_ERROR(prepare_mixed(set));
  RETURN_IF_ERROR(prepare_passes(set));
  return tells_volume(model_) ? prepare_volume(set) : Status{};
}

Status Predictor::prepare_mixed(simd::InstructionSet set) {
  KernelDesc free_tips = model_.kernel;
  free_tips.variant["HAS_PINNED_TAIL"] = 0;
  const LaneKernel* kernel = find_lane_kernel(free_tips, set);
  if (kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                      free_tips.shader_path);
  LaneWork work{places_, model_.vertex_count, true, true, &ground_.workers, ground_.priority};
  work.has_turbulence = model_.parameters.air_drag_per_s > 0.0;
  free_tips_program_.emplace(*kernel, free_tips, work);
  std::vector<uint8_t> has_tail;
  for (uint32_t place = 0; place < places_; ++place) {
    const uint32_t strand = ground_.layout.strand_at[place];
    has_tail.push_back(model_.has_tail[strand == kNoStrand ? ground_.layout.strand_at[0] : strand]);
  }
  ASSIGN_OR_RETURN(mixed_tips_, TipMask::make(has_tail, state_.planes, set, work));
  return {};
}

/// Strands whose tips are held are left alone by all but the drag, as in the simulation.
Status Predictor::prepare_passes(simd::InstructionSet set) {
  const bool has_twist = model_.kernel.variant_of("HAS_TWIST") != 0;
  const int memory = pass_memory(kernel_.carries_way, kernel_.carries_way && has_twist);
  const bool has_free_tips = model_.has_free_tips() && model_.pinned_root_count < model_.vertex_count;
  const auto make = [&](const KernelDesc& desc, std::optional<LaneProgram>& program) -> Status {
    const LaneKernel* kernel = find_lane_kernel(desc, set);
    if (kernel == nullptr)
      return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                        desc.shader_path);
    program.emplace(*kernel, desc,
                    LaneWork{places_, model_.vertex_count, false, true, &ground_.workers, ground_.priority});
    return {};
  };
  if (model_.drag_along_share != 1.0)
    RETURN_IF_ERROR(make(oriented_drag_kernel(model_.drag_along_share, kernel_.carries_way), drag_program_));
  if (!has_free_tips) return {};
  if (model_.bend) RETURN_IF_ERROR(make(bend_limit_kernel(*model_.bend, memory), bend_program_));
  if (model_.meets_body) {
    RETURN_IF_ERROR(make(body_collider_kernel(memory), body_program_));
    state_.body_before = std::make_unique<StrandBlocks>(places_, model_.vertex_count);
  }
  if (model_.field != nullptr) {
    RETURN_IF_ERROR(make(field_collider_kernel(model_.field->grid, memory), field_program_));
    field_before_ = std::make_unique<StrandBlocks>(places_, model_.vertex_count);
    field_table_ = field_quads(*model_.field);
  }
  return {};
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
  options.priority = ground_.priority;
  options.set = ground_.set;
  ASSIGN_OR_RETURN(volume_, VolumeLaw::make(strands, model_.volume, options));
  const KernelDesc desc = volume_->kernel(kernel_.carries_way);
  const LaneKernel* kernel = find_lane_kernel(desc, set);
  if (kernel == nullptr)
    return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                      desc.shader_path);
  volume_program_.emplace(
      *kernel, desc, LaneWork{places_, model_.vertex_count, false, true, &ground_.workers, ground_.priority});
  volume_table_.resize(volume_->most_elements());
  const std::vector<glm::vec4>& density = volume_->rest_density();
  auto blocks = std::make_unique<StrandBlocks>(places_, static_cast<uint32_t>(density.size() / places_));
  pack_blocks(std::span<const glm::vec4>(density), *blocks);
  fixed_[static_cast<size_t>(PlaneRole::RestDensity)] = std::move(blocks);
  volume_->forget_rest_density();
  return {};
}

void Predictor::fill_volume(const StepBlock& block) {
  const auto view = [&](PlaneRole role) { return moving(role)->view(); };
  const PlaneRole motion = kernel_.carries_way ? PlaneRole::Displacement : PlaneRole::Velocity;
  volume_->fill(block, {view(PlaneRole::Position), view(motion), kernel_.carries_way}, volume_table_);
}

void Predictor::run_volume(const StepBlock& block, const LanePlanes& planes) {
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
  const Turn turn = step_turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    place_blocks(ground_.set,
                 {ground_.layout, decoded, turn, quantum_m, *moving(PlaneRole::Position), begin, end});
  });
}

void Predictor::start(const Decoded& now, const Decoded& before, double seconds, float quantum_m) {
  state_.is_body_known = false;
  state_.is_history_known = true;
  state_.pose = now.world_from_head;
  state_.head = HeadPath::at_rest(now.world_from_head.rotation);
  put_positions(now.lattice, quantum_m);
  for (const PlaneRole role : kernel_.moving)
    if (StrandBlocks* blocks = moving(role)) std::fill_n(blocks->data(), blocks->size(), 0.0f);
  StrandBlocks& velocity = *moving(PlaneRole::Velocity);
  std::fill_n(velocity.data(), velocity.size(), 0.0f);
  if (seconds > 0.0) {
    const Turn turn = step_turn_of(limited_rotation(before.world_from_head.rotation));
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
  const Turn turn = step_turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    axes_blocks(ground_.set, {*fixed_[static_cast<size_t>(PlaneRole::RodEdge)],
                              *fixed_[static_cast<size_t>(PlaneRole::RodStrand)], turn,
                              model_.pinned_root_count, *moving(PlaneRole::Position), axes, begin, end});
  });
}

/// All vectors of the state, as rebase() of a solver.
void Predictor::turn(const glm::dquat& by) {
  const Turn matrix = step_turn_of(by);
  for (const auto& blocks : state_.planes)
    if (blocks != nullptr)
      for_blocks([&](uint32_t begin, uint32_t end) {
        turn_blocks(ground_.set, {matrix, *blocks, begin, end});
      });
}

StepBlock Predictor::block_of(const StepInput& input, Tips tips) const {
  const uint32_t tail = model_.vertex_count - (tips == Tips::Free ? 0 : model_.pinned_tail_count);
  const StrandCounts counts{places_, model_.vertex_count, model_.pinned_root_count, tail};
  StepBlock block = make_step_block(input, model_.parameters, counts, state_.head);
  block.follicle_cosine = scene_.follicle_cosine;
  block.follicle_sine = scene_.follicle_sine;
  return block;
}

LanePlanes Predictor::bound_planes() const {
  LanePlanes planes{};
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    planes[role] = fixed_[role] ? fixed_[role].get() : state_.planes[role].get();
  return planes;
}

void Predictor::run(const StepInput& input) {
  const Tips alike = model_.has_free_tips() ? Tips::Free : Tips::Pinned;
  const StepBlock block = block_of(input, alike);
  if (volume_ && input.renews_volume) fill_volume(block);
  if (mixed_tips_ == nullptr) {
    run_kind(input, alike, *program_);
  } else {
    for (const Tips tips : kBothTips) {
      mixed_tips_->keep(other(tips), block, state_.planes);
      run_kind(input, tips, tips == Tips::Free ? *free_tips_program_ : *program_);
      mixed_tips_->put_back(other(tips), block, state_.planes);
    }
  }
  state_.head.advance(input);
}

void Predictor::run_kind(const StepInput& input, Tips tips, LaneProgram& program) {
  const StepBlock block = block_of(input, tips);
  LanePlanes planes = bound_planes();
  if (volume_) run_volume(block, planes);
  LanePlanes of_passes = planes;
  if (!kernel_.carries_way) of_passes[static_cast<size_t>(PlaneRole::Displacement)] = nullptr;
  if (drag_program_) drag_program_->run(block, 0, of_passes);
  program.run(block, input.colliders.size(), planes);
  if (tips == Tips::Pinned) return;
  if (bend_program_) bend_program_->run(block, 0, of_passes);
  if (has_follicle_limit(input) && model_.pinned_root_count < model_.vertex_count)
    follicle_program_->run(block, input.colliders.size(), of_passes);
  if (body_program_ && input.body.acts()) run_body(input, block, of_passes);
  if (field_program_) run_field(block, of_passes);
}

void Predictor::run_body(const StepInput& input, const StepBlock& block, LanePlanes planes) {
  const std::vector<glm::vec4> table = body_table(input.body, limited_substep_s(input), input.body.is_new);
  LaneTables tables{};
  tables[static_cast<size_t>(TableRole::Body)] = {&table.data()->x, static_cast<uint32_t>(table.size())};
  planes[static_cast<size_t>(PlaneRole::PlaceBefore)] = state_.body_before.get();
  body_program_->run(block, 0, planes, tables);
}

/// How near to the body strands may come is not told to joiners: who is inside of it, as it stands before the
/// first substep, has begun there. Who is about as far outside as hair is kept counts as outside: strands
/// that rest there were decoded a little nearer, or farther.
void Predictor::begin_body(const StepInput& first) {
  constexpr float kAbout = 3e-4f;
  StepInput before = first;
  before.world_from_head_rotation = state_.pose.rotation;
  before.head_shift_m = glm::dvec3(0.0);
  before.body.is_new = true;
  before.body.response = BodyResponse::Turn;
  for (BodyCapsule& capsule : before.body.capsules) {
    capsule.from_m = capsule.from_before_m;
    capsule.to_m = capsule.to_before_m;
  }
  LanePlanes planes = bound_planes();
  if (!kernel_.carries_way) planes[static_cast<size_t>(PlaneRole::Displacement)] = nullptr;
  run_body(before, block_of(before, Tips::Free), planes);
  for (uint32_t block = 0; block < block_count(); ++block)
    for (uint32_t v = 0; v < model_.vertex_count; ++v) {
      float* clearance = state_.body_before->row(block, v, 3);
      for (size_t lane = 0; lane < kBlockStrands; ++lane)
        if (clearance[lane] > static_cast<float>(kBodyClearanceM) - kAbout)
          clearance[lane] = static_cast<float>(kMaxColliderM);
    }
}

void Predictor::run_field(const StepBlock& block, LanePlanes planes) {
  LaneTables tables{};
  tables[static_cast<size_t>(TableRole::Field)] = {&field_table_.data()->x,
                                                   static_cast<uint32_t>(field_table_.size())};
  planes[static_cast<size_t>(PlaneRole::PlaceBefore)] = field_before_.get();
  field_program_->run(block, 0, planes, tables);
}

void Predictor::advance(const Origin& origin, std::span<const StepTick> ticks, double end_time_s) {
  for (StrandBlocks* before : {field_before_.get(), state_.body_before.get()}) {
    if (before == nullptr) continue;
    const Turn upright = step_turn_of(glm::dquat(1.0, 0.0, 0.0, 0.0));
    for_blocks([&](uint32_t begin, uint32_t end) {
      place_blocks(ground_.set,
                   {ground_.layout, origin.lattice, upright, origin.quantum_m, *before, begin, end});
    });
  }
  for (size_t i = 0; i < ticks.size(); ++i) {
    const StepTick& tick = ticks[i];
    if (tick.carried_to) turn(state_.head.rebase(tick.carried_to->rotation));
    const double time_s = end_time_s - scene_.step_s * static_cast<double>(ticks.size() - 1 - i);
    const std::vector<StepInput> substeps = substeps_of(scene_, tick, state_.pose, time_s);
    if (body_program_ && substeps.front().body.acts()) {
      if (!state_.is_body_known && !tick.is_body_new) begin_body(substeps.front());
      state_.is_body_known = true;
    }
    if (!state_.is_history_known) find_history(substeps.front());
    for (const StepInput& substep : substeps) run(substep);
    state_.pose = tick.world_from_head;
  }
}

void Predictor::expect(float quantum_m, tangent::Planes<int32_t>& lattice) const {
  const Turn head_from_world = step_turn_of(glm::conjugate(limited_rotation(state_.pose.rotation)));
  for_blocks([&](uint32_t begin, uint32_t end) {
    expect_blocks(ground_.set, {ground_.layout, *moving(PlaneRole::Position), head_from_world, quantum_m,
                                lattice, begin, end});
  });
}

void Predictor::correct(const Correction& of) {
  const auto per_second = static_cast<float>(of.seconds > 0.0 ? kGain / of.seconds : 0.0);
  const Turn world_from_head = step_turn_of(limited_rotation(state_.pose.rotation));
  for_blocks([&](uint32_t begin, uint32_t end) {
    correct_blocks(ground_.set, {ground_.layout, of.expected, of.decoded, world_from_head, of.quantum_m,
                                 per_second, model_.pinned_root_count, model_.free_end(),
                                 *moving(PlaneRole::Position), *moving(PlaneRole::Velocity),
                                 kernel_.carries_way ? moving(PlaneRole::Displacement) : nullptr,
                                 moving(PlaneRole::VelocityChange), moving(PlaneRole::RodAxis), begin, end});
  });
}

/// To memory that is there already, where it fits.
void Predictor::copy_blocks(const std::unique_ptr<StrandBlocks>& from, std::unique_ptr<StrandBlocks>& to) {
  if (from == nullptr) {
    to.reset();
    return;
  }
  if (to == nullptr || to->size() != from->size())
    to = std::make_unique<StrandBlocks>(from->strand_count(), from->row_count());
  std::memcpy(to->data(), from->data(), from->size() * sizeof(float));
}

void Predictor::copy(const State& from, State& to) {
  for (size_t role = 0; role < kPlaneRoleCount; ++role) copy_blocks(from.planes[role], to.planes[role]);
  copy_blocks(from.body_before, to.body_before);
  to.is_body_known = from.is_body_known;
  to.is_history_known = from.is_history_known;
  to.head = from.head;
  to.pose = from.pose;
}

void Predictor::save() {
  copy(state_, saved_);
}

void Predictor::restore() {
  std::swap(state_.planes, saved_.planes);
  std::swap(state_.body_before, saved_.body_before);
  state_.is_body_known = saved_.is_body_known;
  state_.is_history_known = saved_.is_history_known;
  state_.head = saved_.head;
  state_.pose = saved_.pose;
}

}  // namespace strandcast::step
