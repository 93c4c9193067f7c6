#include "server/report/stream_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/groom/groom_asset.h"
#include "common/scene/scene_file.h"
#include "common/strands/scene_asset.h"
#include "server/publish/publisher.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/scene/step_log.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

// Strands swing into the motion before anything is recorded.
constexpr double kSettleS = 1.5;
// Of the lattice that the publisher is given and nobody sees.
constexpr float kPublishedBoundM = 1e-4f;

Result<std::unique_ptr<Solver>> make_solver(const SceneDesc& scene, const SceneContent& content,
                                            Executor* executor) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, complete_parameters(*row, scene.solver.parameters));
  RETURN_IF_ERROR(check_step(*row, parameters, kStreamFrameS / scene.substeps));
  if (executor == nullptr) return row->make_reference(parameters);
  SolverContext context{executor, analyse(scene, {})};
  context.volume = scene.volume;
  context.head_field = content.head_field;
  if (scene.quality == kFullQuality) context.groom_gravity_in_head_mps2 = scene.gravity_mps2;
  return row->make(parameters, context);
}

/// As the publisher does: head-relative world axes to head space, in double.
Result<std::vector<glm::vec3>> in_head_m(const SolverState& state, const Pose& world_from_head) {
  std::vector<glm::vec3> positions_m;
  positions_m.reserve(state.position_m.size());
  const glm::dmat3 head_from_world = glm::transpose(glm::mat3_cast(world_from_head.rotation));
  for (const glm::vec3& position : state.position_m) {
    const glm::vec3 in_head(head_from_world * glm::dvec3(position));
    if (!std::isfinite(in_head.x) || !std::isfinite(in_head.y) || !std::isfinite(in_head.z))
      return make_error(ErrorCode::Unsupported, "the solver left numbers that cannot be used");
    positions_m.push_back(in_head);
  }
  return positions_m;
}

/// What the publisher makes of the solver's state, without the lattice. `input` has the tick, its time and
/// trail.
Snapshot published(Publisher& publisher, Solver& solver, const StepBuilder& builder, PublishInput input) {
  input.world_from_head = builder.world_from_head();
  input.head_velocity_mps = builder.head_velocity_mps();
  Snapshot snapshot = *publisher.publish(solver, input);
  snapshot.lattice = {};
  return snapshot;
}

double hair_rms_mps(const std::vector<StreamFrame>& frames) {
  double sum_m2 = 0.0;
  double count = 0.0;
  for (size_t i = 1; i < frames.size(); ++i) {
    const std::vector<glm::vec3>& before = frames[i - 1].position_in_head_m;
    const std::vector<glm::vec3>& now = frames[i].position_in_head_m;
    for (size_t k = 0; k < now.size(); ++k) {
      const glm::dvec3 moved_m = glm::dvec3(now[k]) - glm::dvec3(before[k]);
      sum_m2 += glm::dot(moved_m, moved_m);
    }
    count += static_cast<double>(now.size());
  }
  return count > 0.0 ? std::sqrt(sum_m2 / count) / kStreamFrameS : 0.0;
}

/// Of the weight of dftl's hair, what the groomed shape carries: hair that hangs, and swings as one.
constexpr double kHangingShare = 0.3;

double elapsed_ms(int64_t begin_ns) {
  return static_cast<double>(now_ns() - begin_ns) / kNsPerMs;
}

}  // namespace

SceneDesc recorded_scene(const RecordingDesc& desc) {
  const bool is_full = desc.solver == kFullHair;
  SceneDesc scene = is_full ? built_in_scene_with({"quality=full"}).value() : built_in_scene();
  auto& groom = std::get<ProceduralGroomDesc>(scene.groom);
  groom.strand_count = desc.size.strand_count;
  groom.vertex_count = desc.size.vertex_count;
  scene.step_rate_hz = 1.0 / kStreamFrameS;
  if (is_full) return scene;
  scene.solver.parameters["sag_free"] = kHangingShare;
  if (!desc.solver.empty() && desc.solver != scene.solver.name) scene.solver = {desc.solver, {}};
  return scene;
}

