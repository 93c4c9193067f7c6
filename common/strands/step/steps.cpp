#include "common/strands/step/steps.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/base/check.h"
#include "common/base/hash.h"
#include "common/base/units.h"

namespace strandcast::step {
namespace {

/// Frames with more are better off with fitted weights: of bits_apart().
constexpr double kMostSparseBits = 0.5;
/// Of the same, what steps may tell less than that nothing moved: strands at rest are told well by both.
constexpr double kMostBitsWorse = 1.0;
/// Of vertices every so many are looked at.
constexpr size_t kSampleRun = 8;
constexpr size_t kSampleStep = 128;

// What a keyframe says of its state.
constexpr uint8_t kNoState = 0, kCoarseState = 1, kFineState = 2;

/// What ticks count from after a fine anchor: the chest is known.
TickBase base_of(const Moment& moment, BustCode chest) {
  TickBase base;
  base.chest = chest;
  base.bust = bust_turn(chest, moment.world_from_head.rotation);
  return base;
}

Moment moment_of(const SnapshotInfo& info) {
  return {info.tick, info.sim_time_ns, info.world_from_head};
}

/// Of what the bytes before the integers say: most of it moves no vertex far enough in this frame for the
/// state hash to tell, and all of the next ones a little.
uint16_t check_of(uint8_t flags, std::span<const std::byte> bytes) {
  uint32_t hash = mix_u32(flags);
  for (const std::byte byte : bytes) hash = mix_u32(hash ^ std::to_integer<uint32_t>(byte));
  return static_cast<uint16_t>(hash);
}

/// About how many bits tell where vertices of a sample are, when they are expected there.
struct VolumeSample {
  double bits = 0.0;
  double vertices = 0.0;

