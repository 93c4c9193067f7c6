// The part of SimLoop that changes between two steps: commands, assignments, and what readers want.
#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "common/base/quantile.h"
#include "common/base/text.h"
#include "common/base/units.h"
#include "common/groom/groom_asset.h"
#include "common/log/log.h"
#include "common/strands/strand_codec.h"
#include "server/source/auto_quality.h"
#include "server/source/scene_change.h"
#include "server/source/sim_loop.h"
#include "server/source/wet_hair.h"

namespace strandcast {
namespace {

constexpr int kTimedSteps = 9;

/// Whether a solver built for one set of facts serves another: only what it compiles for counts.
bool needs_same_solver(const SceneFeatures& a, const SceneFeatures& b) {
  return a.has_wind == b.has_wind && a.has_turbulence == b.has_turbulence &&
         a.has_colliders == b.has_colliders && a.has_follicle_limit == b.has_follicle_limit &&
         a.has_bend_limit == b.has_bend_limit && a.has_oriented_drag == b.has_oriented_drag &&
         a.has_volume == b.has_volume && a.has_distance_field == b.has_distance_field &&
         a.has_body == b.has_body && a.has_followed_strands == b.has_followed_strands &&
         a.has_fewer_vertices == b.has_fewer_vertices && a.has_half_rate == b.has_half_rate;
}

/// What takes long of simulating less of the hair, ahead of when it is less.
Status prepare_guides(const SceneDesc& scene, const Groom& groom, const glm::dvec3& groom_gravity) {
  for (const DetailLevel level : {DetailLevel::Full, DetailLevel::FewerStrands, DetailLevel::FewerVertices}) {
    const SimulatedPart part = simulated_part(scene, {.detail = level}, groom);
    if (part.is_all() || (level != DetailLevel::Full && scene.detail.mode != kDetailAuto)) continue;
    const auto notes = prepare_solver(scene, simulated_groom(groom, part), groom_gravity);
    if (!notes) return notes.error();
  }
  return {};
}

}  // namespace

void SimLoop::carry_out(const Job& job) {
  if (const auto* demand = std::get_if<SourceDemand>(&job.what)) return apply_demand(*demand);
  if (const auto* tap = std::get_if<TapChange>(&job.what)) return apply_tap(*tap);
  if (const auto* noted = std::get_if<Noted>(&job.what)) return tell_tap(*noted, job.who);
  if (std::holds_alternative<Leaving>(job.what)) {
    if (is_counting() && job.who == steps_who_) break_steps("the session that asked for them has ended");
    return;
  }
  const auto* control = std::get_if<ControlCommand>(&job.what);
  const auto* parameter = std::get_if<SetParameter>(&job.what);
  PostedChange posted{tick_, {}, job.who};
  if (control != nullptr)
    posted.what = *control;
  else
    posted.what = *parameter;
  if (config_.tap != nullptr) config_.tap->on_change(posted);
  const std::optional<Notice> notice =
      control != nullptr ? command(*control, job) : change(parameter->assignment, job.content);
  if (config_.tap != nullptr) config_.tap->on_answer(notice.value_or(Notice{false, "Steps follow."}));
  update_stats();  // whoever reads the answer may count on it
  if (job.reply && notice) job.reply(*notice);
}

std::optional<Notice> SimLoop::command(const ControlCommand& command, const Job& job) {
  // Of somebody else: it does not wait for the rest.
  const bool is_refused = command.command == Command::Resume && config_.is_lockstep;
  if (is_counting() && !is_refused) break_steps("somebody else paused, resumed or reset");
  switch (command.command) {
    case Command::Pause:
      clock_->pause();
      return Notice{false, fmt::format("Paused at step {}.", tick_)};
    case Command::Resume:
      if (config_.is_lockstep)
        return Notice{true, "This server runs in lockstep: simulated time goes on by steps (step N) only."};
      clock_->resume(now_ns());
      input_clock_->restart();
      return Notice{false, fmt::format("Running from step {}.", tick_)};
    case Command::StepOnce:
      if (!clock_->add_single_steps(std::max<uint32_t>(command.step_count, 1)))
        return Notice{
            true, "Single steps need a simulation that is paused: strandcast-ctl pause, or the space bar."};
      if (command.step_count == 0) return Notice{false, fmt::format("Step {} follows.", tick_ + 1)};
      counted_steps_ = command.step_count;
      steps_reply_ = job.reply ? job.reply : [](const Notice&) {};
      {
        const std::lock_guard lock(mutex_);
        steps_who_ = job.who;
      }
      steps_begin_ns_ = now_ns();
      steps_begin_tick_ = tick_;
      return std::nullopt;
    case Command::Reset:
      shared_hair_.drop(tick_);
      if (const Status status = solver_->load(config_.content->groom, builder_->world_from_head().rotation);
          !status)
        return Notice{true, status.error().to_string()};
      publish();
      return Notice{false, fmt::format("All strands are at rest at step {}.", tick_)};
  }
  return Notice{true, "Unknown command."};
}

Notice SimLoop::change(const std::string& assignment, std::shared_ptr<const SceneContent> content) {
  const Result<SceneDesc> scene = change_scene(config_.scene, assignment);
  if (!scene) return {true, scene.error().to_string()};
  const SceneFeatures features = analyse(*scene, facts_);
  const bool is_other_solver = moves_otherwise(*scene, config_.scene);
  const bool has_other_shape = is_shaped_otherwise(*scene, config_.scene);
  Status status;
  if (has_other_shape)
    status = reshape(*scene, features, std::move(content));
  else if (is_other_solver || needs_other_solver(*scene, features))
    status = rebuild_solver(*scene, features);
  if (!status) return {true, status.error().to_string()};
  if (scene->substeps != config_.scene.substeps) stages_->plan_step(scene->substeps, explain(*scene, facts_));
  const std::string what = excerpt(assignment, kMaxToldChars);
  const std::string left_out = left_out_note(config_.scene, *scene);
  if (scene->solver.name != config_.scene.solver.name || has_other_shape) quality_reason_.clear();
  config_.scene = *scene;
  if (config_.on_scene) config_.on_scene(config_.scene, assignment);
  builder_->change(stepped_scene(*scene, features), colliders_of(*scene, config_.content->head_colliders));
  detail_.change(scene->detail);
  if (has_other_shape) {
    auto asset =
        std::make_shared<const SceneAsset>(make_scene_asset(config_.content->groom, config_.content->head));
    {
      const std::lock_guard lock(mutex_);
      asset_ = asset;
    }
    sink_.change_shape(std::move(asset));
    publish();
  }
  follow_stream_settings();
  if (has_other_stream())
    return {false, fmt::format("{} soon: the stream changes at most every {} ms.", what,
                               kStreamChangeNs / 1'000'000)};
  return {false,
          fmt::format("{} from step {} on{}{}.", what, tick_ + 1, left_out.empty() ? "" : "; ", left_out)};
}

/// Hair of another length or other curls begins at rest. On an error all is as it was, but at rest.
Status SimLoop::reshape(const SceneDesc& scene, const SceneFeatures& features,
                        std::shared_ptr<const SceneContent> content) {
  if (content == nullptr) {
    ASSIGN_OR_RETURN(SceneContent loaded, load_scene_content(scene));
    content = std::make_shared<const SceneContent>(std::move(loaded));
  }
  const std::shared_ptr<const SceneContent> before = config_.content;
  take_content(std::move(content));
  const Status status = rebuild_solver(scene, features);
  if (status) return {};
  take_content(before);
  CHECK(rebuild_solver(config_.scene, analyse(config_.scene, facts_)).ok());  // as it ran until now
  return status;
}

/// What the next solver is loaded with.
void SimLoop::take_content(std::shared_ptr<const SceneContent> content) {
  config_.content = std::move(content);
  builder_->set_bust(config_.content->bust);
  shared_hair_.drop(tick_);
  solver_.reset();
  is_behind_ = false;
  carried_.reset();
  const Result<float> quantum_m = lattice_step_m(stream_.codec, stream_.bound_m);
  CHECK(quantum_m.ok());  // of a stream that runs
  publisher_.emplace(config_.content->groom, *quantum_m);
}

/// Publishes the present state once more, so that viewers see the change also while paused. Of many settings
/// that come in a short time only the last is ever published.
void SimLoop::follow_stream_settings() {
  const int64_t time_ns = now_ns();
  const bool is_soon = stream_changed_ns_ != 0 && time_ns - stream_changed_ns_ < kStreamChangeNs;
  if (config_.script != nullptr || !has_other_stream() || is_soon) return;
  stream_changed_ns_ = time_ns;
  begin_stream();
}

void SimLoop::begin_stream() {
  stream_ = config_.scene.stream;
  if (config_.tap != nullptr) config_.tap->on_lattice({tick_, stream_});
  const Result<float> quantum_m = lattice_step_m(stream_.codec, stream_.bound_m);
  CHECK(quantum_m.ok());  // the codec cannot change while running
  publisher_->set_quantum_m(*quantum_m);
  sink_.change_stream(stream_);
  publish();
}

/// Builds the scene's solver; strands keep their state.
Status SimLoop::rebuild_solver(const SceneDesc& scene, const SceneFeatures& features) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, moving_parameters(*row, scene));
  catch_up();
  if (solver_ != nullptr) leave_viewers();
  const SimulatedPart part = simulated_part(scene, facts_, config_.content->groom);
  const bool are_followed = !part.is_all();
  const bool are_kept = !are_followed && solver_ != nullptr && solver_->strands() != nullptr;
  const auto strands = are_kept ? strands_ : std::make_shared<StrandState>(*executor_);
  const glm::dvec3& groom_gravity = builder_->groom_gravity_in_head_mps2();
  ASSIGN_OR_RETURN(const auto notes, prepare_solver(scene, config_.content->groom, groom_gravity));
  RETURN_IF_ERROR(prepare_guides(scene, config_.content->groom, groom_gravity));
  const SolverContext context = {executor_.get(),
                                 features,
                                 KernelForm::Auto,
                                 strands,
                                 groom_gravity,
                                 moving_volume(scene, parameters),
                                 config_.content->head_field,
                                 scene.bend_limit,
                                 config_.content->volume_target,
                                 scene.wind.along_share};
  ASSIGN_OR_RETURN(std::unique_ptr<Solver> solver, row->make(parameters, context));
  if (are_followed)
    solver = std::make_unique<FollowedSolver>(
        std::move(solver), part, features.has_distance_field ? config_.content->head_field : nullptr);
  const bool is_first = solver_ == nullptr;
  const glm::dquat& rotation = builder_->world_from_head().rotation;
  RETURN_IF_ERROR(solver_ == nullptr ? solver->load(config_.content->groom, rotation)
                                     : hand_over(*solver_, *solver, config_.content->groom, rotation));
  solver_ = std::move(solver);
  // A solver with strands of its own leaves none behind on the executor.
  strands_ = solver_->strands() != nullptr ? strands : nullptr;
  publisher_->watch_stretch(row->stretch_bound);
  solver_features_ = features;
  solver_part_ = part;
  const uint32_t strand_count = config_.content->groom.strand_count();
  simulated_strands_ = guide_count(strand_count, part.strand_share);
  // Reads planes back, for a codec whose viewers take steps too. What takes no whole steps is not told.
  const bool is_whole = !features.has_half_rate;
  if (strand_codec_info(scene.stream.codec)->predicts)
    step_log_.set_model(is_whole ? solver_->step_model() : nullptr);
  stages_->plan_step(stepped_scene(scene, features).substeps, explain(scene, facts_));
  stages_->set_solver_bytes(solver_->memory_bytes());
  if (++solver_builds_ > 1) built_ns_ = now_ns();
  // The same model, built for other facts, says nothing new.
  if (!is_first && scene.solver == config_.scene.solver) return {};
  log_info("sim", "solver {}: {} strands x {} vertices, {} kB", row->name,
           config_.content->groom.strand_count(), config_.content->groom.uniform_vertex_count(),
           solver_->memory_bytes() / 1000);
  for (const std::string& note : notes) log_info("sim", "{}", note);
  if (const AirDesc& air = scene.volume.air; features.has_volume && air.acts)
    log_info("sim", "hair in air: {:.0f} real hairs on the head (groom.hairs), {:.1f} to a strand", air.hairs,
             air.hairs / simulated_strands_);
  if (!row->has_kernel)
    log_warn("sim", "solver {} is a reference: it runs in double on one thread of the processor", row->name);
  return {};
}

