// The part of SimLoop that steps, publishes, and tells how it goes.
#include <cmath>
#include <utility>

#include "common/base/check.h"
#include "common/base/units.h"
#include "common/groom/head_measure.h"
#include "common/log/log.h"
#include "server/source/sim_loop.h"

namespace strandcast {
namespace {

double median_ms(const gl::PassReports& passes, std::string_view name) {
  for (const gl::PassReport& pass : passes)
    if (pass.name == name) return pass.median_ms;
  return 0.0;
}

}  // namespace

/// All steps that were asked for are done, and the last one is published.
void SimLoop::finish_steps() {
  update_stats();
  const std::shared_ptr<const Snapshot> state = std::exchange(counted_state_, nullptr);
  Notice notice{false, fmt::format("{} steps done: at step {}.", counted_steps_, tick_), tick_};
  if (state != nullptr) notice.state_hash = state_hash(*state);
  std::exchange(steps_reply_, nullptr)(notice);
}

/// Those that are left of a command are not taken.
void SimLoop::break_steps(const std::string& reason) {
  clock_->pause();
  counted_state_ = nullptr;
  std::exchange(steps_reply_,
                nullptr)(Notice{true, fmt::format("{} of {} steps done, at step {}: {}.",
                                                  tick_ - steps_begin_tick_, counted_steps_, tick_, reason)});
}

/// Nobody reads: time and inputs go on, and nothing else. Whoever comes is served at once.
void SimLoop::sleep_through() {
  const int64_t time_ns = now_ns();
  const uint64_t passed = clock_->skip(time_ns);
  if (passed == 0) return;
  tick_ += passed;
  input_ = hub_.sample(time_ns);
  last_step_ns_ = time_ns;
  update_stats();
}

/// The solver's strands, which have stood still, go along to where the head is now.
void SimLoop::catch_up() {
  if (!std::exchange(is_behind_, false)) return;
  leave_viewers();
  solver_->rebase(builder_->world_from_head().rotation);
}

/// Finds where the head is and how it moves: while the loop slept, nobody looked.
void SimLoop::find_head(int64_t time_ns) {
  is_behind_ = true;
  const double step_ns = kNsPerS / config_.scene.step_rate_hz;
  if (static_cast<double>(time_ns - head_seen_ns_) < 2.0 * step_ns) return;
  tick_ += clock_->skip(time_ns);
  head_path_.clear();
  for (int before = kHeadPathSteps; before >= 0; --before) {
    input_ = hub_.sample(time_ns - static_cast<int64_t>(before * step_ns));
    head_path_.push_back(input_.world_from_head);
  }
  builder_->begin(input_, 0.0);
}

/// Strands go on from where they went along with the head, as fast as it.
void SimLoop::wake() {
  catch_up();
  leave_viewers();
  const bool has_path = head_path_.size() > 1 && input_.has_motion && !input_.has_teleported;
  const double passed_s = static_cast<double>(head_path_.size() - 1) / config_.scene.step_rate_hz;
  move_with_head(*solver_,
                 has_path ? head_motion(head_path_.front(), head_path_.back(), passed_s) : HeadMotion{});
}

/// Returns whether the simulation goes on from the viewers' strands.
bool SimLoop::shares() const {
  return config_.shared != nullptr && config_.script == nullptr && !solver_features_.is_carried &&
         executor_->info().device == SimDevice::Lanes;
}

/// Before a step: takes over the viewers' strands if the encoder has handed them over.
void SimLoop::follow_viewers() {
  if (config_.shared == nullptr) return;
  if (config_.is_lockstep) config_.shared->wait_encoded(published_tick_);
  const bool is_shared = shares();
  // Whoever takes a recorded step again has what its keyframes tell.
  const SharedStates wanted = is_recorded() ? SharedStates::Told : SharedStates::All;
  config_.shared->set_wanted(is_shared ? wanted : SharedStates::None);
  std::optional<SharedUpdate> update = config_.shared->take();
  if (!is_shared) return leave_viewers();
  if (!update) return;
  if (is_recorded() && !update->is_told) update->state = nullptr;
  if (take_over(*update) && config_.tap != nullptr) config_.tap->on_hand_over({tick_, std::move(*update)});
}

/// Returns whether strands go on from this state from now on.
bool SimLoop::take_over(SharedUpdate update) {
  const auto trail = step_log_.trail();
  if (trail == nullptr) return false;
  if (config_.script != nullptr) update.model = trail->model;  // as it was when it was recorded
  return shared_hair_.follow(std::move(update), *trail, config_.scene.step_rate_hz);
}

/// The solver goes on with the strands as they are.
void SimLoop::leave_viewers() {
  shared_hair_.leave(*solver_, builder_->world_from_head().rotation, tick_);
}

StageTurn SimLoop::turn() {
  StageTurn turn(*builder_, *solver_, *publisher_);
  if (!shared_hair_.is_active()) return turn;
  turn.shared = &shared_hair_;
  turn.tick = tick_;
  turn.step_rate_hz = config_.scene.step_rate_hz;
  turn.features = &solver_features_;
  return turn;
}

void SimLoop::take_input(int64_t time_ns) {
  if (scripted_ != nullptr) {
    input_ = scripted_->input;
    input_rate_ = scripted_->input_rate;
  } else {
    // A pause is not caught up.
    if (clock_->is_paused()) input_clock_->restart();
    input_ = hub_.sample(input_clock_->next(time_ns));
    input_rate_ = input_clock_->rate();
  }
  if (config_.tap != nullptr) config_.tap->on_step({tick_ + 1, time_ns, input_rate_, input_});
  if (input_.has_wind_stream == facts_.has_wind_stream) return;
  RuntimeFacts facts = facts_;
  facts.has_wind_stream = input_.has_wind_stream;
  apply_facts(facts);
}

/// Somebody looks from afar: the state goes with the head.
void SimLoop::carry_step() {
  if (input_.has_teleported) head_path_.clear();
  head_path_.push_back(input_.world_from_head);
  if (head_path_.size() > kHeadPathSteps + 1) head_path_.pop_front();
  builder_->begin(input_, static_cast<double>(tick_) / config_.scene.step_rate_hz, input_rate_);
  is_behind_ = true;
  last_step_ns_ = head_seen_ns_ = now_ns();
  if (carried_ == nullptr) return publish();
  publish_carried();
}

void SimLoop::step(int64_t time_ns) {
  const bool is_left_out = solver_features_.has_half_rate && !solver_features_.is_carried &&
                           !clock_->is_paused() && tick_ % 2 == 0;
  if (is_left_out) {
    ++tick_;
    return;
  }
  follow_viewers();
  take_input(time_ns);
  ++tick_;
  if (solver_features_.is_carried) return carry_step();
  const double end_time_s = static_cast<double>(tick_) / config_.scene.step_rate_hz;
  StageTurn turn = this->turn();
  turn.input = input_;
  turn.end_time_s = end_time_s;
  turn.input_rate = input_rate_;
  turn.is_stopping = &is_stopping_;
  CHECK(stages_->step(turn, executor_->timer()).ok());  // stages of a step cannot fail
  if (is_stopping_) return;
  step_times_.add_ms(stages_->last_step_ms());
  if (solver_features_.has_body) report_body();
  const StepTick taken = builder_->step_tick(tick_);
  step_log_.add(taken);
  {
    const std::lock_guard lock(mutex_);
    wind_mps_ = glm::vec3(taken.wind_mps);
  }
  last_step_ns_ = now_ns();
  if (is_watched() || is_recorded() || clock_->is_paused() || tick_ % kIdlePublishSteps == 0) publish();
}

PublishInput SimLoop::publish_input() const {
  PublishInput input;
  input.tick = tick_;
  input.sim_time_ns = std::llround(static_cast<double>(tick_) / config_.scene.step_rate_hz * kNsPerS);
  // On demand, inputs have simulated times, which say nothing of delays.
  input.motion_time_ns = config_.is_lockstep ? 0 : input_.motion_time_ns;
  input.world_from_head = builder_->world_from_head();
  input.bust = builder_->bust();
  input.timecode = input_.timecode;
  return input;
}

/// What was published last, elsewhere: seen from the head it is the same.
void SimLoop::publish_carried() {
  auto snapshot = std::make_shared<Snapshot>(*carried_);
  const PublishInput input = publish_input();
  snapshot->tick = input.tick;
  snapshot->sim_time_ns = input.sim_time_ns;
  snapshot->motion_time_ns = input.motion_time_ns;
  snapshot->world_from_head = input.world_from_head;
  snapshot->bust = input.bust;
  snapshot->trail = nullptr;
  snapshot->timecode = input.timecode;
  if (config_.on_publish) config_.on_publish(snapshot);
  sink_.put(std::move(snapshot));
  published_tick_ = tick_;
  ++published_count_;
}

void SimLoop::publish() {
  catch_up();
  StageTurn turn = this->turn();
  PublishInput& input = turn.publish;
  input = publish_input();
  step_log_.set_scene(builder_->step_scene(solver_features_));
  if (!solver_features_.is_carried) input.trail = step_log_.trail(shared_hair_.number());
  CHECK(stages_->publish(turn).ok());  // likewise
  // Strands that were put back are not those of the viewers any more.
  const bool is_whole = publisher_->quarantined().empty();
  if (shared_hair_.is_active() && is_whole && config_.shared != nullptr && config_.shared->is_read(tick_))
    config_.shared->put_state(tick_, shared_hair_.state());
  std::shared_ptr<const Snapshot> snapshot = std::move(turn.snapshot);
  if (solver_features_.is_carried) carried_ = snapshot;
  if (is_counting()) counted_state_ = snapshot;
  if (config_.on_publish) config_.on_publish(snapshot);
  sink_.put(std::move(snapshot));
  published_tick_ = tick_;
  ++published_count_;
  if (is_whole) return;
  leave_viewers();
  publisher_->repair(*solver_);
  report_quarantine();
}

/// Reports joints of the body that are missing, and hair that began inside of it, when either changes.
void SimLoop::report_body() {
  if (input_.has_motion && builder_->missing_joints() != told_missing_joints_) {
    told_missing_joints_ = builder_->missing_joints();
    for (const std::string& sentence : told_missing_joints_)
      log_warn("sim", "{}: that capsule is left out", sentence);
  }
  const std::vector<BodyCapsule>& capsules = builder_->body_capsules();
  if (capsules.size() == told_capsule_count_) return;
  told_capsule_count_ = capsules.size();
  BodyInput body;
  body.capsules = capsules;
  log_info("sim", "{}", to_sentence(measure_inside(body, config_.content->groom), capsules.size()));
}

/// Once per kind, and again each time its total has doubled: a scene that breaks in every step fills no log.
void SimLoop::report_quarantine() {
  const uint64_t broken = publisher_->quarantine_count();
  if (broken >= next_quarantine_report_) {
    next_quarantine_report_ = 2 * broken;
    log_warn("publish", "step {}: strands without usable numbers are back at rest; {} so far", tick_, broken);
  }
  const uint64_t overstretched = publisher_->overstretch_count();
  if (overstretched >= next_overstretch_report_) {
    next_overstretch_report_ = 2 * overstretched;
    log_warn("publish",
             "step {}: strands of solver {} that had stretched too far are back at rest; {} so far. Stiffer "
             "parameters, more iterations or substeps stretch less",
             tick_, config_.scene.solver.name, overstretched);
  }
}

void SimLoop::update_stats() {
  stats_ns_ = now_ns();
  SimStats stats;
  stats.tick = tick_;
  stats.step_times = step_times_;
  stages_->set_watched(is_watched());
  stats.passes = stages_->report();
  stats.step_median_ms = median_ms(stats.passes, "sim/step");
  stats.read_median_ms = median_ms(stats.passes, "publish/read");
  stats.quantise_median_ms = median_ms(stats.passes, "publish/quantise");
  stats.realtime_factor = clock_->realtime_factor(now_ns());
  stats.is_paused = clock_->is_paused();
  stats.is_motion_stale = input_.is_motion_stale;
  stats.rejected_samples = input_.rejected_samples;
  stats.timecode = input_.timecode;
  stats.dropped_steps = clock_->dropped_steps();
  stats.published = published_count_;
  stats.quarantined = publisher_->quarantine_count();
  stats.overstretched = publisher_->overstretch_count();
  stats.detail = facts_.detail;
  stats.detail_reason = facts_.detail_reason;
  stats.simulated_strands = solver_features_.is_carried ? 0 : simulated_strands_;
  stats.detail_changes = detail_changes_;
  stats.solver_builds = solver_builds_;
  stats.solver_bytes = solver_->memory_bytes();
  stats.step_cost = step_log_.step_cost();
  stats.solver_name = config_.scene.solver.name;
  stats.quality_reason = quality_reason_;
  stats.substeps = config_.scene.substeps;
  stats.strand_rate_hz = config_.scene.stream.strand_rate_hz;
  stats.sim_device = to_string(executor_->info().device);
  stats.sim_device_name = executor_->info().name;
  const std::lock_guard lock(mutex_);
  stats_ = std::move(stats);
}

}  // namespace strandcast