  double mean() const { return vertices > 0.0 ? bits / vertices : 0.0; }
};
VolumeSample bits_apart(const tangent::Layout& layout, const tangent::Planes<int32_t>& expected,
                        const tangent::Planes<int32_t>& target) {
  VolumeSample sample;
  for (uint32_t v = 1; v < layout.vertex_count; ++v)
    for (size_t run = 0; run < layout.no_neighbour(); run += kSampleStep)
      for (size_t place = run; place < std::min<size_t>(run + kSampleRun, layout.no_neighbour()); ++place) {
        const size_t at = v * size_t{layout.stride} + place;
        double squared = 0.0;
        for (size_t axis = 0; axis < 3; ++axis) {
          const double apart = static_cast<double>(target[axis][at]) - expected[axis][at];
          squared += apart * apart;
        }
        sample.vertices += 1.0;
        sample.bits += std::log2(1.0 + squared / (tangent::kStepsPerBound * tangent::kStepsPerBound));
      }
  return sample;
}

/// Returns whether strands lie where they were decoded. If not, and no time has passed, they were placed.
bool is_near(const tangent::Planes<int32_t>& decoded, const tangent::Planes<int32_t>& target) {
  for (size_t axis = 0; axis < 3; ++axis)
    for (size_t i = 0; i < target[axis].size(); ++i)
      if (std::abs(decoded[axis][i] - target[axis][i]) > tangent::kStepsPerBound) return false;
  return true;
}

}  // namespace

void Steps::step(std::span<const StepTick> ticks, const Moment& now, const tangent::Layout& layout,
                 tangent::History& history) {
  for (auto& plane : expected_) plane.resize(layout.plane_size());
  predictor_->advance({history.lattice, history.quantum_m}, ticks,
                      static_cast<double>(now.sim_time_ns) / kNsPerS);
  predictor_->expect(history.quantum_m, expected_);
}

void Steps::follow(const Moment& now, const tangent::Frame& frame, const tangent::History& history) {
  const double seconds = static_cast<double>(now.sim_time_ns - last_.sim_time_ns) / kNsPerS;
  if (is_stepping_ && rounding_ != Rounding::Coarse) {
    ++age_;  // strands are placed when they settle
  } else if (is_stepping_ || is_following_) {
    predictor_->correct(
        {is_stepping_ ? frame.lattice : expected_, history.lattice, seconds, history.quantum_m});
    ++age_;
  } else {
    age_ = seconds > 0.0 ? 1 : 0;
    if (next_predictor_) predictor_ = std::move(next_predictor_);
    if (predictor_) {
      predictor_->set_scene(scene_);
      predictor_->start({history.lattice, now.world_from_head}, {frame.lattice, last_.world_from_head},
                        seconds, history.quantum_m);
    }
  }
  next_predictor_.reset();
  is_stepping_ = is_following_ = false;
  last_ = now;
}

void Steps::follow_exact(const Moment& now) {
  ++age_;
  is_stepping_ = false;
  last_ = now;
}

void Steps::settle(const tangent::History& history) {
  base_ = rounding_ != Rounding::Coarse ? base_of(last_, base_.chest) : TickBase{};
  if (!predictor_) return;
  if (rounding_ != Rounding::Coarse)
    predictor_->settle_finely(history.lattice, history.quantum_m, rounding_,
                              told_guess_ ? &*told_guess_ : nullptr);
  else
    predictor_->settle(history.lattice, history.quantum_m);
}

void EncoderSteps::set_rest_shape(std::span<const glm::vec3> rest_in_head_m) {
  rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
}

void EncoderSteps::take_scene(const StepScene& scene) {
  const size_t begin = bytes_.size();
  scene_ = told_scene(scene, bytes_);
  scene_hash_ = hash_bytes(std::span(bytes_).subspan(begin));
}

/// From here on the state is the predictor's own.
void EncoderSteps::own_state() {
  if (handed_ == nullptr) return;
  predictor_->set_state(handed_->state);
  handed_.reset();
}

/// False where this build cannot step it.
bool EncoderSteps::take_model(const std::shared_ptr<const StepModel>& model, const tangent::Layout& layout) {
  told_model_ = model;
  has_model_ = false;
  next_predictor_.reset();
  model_bytes_.clear();
  if (model == nullptr || rest_in_head_m_.size() != size_t{layout.strand_count} * layout.vertex_count ||
      model->vertex_count != layout.vertex_count || model->strand_count < layout.strand_count)
    return false;
  write_model(*model, rest_in_head_m_, layout.strand_count, model_bytes_, scene_.groom_gravity_in_head_mps2);
  ByteReader reader(model_bytes_);
  Result<StepModel> read = read_model(reader, rest_in_head_m_, layout.strand_count, layout.vertex_count);
  if (!read) return false;
  Result<std::unique_ptr<Predictor>> predictor = Predictor::make(std::move(*read), ground(layout));
  if (!predictor) return false;
  next_predictor_ = std::move(*predictor);
  has_model_ = true;
  return true;
}

void EncoderSteps::restart(const SnapshotInfo& snapshot, const tangent::Layout& layout) {
  predictor_.reset();
  handed_.reset();
  next_predictor_.reset();
  told_model_.reset();
  told_scene_.reset();
  has_model_ = false;
  told_state_.reset();
  base_ = {};
  is_stepping_ = is_following_ = is_handing_ = is_settled_ = false;  // of the last frame, by another lattice
  last_ = moment_of(snapshot);
  bytes_.clear();
  flags_ = 0;
  rounding_ = Rounding::Coarse;
  is_disturbed_ = true;
  shared_tick_ = 0;
  if (snapshot.trail == nullptr || snapshot.trail->scene == nullptr) return;
  take_scene(*snapshot.trail->scene);
  told_scene_ = snapshot.trail->scene;
  take_model(snapshot.trail->model, layout);
}

std::span<const StepTick> EncoderSteps::ticks_since(const SnapshotInfo& snapshot) const {
  const std::vector<StepTick>& ticks = snapshot.trail->ticks;
  if (snapshot.tick < last_.tick) return {};
  const uint64_t count = snapshot.tick - last_.tick;
  if (count > ticks.size()) return {};
  return std::span(ticks).last(count);
}

/// Returns the frame's step flags: steps predict it, steps run along while motion predicts it, or 0 where
/// steps do not help.
uint8_t EncoderSteps::judge(const tangent::Layout& layout, const tangent::History& history,
                            const tangent::Planes<int32_t>& target) const {
  constexpr uint32_t kFirstFrames = 1;     // strands without velocities rather start anew
  constexpr double kMostBitsBeside = 8.0;  // of a vertex
  const double by_steps = bits_apart(layout, expected_, target).mean();
  if (by_steps <= kMostSparseBits) return kStepFlag | kSparseFlag;
  const double by_nothing = bits_apart(layout, history.lattice, target).mean();
  if (by_steps <= by_nothing + kMostBitsWorse) return kStepFlag;
  return by_steps <= by_nothing + kMostBitsBeside && age_ >= kFirstFrames ? kFollowFlag : 0;
}

void EncoderSteps::begin(const SnapshotInfo& snapshot, const tangent::Layout& layout) {
  bytes_.clear();
  said_.clear();
  ticks_.reset();
  is_stepping_ = is_following_ = is_handing_ = is_settled_ = false;
  rounding_ = Rounding::Coarse;
  flags_ = say(snapshot, layout);
}

/// The flags of what is told anew, with its bytes_; ticks_ where steps can lead to the snapshot.
uint8_t EncoderSteps::say(const SnapshotInfo& snapshot, const tangent::Layout& layout) {
  if (snapshot.trail == nullptr || snapshot.trail->scene == nullptr) return 0;
  const StepTrail& trail = *snapshot.trail;
  uint8_t flags = 0;
  if (trail.scene != told_scene_) {
    take_scene(*trail.scene);
    told_scene_ = trail.scene;
    flags |= kSceneFlag;
    if (predictor_) predictor_->set_scene(scene_);
  }
  if (trail.model != told_model_) {
    if (!take_model(trail.model, layout)) return flags;
    ByteWriter(bytes_).put_bytes(model_bytes_);
    return flags | kModelFlag;
  }
  const uint64_t count = snapshot.tick - last_.tick;
  const bool is_covered = snapshot.tick >= last_.tick && count <= trail.ticks.size() &&
                          (count == 0 || trail.ticks.back().tick == snapshot.tick);
  if (!predictor_ || !has_model_ || !is_covered) return flags;
  if (vertex_rounds(predictor_->model(), scene_, count) > kMostVertexRounds) return flags;
  next_base_ = base_;
  ticks_ =
      told_ticks(ticks_since(snapshot), {snapshot.tick, snapshot.world_from_head}, scene_, next_base_, said_);
  is_handing_ = count == 1 && hands(trail, snapshot);
  return flags;
}

/// Returns whether the simulation has taken the viewers' next step, from their state.
bool EncoderSteps::hands(const StepTrail& trail, const SnapshotInfo& snapshot) {
  next_told_ = told_after(told_, {scene_hash_, said_, snapshot.world_from_head, snapshot.sim_time_ns});
  if (told_state_ == nullptr || shared_number_ == 0 || trail.shared != shared_number_ || is_disturbed_)
    return false;
  return told_state_->tick == snapshot.tick && told_state_->quantum_m == snapshot.quantum_m &&
         told_state_->told == next_told_;
}

uint8_t EncoderSteps::predict(const SnapshotInfo& snapshot, const tangent::Layout& layout,
                              tangent::History& history, tangent::Planes<int32_t>& target) {
  if (!ticks_) return flags_;
  uint8_t how = kStepFlag | kSparseFlag;
  if (is_handing_) {
    std::swap(expected_, told_state_->lattice);
  } else {
    own_state();
    step(*ticks_, moment_of(snapshot), layout, history);
    step_count_ += ticks_->size();
    if (ticks_->empty() && !is_near(history.lattice, target)) return flags_;
    how = judge(layout, history, target);
    if (is_waiting(snapshot) && (snapshot.trail->shared != 0 || (how & kSparseFlag) != 0)) {
      how = kStepFlag | kSparseFlag;
      target = expected_;
    }
  }
  if (how == 0) return flags_;
  base_ = std::move(next_base_);
  bytes_.insert(bytes_.end(), said_.begin(), said_.end());
  is_stepping_ = (how & kStepFlag) != 0;
  is_following_ = how == kFollowFlag;
  if (is_stepping_) std::swap(history.lattice, expected_);
  return flags_ |= how;
}

/// Returns whether the simulation has yet to take over the newest update. Its strands are then those that it
/// is about to forget, so that corrections towards them would be wrong one moment later.
bool EncoderSteps::is_waiting(const SnapshotInfo& snapshot) const {
  return shared_number_ != 0 && snapshot.trail->shared != shared_number_ &&
         snapshot.tick - shared_tick_ <= kMostTrailTicks;  // later it cannot be taken over any more
}

void EncoderSteps::append_bytes(std::span<const std::byte> head, std::vector<std::byte>& body) const {
  if (flags_ == 0) return;
  std::vector<std::byte> said(head.begin(), head.end());
  said.insert(said.end(), bytes_.begin(), bytes_.end());
  ByteWriter writer(body);
  writer.put(check_of(flags_ & kTellingFlags, said));
  writer.put_bytes(said);
}

void EncoderSteps::finish(const SnapshotInfo& snapshot, const tangent::Frame& frame,
                          const tangent::History& history) {
  const bool is_corrected = frame.lattice != history.lattice;
  end(snapshot, !is_stepping_ || is_corrected);
  if (is_handing_ && !is_corrected && rounding_ == Rounding::Coarse) return follow_exact(moment_of(snapshot));
  own_state();
  follow(moment_of(snapshot), frame, history);
}

void EncoderSteps::finish_exact(const SnapshotInfo& snapshot) {
  end(snapshot, false);
  follow_exact(moment_of(snapshot));
}

/// Of a frame that is done: which state viewers have, and whether more than their step led to it.
void EncoderSteps::end(const SnapshotInfo& snapshot, bool is_disturbed) {
  is_disturbed_ = is_disturbed_ || is_disturbed || snapshot.tick != last_.tick + 1;
  told_ = next_told_;
  if (is_handing_) handed_ = told_state_;
  told_state_.reset();
}

std::shared_ptr<SharedUpdate> EncoderSteps::take_shared(SharedStates which, const tangent::Layout& layout,
                                                        const tangent::History& history) {
  if (which == SharedStates::Told && !is_settled_) return nullptr;
  constexpr uint32_t kFirstFrames = 4;  // strands that start without velocities are not the simulation's yet
  const bool is_whole = told_model_ != nullptr && told_model_->strand_count == layout.strand_count;
  if (!is_disturbed_ || !predictor_ || !has_model_ || !is_whole || age_ < kFirstFrames) return nullptr;
  if (layout.plane_size() > kMostSharedVertices) return nullptr;
  auto update =
      std::make_shared<SharedUpdate>(SharedUpdate{++shared_number_, last_.tick, told_model_, nullptr});
  update->is_told = is_settled_;
  shared_tick_ = last_.tick;
  if (shared_model_ != told_model_) {
    ByteReader reader(model_bytes_);
    Result<StepModel> model = read_model(reader, rest_in_head_m_, layout.strand_count, layout.vertex_count);
    CHECK(model.ok());
    Result<std::shared_ptr<SharedSteps>> strands =
        SharedSteps::make(std::move(*model), rest_in_head_m_, workers_, set_);
    CHECK(strands.ok());  // as the predictor's
    update->strands = std::move(*strands);
    shared_model_ = told_model_;
  }
  own_state();
  std::shared_ptr<PredictedState> state = shared_states_.make(predictor_->state());
  state->base = base_;
  state->lattice = history.lattice;
  state->quantum_m = history.quantum_m;
  state->tick = last_.tick;
  state->told = told_ = told_from(last_);
  update->state = std::move(state);
  is_disturbed_ = false;
  return update;
}

void EncoderSteps::settle(const tangent::History& history) {
  own_state();
  Steps::settle(history);
  if (predictor_ && rounding_ == Rounding::Fine) predictor_->guess().write(bytes_);
  is_disturbed_ = is_settled_ = true;
}

void EncoderSteps::append_state(std::vector<std::byte>& body) {
  const bool has_state = predictor_ && has_model_;
  ByteWriter(body).put(!has_state ? kNoState : rounding_ == Rounding::Fine ? kFineState : kCoarseState);
  if (!has_state) return;
  write_scene(scene_, body);
  ByteWriter(body).put_bytes(model_bytes_);
  predictor_->write_state(body);
}

void DecoderSteps::restart(std::span<const glm::vec3> rest_in_head_m) {
  rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
  predictor_.reset();
  next_predictor_.reset();
  is_stepping_ = is_following_ = is_saved_ = false;
}

Status DecoderSteps::begin(const Beginning& beginning, const Moment& now, const tangent::Layout& layout,
                           ByteReader& body, tangent::History& history) {
  const uint8_t flags = beginning.flags;
  const auto announced = static_cast<uint16_t>((flags & kFlags) != 0 ? body.take<uint16_t>() : 0);
  const std::span<const std::byte> all = body.rest();
  body.take_bytes(beginning.head_bytes);
  std::optional<StepScene> scene;
  std::unique_ptr<Predictor> next;
  if ((flags & kSceneFlag) != 0) {
    ASSIGN_OR_RETURN(scene, read_scene(body));
  }
  if ((flags & kModelFlag) != 0) {
    ASSIGN_OR_RETURN(StepModel model,
                     read_model(body, rest_in_head_m_, layout.strand_count, layout.vertex_count));
    ASSIGN_OR_RETURN(next, Predictor::make(std::move(model), ground(layout)));
  }
  const bool is_step = (flags & kStepFlag) != 0;
  const bool is_following = (flags & kFollowFlag) != 0;
  TickBase base = base_;
  std::vector<StepTick> ticks;
  if (is_step || is_following) {
    if (!predictor_ || next || (is_step && is_following))
      return make_error(ErrorCode::BadInput, "a frame is predicted by steps of a solver that was not told");
    ASSIGN_OR_RETURN(ticks, read_ticks(body, {now.tick, now.world_from_head}, scene ? *scene : scene_, base));
    const uint64_t work = vertex_rounds(predictor_->model(), scene ? *scene : scene_, ticks.size());
    if (work > kMostVertexRounds)
      return make_error(ErrorCode::LimitExceeded, "steps of {} rounds of vertices in a frame, at most {}",
                        work, kMostVertexRounds);
  }
  std::optional<VelocityGuess> guess;
  if ((flags & kFineFlag) != 0 && beginning.fine == Rounding::Fine) {
    ASSIGN_OR_RETURN(guess, VelocityGuess::read(body));
  }
  const uint16_t check = check_of(flags & kTellingFlags, all.first(all.size() - body.rest().size()));
  if ((flags & kTellingFlags) != 0 && check != announced)
    return make_error(ErrorCode::BadInput,
                      "what a frame says of steps has check {:04x}, announced was {:04x}", check, announced);
  // From here on nothing fails before the frame's own checks do.
  saved_scene_ = scene_;
  saved_base_ = base_;
  is_saved_ = predictor_ != nullptr;
  if (predictor_) predictor_->save();
  if (scene) scene_ = std::move(*scene);
  if (predictor_) predictor_->set_scene(scene_);
  next_predictor_ = std::move(next);
  base_ = std::move(base);
  is_stepping_ = is_step;
  is_following_ = is_following;
  rounding_ = (flags & kFineFlag) != 0 ? beginning.fine : Rounding::Coarse;
  told_guess_ = std::move(guess);
  if (!is_step && !is_following) return {};
  step(ticks, now, layout, history);
  if (is_step) std::swap(history.lattice, expected_);
  return {};
}

void DecoderSteps::abandon(tangent::History& history) {
  if (is_stepping_) std::swap(history.lattice, expected_);
  is_stepping_ = is_following_ = false;
  next_predictor_.reset();
  scene_ = saved_scene_;
  base_ = saved_base_;
  if (is_saved_) predictor_->restore();
  if (predictor_) predictor_->set_scene(scene_);
}

void DecoderSteps::finish(const Moment& now, const tangent::Frame& frame, const tangent::History& history) {
  follow(now, frame, history);
}

void DecoderSteps::settle(const tangent::History& history) {
  Steps::settle(history);
}

Result<Rounding> DecoderSteps::read_state(ByteReader& body, const Moment& now, const tangent::Layout& layout,
                                          Rounding fine) {
  joined_ = {};
  const auto kind = body.take<uint8_t>();
  if (kind == kNoState) return Rounding::Coarse;
  if (kind > kFineState) return make_error(ErrorCode::BadInput, "a keyframe has a state of kind {}", kind);
  const Rounding rounding = kind == kFineState ? fine : Rounding::Coarse;
  if (rounding != Rounding::Coarse) joined_.base = base_of(now, now.bust);
  ASSIGN_OR_RETURN(joined_.scene, read_scene(body));
  ASSIGN_OR_RETURN(StepModel model,
                   read_model(body, rest_in_head_m_, layout.strand_count, layout.vertex_count));
  shared_.reset();
  if (keeps_shared_ && model.strand_count == layout.strand_count) {
    shared_ = std::make_shared<SharedUpdate>();
    ASSIGN_OR_RETURN(shared_->strands, SharedSteps::make(model, rest_in_head_m_, workers_, set_));
  }
  ASSIGN_OR_RETURN(joined_.predictor, Predictor::make(std::move(model), ground(layout)));
  RETURN_IF_ERROR(joined_.predictor->read_state(body, now.world_from_head, rounding));
  return rounding;
}

void DecoderSteps::take_over(const Moment& now, const tangent::History& history) {
  predictor_ = std::move(joined_.predictor);
  next_predictor_.reset();
  scene_ = std::move(joined_.scene);
  base_ = std::move(joined_.base);
  last_ = now;
  is_stepping_ = is_following_ = is_saved_ = false;
  if (!predictor_) return;
  predictor_->set_scene(scene_);
  predictor_->place(history.lattice, history.quantum_m);
  if (shared_ == nullptr) return;
  auto state = std::make_shared<PredictedState>();
  Predictor::copy(predictor_->state(), state->state);
  state->base = base_;
  state->lattice = history.lattice;
  state->quantum_m = history.quantum_m;
  state->tick = shared_->tick = now.tick;
  shared_->number = 1;
  shared_->is_told = true;
  shared_->state = std::move(state);
}

}  // namespace strandcast::step