/// Milliseconds of a step of the hair at rest, which is at rest again afterwards.
Result<double> SimLoop::time_step_ms() {
  StepBuilder builder(config_.scene, config_.content->colliders);
  InputFrame input;
  std::vector<double> step_ms;
  for (int step = 1; step <= kTimedSteps; ++step) {
    const SceneStep& taken = builder.build(input, solver_features_, step / config_.scene.step_rate_hz);
    step_ms.push_back(timed_ms(*executor_, [&] {
      for (const StepInput& substep : taken.substeps) solver_->substep(substep);
    }));
  }
  RETURN_IF_ERROR(solver_->load(config_.content->groom, builder_->world_from_head().rotation));
  return median(step_ms);
}

/// Of a scene that leaves its quality to the machine. Simulated time that waits for somebody else has no
/// limit.
Status SimLoop::settle_quality() {
  if (config_.scene.quality != kAutoQuality || config_.is_lockstep || config_.script != nullptr) return {};
  ASSIGN_OR_RETURN(const double step_ms, time_step_ms());
  const AutoQuality judged = auto_quality(step_ms, config_.scene.step_rate_hz);
  quality_reason_ = judged.reason;
  if (judged.is_full) {
    log_info("sim", "quality auto: full, as {}", judged.reason);
    return {};
  }
  log_info("sim", "quality auto: fast, as {}; full looks better: strandcast-ctl set quality=full",
           judged.reason);
  ASSIGN_OR_RETURN(config_.scene, change_scene(config_.scene, std::string("quality=") + kFastQuality));
  config_.scene.quality = kAutoQuality;
  return rebuild_solver(config_.scene, analyse(config_.scene, facts_));
}

