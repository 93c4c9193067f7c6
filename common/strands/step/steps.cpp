#include "common/strands/step/steps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/check.h"

namespace strandcast::step {
namespace {

constexpr int kStateLevel = 3;
constexpr double kNsPerS = 1e9;
/// Of a strand or vertex in what is unpacked, for all a model and its state can have.
constexpr size_t kMostBytesPerStrand = 128;
constexpr size_t kMostBytesPerVertex = 192;
constexpr size_t kMostBytesBeside = 1 << 16;
/// Frames with more are better off with fitted weights: of bits_apart().
constexpr double kMostSparseBits = 1.0;
/// Of the same, what steps may tell less than that nothing moved: strands at rest are told well by both.
constexpr double kMostBitsWorse = 1.0;
/// Of vertices every so many are looked at.
constexpr size_t kSampleRun = 8;
constexpr size_t kSampleStep = 128;

Moment moment_of(const SnapshotInfo& info) {
  return {info.tick, info.sim_time_ns, info.world_from_head};
}

size_t most_state_bytes(const tangent::Layout& layout) {
  return kMostBytesBeside + kMostBytesPerStrand * layout.stride + kMostBytesPerVertex * layout.plane_size();
}

void append_packed(ZstdCompressor& zstd, std::span<const std::byte> source, std::vector<std::byte>& to) {
  std::vector<std::byte> packed;
  zstd.append(source, kStateLevel, packed);
  ByteWriter writer(to);
  writer.put(static_cast<uint32_t>(packed.size()));
  writer.put_bytes(packed);
}

/// About how many bits a vertex tell where those of a sample are, when they are expected there.
double bits_apart(const tangent::Layout& layout, const tangent::Planes<int32_t>& expected,
                  const tangent::Planes<int32_t>& target) {
  double bits = 0.0;
  size_t count = 0;
  for (uint32_t v = 1; v < layout.vertex_count; ++v)
    for (size_t run = 0; run < layout.no_neighbour(); run += kSampleStep)
      for (size_t place = run; place < std::min<size_t>(run + kSampleRun, layout.no_neighbour()); ++place) {
        const size_t at = v * size_t{layout.stride} + place;
        double squared = 0.0;
        for (size_t axis = 0; axis < 3; ++axis) {
          const double apart = static_cast<double>(target[axis][at]) - expected[axis][at];
          squared += apart * apart;
        }
        bits += std::log2(1.0 + squared / (tangent::kStepsPerBound * tangent::kStepsPerBound));
        ++count;
      }
  return count == 0 ? 0.0 : bits / static_cast<double>(count);
}

}  // namespace

void Steps::step(std::span<const StepTick> ticks, const Moment& now, const tangent::Layout& layout,
                 tangent::History& history) {
  for (auto& plane : expected_) plane.resize(layout.plane_size());
  predictor_->advance(ticks, static_cast<double>(now.sim_time_ns) / kNsPerS);
  predictor_->expect(history.quantum_m, expected_);
}

void Steps::follow(const Moment& now, const tangent::Frame& frame, const tangent::History& history) {
  const double seconds = static_cast<double>(now.sim_time_ns - last_.sim_time_ns) / kNsPerS;
  if (is_stepping_) {
    predictor_->correct({frame.lattice, history.lattice, seconds, history.quantum_m});
  } else {
    if (next_predictor_) predictor_ = std::move(next_predictor_);
    if (predictor_) {
      predictor_->set_scene(scene_);
      predictor_->start({history.lattice, now.world_from_head}, {frame.lattice, last_.world_from_head},
                        seconds, history.quantum_m);
    }
  }
  next_predictor_.reset();
  is_stepping_ = false;
  last_ = now;
}

void EncoderSteps::set_rest_shape(std::span<const glm::vec3> rest_in_head_m) {
  rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
}

void EncoderSteps::take_scene(const StepScene& scene) {
  write_scene(scene, bytes_);
  ByteReader reader(bytes_);
  Result<StepScene> read = read_scene(reader);
  CHECK(read.ok());
  scene_ = std::move(*read);
}

/// False where this build cannot step it.
bool EncoderSteps::take_model(const std::shared_ptr<const StepModel>& model, const tangent::Layout& layout) {
  told_model_ = model;
  has_model_ = false;
  next_predictor_.reset();
  model_bytes_.clear();
  if (model == nullptr || model->vertex_count != layout.vertex_count ||
      model->strand_count < layout.strand_count)
    return false;
  write_model(*model, layout.strand_count, model_bytes_);
  ByteReader reader(model_bytes_);
  Result<StepModel> read = read_model(reader, layout.strand_count, layout.vertex_count);
  if (!read) return false;
  Result<std::unique_ptr<Predictor>> predictor = Predictor::make(std::move(*read), ground(layout));
  if (!predictor) return false;
  next_predictor_ = std::move(*predictor);
  has_model_ = true;
  return true;
}

void EncoderSteps::restart(const SnapshotInfo& snapshot, const tangent::Layout& layout) {
  predictor_.reset();
  next_predictor_.reset();
  told_model_.reset();
  told_scene_.reset();
  has_model_ = false;
  wind_ = {};
  is_stepping_ = false;
  last_ = moment_of(snapshot);
  bytes_.clear();
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

uint8_t EncoderSteps::begin(const SnapshotInfo& snapshot, const tangent::Layout& layout,
                            tangent::History& history, const tangent::Planes<int32_t>& target) {
  bytes_.clear();
  is_stepping_ = false;
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
    if (take_model(trail.model, layout)) {
      append_packed(zstd_, model_bytes_, bytes_);
      return flags | kModelFlag;
    }
    return flags;
  }
  const uint64_t count = snapshot.tick - last_.tick;
  const bool is_covered = snapshot.tick >= last_.tick && count <= trail.ticks.size() &&
                          (count == 0 || trail.ticks.back().tick == snapshot.tick);
  if (!predictor_ || !has_model_ || !is_covered) return flags;
  std::vector<std::byte> said;
  WindSteps wind = wind_;
  write_ticks(ticks_since(snapshot), wind, said);
  ByteReader reader(said);
  WindSteps wind_read = wind_;
  const Result<std::vector<StepTick>> ticks =
      read_ticks(reader, snapshot.tick, snapshot.world_from_head, wind_read);
  CHECK(ticks.ok());
  step(*ticks, moment_of(snapshot), layout, history);
  // Where steps tell much less than that nothing moved, something else moves the strands.
  const double bits = bits_apart(layout, expected_, target);
  if (bits > bits_apart(layout, history.lattice, target) + kMostBitsWorse) return flags;
  wind_ = wind_read;
  bytes_.insert(bytes_.end(), said.begin(), said.end());
  std::swap(history.lattice, expected_);
  is_stepping_ = true;
  return flags | kStepFlag | (bits <= kMostSparseBits ? kSparseFlag : 0);
}

void EncoderSteps::append_bytes(std::vector<std::byte>& body) const {
  ByteWriter(body).put_bytes(bytes_);
}

void EncoderSteps::finish(const SnapshotInfo& snapshot, const tangent::Frame& frame,
                          const tangent::History& history) {
  follow(moment_of(snapshot), frame, history);
}

void EncoderSteps::settle(const tangent::History& history) {
  wind_ = {};
  if (predictor_) predictor_->settle(history.lattice, history.quantum_m);
}

void EncoderSteps::append_state(std::vector<std::byte>& body) {
  if (!predictor_ || !has_model_) {
    ByteWriter(body).put(uint32_t{0});
    return;
  }
  std::vector<std::byte> state;
  write_scene(scene_, state);
  ByteWriter(state).put_bytes(model_bytes_);
  predictor_->write_state(state);
  append_packed(zstd_, state, body);
}

void DecoderSteps::restart(std::span<const glm::vec3> rest_in_head_m) {
  rest_in_head_m_.assign(rest_in_head_m.begin(), rest_in_head_m.end());
  predictor_.reset();
  next_predictor_.reset();
  is_stepping_ = is_saved_ = false;
}

Result<std::vector<std::byte>> DecoderSteps::unpack(ByteReader& body, size_t most_bytes) {
  const auto size = body.take<uint32_t>();
  const auto packed = body.take_bytes(size);
  if (!body.ok()) return make_error(ErrorCode::BadInput, "what a step needs is cut off");
  ASSIGN_OR_RETURN(const size_t bytes, zstd_content_bytes(packed, most_bytes));
  std::vector<std::byte> unpacked(bytes);
  RETURN_IF_ERROR(zstd_.fill(packed, unpacked));
  return unpacked;
}

Status DecoderSteps::begin(uint8_t flags, const Moment& now, const tangent::Layout& layout, ByteReader& body,
                           tangent::History& history) {
  std::optional<StepScene> scene;
  std::unique_ptr<Predictor> next;
  if ((flags & kSceneFlag) != 0) {
    ASSIGN_OR_RETURN(scene, read_scene(body));
  }
  if ((flags & kModelFlag) != 0) {
    ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, unpack(body, most_state_bytes(layout)));
    ByteReader reader(bytes);
    ASSIGN_OR_RETURN(StepModel model, read_model(reader, layout.strand_count, layout.vertex_count));
    ASSIGN_OR_RETURN(next, Predictor::make(std::move(model), ground(layout)));
  }
  const bool is_step = (flags & kStepFlag) != 0;
  WindSteps wind = wind_;
  std::vector<StepTick> ticks;
  if (is_step) {
    if (!predictor_ || next)
      return make_error(ErrorCode::BadInput, "a frame is predicted by steps of a solver that was not told");
    ASSIGN_OR_RETURN(ticks, read_ticks(body, now.tick, now.world_from_head, wind));
  }
  // From here on nothing fails before the frame's own checks do.
  saved_scene_ = scene_;
  saved_wind_ = wind_;
  is_saved_ = predictor_ != nullptr;
  if (predictor_) predictor_->save();
  if (scene) scene_ = std::move(*scene);
  if (predictor_) predictor_->set_scene(scene_);
  next_predictor_ = std::move(next);
  wind_ = wind;
  is_stepping_ = is_step;
  if (!is_step) return {};
  step(ticks, now, layout, history);
  std::swap(history.lattice, expected_);
  return {};
}