std::string to_string(const StreamSize& size) {
  return fmt::format("{} x {}", size.strand_count, size.vertex_count);
}

Status check_recording(const RecordingDesc& desc) {
  const double bytes =
      std::ceil(desc.seconds / kStreamFrameS) * static_cast<double>(desc.size.vertices() * sizeof(glm::vec3));
  if (bytes > static_cast<double>(kMaxRecordingBytes))
    return make_error(ErrorCode::LimitExceeded,
                      "{:g} s of {} strands are {:.0f} MiB (at most {} are kept in memory)", desc.seconds,
                      to_string(desc.size), bytes / (1 << 20), kMaxRecordingBytes >> 20);
  if (desc.motion.duration_s < desc.seconds)
    return at(desc.motion.name,
              make_error(ErrorCode::BadInput, "the motion lasts {:.2f} s (at least {:g} s are recorded)",
                         desc.motion.duration_s, desc.seconds));
  return {};
}

Result<StreamRecording> record_strands(const RecordingDesc& desc) {
  RETURN_IF_ERROR(check_recording(desc));
  const SceneDesc scene = recorded_scene(desc);
  ASSIGN_OR_RETURN(const SceneContent content, load_scene_content(scene));
  ASSIGN_OR_RETURN(const auto solver, make_solver(scene, content, desc.executor));

  StreamRecording recording;
  recording.motion_name = desc.motion.name;
  recording.moved_by = desc.executor != nullptr ? to_string(desc.executor->info().device) : kMovedByReference;
  recording.solver = desc.solver == kFullHair ? kFullHair : scene.solver.name;
  recording.shape = {desc.size.strand_count, desc.size.vertex_count,
                     make_scene_asset(content.groom, {}).rest_position_m};
  const MotionSurvey survey = survey_motion(desc.motion, desc.seconds);
  recording.motion_level = survey.level;
  recording.part = desc.part;
  const double begin_s = survey.begin_s[static_cast<size_t>(desc.part)];
  // Before the clip's own beginning the head rests in its first pose.
  const auto head_at = [&](double t_s) { return desc.motion.head_at(std::max(0.0, begin_s + t_s)); };

  StepBuilder builder(scene, content.colliders);
  const SceneFeatures features = analyse(scene, {});
  RETURN_IF_ERROR(solver->load(content.groom, head_at(-kSettleS).rotation));
  const auto settle_frames = static_cast<int>(std::lround(kSettleS / kStreamFrameS));
  const auto frame_count = static_cast<int>(std::lround(desc.seconds / kStreamFrameS));
  Publisher publisher(content.groom, quantum_for_bound(kPublishedBoundM));
  StepLog log;
  log.set_model(solver->step_model());
  log.set_scene(builder.step_scene(features));
  std::vector<Pose> poses;
  SolverState state;
  for (int i = -settle_frames; i < frame_count; ++i) {
    const double t_s = i * kStreamFrameS;
    InputFrame input;
    input.has_motion = true;
    input.world_from_head = head_at(t_s);
    const int64_t begin_ns = now_ns();
    const SceneStep& step = builder.build(input, features, kSettleS + t_s);
    for (const StepInput& substep : step.substeps) solver->substep(substep);
    const auto tick = static_cast<uint64_t>(i + settle_frames + 1);
    log.add(builder.step_tick(tick));
    if (i < 0) continue;
    solver->read(state);
    recording.step_ms.push_back(elapsed_ms(begin_ns));
    poses.push_back(input.world_from_head);
    StreamFrame frame;
    ASSIGN_OR_RETURN(frame.position_in_head_m, in_head_m(state, input.world_from_head));
    PublishInput publish;
    publish.tick = tick;
    publish.sim_time_ns = std::llround((kSettleS + t_s) * 1e9);
    publish.trail = log.trail();
    frame.published = published(publisher, *solver, builder, std::move(publish));
    recording.frames.push_back(std::move(frame));
  }
  recording.head = measure_pace(poses, kStreamFrameS);
  recording.hair_rms_mps = hair_rms_mps(recording.frames);
  return recording;
}

}  // namespace strandcast