void SimLoop::apply_demand(const SourceDemand& demand) {
  const bool was_watched = is_watched();
  has_state_readers_ = demand.has_state_readers;
  hair_px_ = demand.hair_px;
  RuntimeFacts facts = demand.facts;
  facts.has_wind_stream = facts_.has_wind_stream;
  facts.detail = facts_.detail;
  facts.detail_reason = facts_.detail_reason;
  apply_facts(facts);
  follow_detail();
  // The first viewer sees the present state at once, also while paused.
  if (!was_watched && is_watched() && published_tick_ != tick_) publish();
}

/// Between two steps, and never between a change and its answer.
void SimLoop::apply_tap(const TapChange& change) {
  config_.tap = change.tap;
  is_tapped_ = config_.tap != nullptr;
  // What stands still is there once more, for whoever begins with it.
  if (config_.tap != nullptr && clock_->is_paused()) publish();
  change.on_tapped(tick_);
}

void SimLoop::tell_tap(const Noted& noted, const std::string& who) {
  if (config_.tap == nullptr) return;
  config_.tap->on_change({tick_, noted.parameter, who});
  config_.tap->on_answer(noted.answer);
}

void SimLoop::apply_facts(const RuntimeFacts& facts) {
  facts_ = facts;
  const SceneFeatures features = analyse(config_.scene, facts_);
  solver_features_.is_carried = features.is_carried;
  // What is not used is not made anew.
  if (features.is_carried || !needs_other_solver(config_.scene, features)) return;
  if (const Status status = rebuild_solver(config_.scene, features); !status)
    log_error("sim", "the solver in use stays: {}", status.error().to_string());
}