void DecoderSteps::abandon(tangent::History& history) {
  if (is_stepping_) std::swap(history.lattice, expected_);
  is_stepping_ = false;
  next_predictor_.reset();
  scene_ = saved_scene_;
  wind_ = saved_wind_;
  if (is_saved_) predictor_->restore();
  if (predictor_) predictor_->set_scene(scene_);
}

void DecoderSteps::finish(const Moment& now, const tangent::Frame& frame, const tangent::History& history) {
  follow(now, frame, history);
}

void DecoderSteps::settle(const tangent::History& history) {
  wind_ = {};
  if (predictor_) predictor_->settle(history.lattice, history.quantum_m);
}

Result<DecoderSteps::Joined> DecoderSteps::read_state(ByteReader& body, const Moment& now,
                                                      const tangent::Layout& layout) {
  Joined joined;
  ByteReader peek = body;
  if (peek.take<uint32_t>() == 0) {
    body.take<uint32_t>();
    return joined;
  }
  ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, unpack(body, most_state_bytes(layout)));
  ByteReader reader(bytes);
  ASSIGN_OR_RETURN(joined.scene, read_scene(reader));
  ASSIGN_OR_RETURN(StepModel model, read_model(reader, layout.strand_count, layout.vertex_count));
  ASSIGN_OR_RETURN(joined.predictor, Predictor::make(std::move(model), ground(layout)));
  RETURN_IF_ERROR(joined.predictor->read_state(reader, now.world_from_head));
  if (!reader.rest().empty())
    return make_error(ErrorCode::BadInput, "{} bytes follow the state that steps go on from",
                      reader.rest().size());
  return joined;
}

void DecoderSteps::take_over(Joined joined, const Moment& now, const tangent::History& history) {
  predictor_ = std::move(joined.predictor);
  next_predictor_.reset();
  scene_ = std::move(joined.scene);
  wind_ = {};
  last_ = now;
  is_stepping_ = is_saved_ = false;
  if (!predictor_) return;
  predictor_->set_scene(scene_);
  predictor_->put_positions(history.lattice, history.quantum_m);
}

}  // namespace strandcast::step