bool SimLoop::needs_other_solver(const SceneDesc& scene, const SceneFeatures& features) const {
  return !needs_same_solver(features, solver_features_) ||
         simulated_part(scene, facts_, config_.content->groom) != solver_part_;
}

/// The scene as its steps are: at half the rate they are twice as long, and where the model cannot bear that
/// each is taken in twice as many parts.
SceneDesc SimLoop::stepped_scene(const SceneDesc& scene, const SceneFeatures& features) {
  SceneDesc stepped = scene;
  if (!features.has_half_rate || features.is_carried) return stepped;
  stepped.step_rate_hz *= 0.5;
  if (!check_solver(stepped)) stepped.substeps *= 2;
  return stepped;
}

/// How much is simulated follows who reads, between two steps. A pause costs nothing and changes nothing, and
/// whoever observes sees all of it.
void SimLoop::follow_detail() {
  const bool is_observed = static_cast<bool>(config_.on_publish) || is_recorded() || clock_->is_paused();
  ReaderSight sight{is_watched(), hair_px_};
  if (is_observed) sight = {.has_readers = true};
  const int64_t time_ns = now_ns();
  if (detail_.update(sight, time_ns)) set_detail(time_ns);
}

void SimLoop::set_detail(int64_t time_ns) {
  RuntimeFacts facts = facts_;
  facts.detail = detail_.level();
  facts.detail_reason = detail_.reason();
  const double rate_before_hz = stepped_scene(config_.scene, solver_features_).step_rate_hz;
  const bool wakes = solver_features_.is_carried && facts.detail != DetailLevel::FollowHead;
  if (wakes) find_head(time_ns);
  apply_facts(facts);
  if (wakes) wake();
  ++detail_changes_;
  carried_.reset();
  const SceneDesc stepped = stepped_scene(config_.scene, solver_features_);
  builder_->change(stepped, colliders_of(config_.scene, config_.content->head_colliders));
  if (wakes || stepped.step_rate_hz != rate_before_hz) input_clock_.emplace(1.0 / stepped.step_rate_hz);
  stages_->plan_step(stepped.substeps, explain(config_.scene, facts_));
  log_info("sim", "step {}: level of detail: {}{}{}", tick_, to_string(facts.detail),
           facts.detail_reason.empty() ? "" : ": ", facts.detail_reason);
}

}  // namespace strandcast
