#include "server/source/sim_loop.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <future>
#include <utility>

#include "common/base/check.h"
#include "common/base/text.h"
#include "common/base/thread_name.h"
#include "common/groom/head_measure.h"
#include "common/log/log.h"
#include "common/strands/strand_codec.h"
#include "server/sim/followed_solver.h"
#include "server/source/scene_change.h"
#include "server/source/wet_hair.h"

namespace strandcast {
namespace {

constexpr double kNsPerS = 1e9;
/// Medians cost a sort of the window; viewers are told twice a second.
constexpr uint64_t kStatsInterval = 8;
constexpr int64_t kStatsNs = 250'000'000;  // when steps take long
constexpr size_t kMaxToldChars = 200;      // of an assignment, in its answer

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

double median_ms(const gl::PassReports& passes, std::string_view name) {
  for (const gl::PassReport& pass : passes)
    if (pass.name == name) return pass.median_ms;
  return 0.0;
}

}  // namespace

Result<std::unique_ptr<SimLoop>> SimLoop::start(SimLoopConfig config, InputHub& hub, StateSink& sink) {
  std::unique_ptr<SimLoop> loop(new SimLoop(std::move(config), hub, sink));
  auto ready = std::make_shared<std::promise<Status>>();
  loop->thread_ = std::thread([self = loop.get(), ready] {
    name_thread("simulation");
    self->run([ready](Status status) { ready->set_value(std::move(status)); });
  });
  const Status status = ready->get_future().get();
  if (!status) return status.error();
  return loop;
}

SimLoop::SimLoop(SimLoopConfig config, InputHub& hub, StateSink& sink)
    : config_(std::move(config)), hub_(hub), sink_(sink) {}

SimLoop::~SimLoop() {
  stop();
}

void SimLoop::stop() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
  preparation_ = {};  // told to stop, and waited for
}

void SimLoop::run(std::function<void(Status)> on_ready) {
  bool is_ready = false;
  try {
    const Status status = begin();
    is_ready = true;
    on_ready(status);
    if (status && config_.script != nullptr)
      follow_script();
    else if (status)
      loop();
  } catch (const std::exception& exception) {
    const Error error = make_error(ErrorCode::Internal, "the simulation failed: {}", exception.what());
    log_error("sim", "{}", error.message);
    if (!is_ready) on_ready(error);
    const std::lock_guard lock(mutex_);
    failure_ = error;
  }
  // What an executor made goes before it, on this thread.
  solver_.reset();
  strands_.reset();
  executor_.reset();
}

Status SimLoop::begin() {
  ASSIGN_OR_RETURN(executor_, open_executor(config_.device));
  log_info("sim", "simulating on {}", executor_->info().name);
  builder_.emplace(config_.scene, config_.content->colliders);
  detail_.change(config_.scene.detail);
  const StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(stream.codec, stream.bound_m));
  publisher_.emplace(config_.content->groom, quantum_m);
  stream_ = stream;
  look_ = wanted_look();
  const Groom& groom = config_.content->groom;
  const StageSizes sizes{groom.strand_count(), groom.uniform_vertex_count(), config_.scene.substeps,
                         static_cast<uint32_t>(config_.content->colliders.size()),
                         config_.content->head_field ? config_.content->head_field->size_bytes() : 0};
  stages_.emplace(sizes, explain(config_.scene, facts_));
  RETURN_IF_ERROR(rebuild_solver(config_.scene, analyse(config_.scene, facts_)));
  publish();
  clock_.emplace(1.0 / config_.scene.step_rate_hz, now_ns());
  if (config_.is_lockstep) clock_->pause();
  input_clock_.emplace(1.0 / config_.scene.step_rate_hz);
  {
    const std::lock_guard lock(mutex_);
    scene_ = config_.scene;
  }
  update_stats();
  return {};
}

void SimLoop::loop() {
  while (true) {
    turn_begin_ns_ = 0;
    const std::deque<Job> jobs = wait_for_jobs();
    turn_begin_ns_ = now_ns();
    if (is_stopping_) return;
    for (const Job& job : jobs) carry_out_in_turn(job);
    follow_stream_settings();
    follow_look();
    follow_detail();
    if (is_asleep()) {
      sleep_through();
      continue;
    }
    const auto time_ns = clock_->take_step(now_ns());
    if (time_ns) step(next_step_ns(*time_ns));
    if (is_counting() && !clock_->has_single_steps() && !is_stopping_) finish_steps();
    const bool is_old = now_ns() - stats_ns_ >= kStatsNs;
    const bool is_single = clock_->is_paused() && !clock_->has_single_steps();
    const bool has_news = time_ns && (is_single || tick_ % kStatsInterval == 0 || is_old);
    if (has_news) update_stats();
  }
}

/// As fast as it goes. What is posted meanwhile is never taken.
void SimLoop::follow_script() {
  while (!is_stopping_) {
    const StepScript::Next next = config_.script->next();
    if (std::holds_alternative<StepScript::End>(next)) return;
    if (const auto* taken = std::get_if<TakenStep>(&next)) {
      scripted_ = taken;
      step(taken->time_ns);
      scripted_ = nullptr;
    } else if (const auto* change = std::get_if<PostedChange>(&next)) {
      std::visit([&](const auto& what) { carry_out({what, {}, change->who}); }, change->what);
    } else {
      begin_stream();
    }
    follow_look();
  }
}

std::deque<SimLoop::Job> SimLoop::wait_for_jobs() {
  // A job may have asked for a single step: it is taken by the turn of the loop that carries the job out, or,
  // when there are several, by the next ones, which then must not sleep.
  std::unique_lock lock(mutex_);
  const auto is_awake = [this] {
    const auto is_at_once = [](const Job& job) { return !job.is_command(); };
    const bool has_turn = !jobs_.empty() && !is_preparing_ && !is_counting() && now_ns() >= jobs_rest_ns_;
    return is_stopping_ || has_turn || clock_->has_single_steps() ||
           std::any_of(jobs_.begin(), jobs_.end(), is_at_once);
  };
  std::optional<int64_t> wake_ns = clock_->next_due_ns();
  if (is_asleep()) wake_ns = now_ns() + kAsleepNs;
  const auto wake_by = [&](int64_t time_ns) { wake_ns = std::min(wake_ns.value_or(time_ns), time_ns); };
  if (has_other_stream()) wake_by(stream_changed_ns_ + kStreamChangeNs);
  if (has_other_look()) wake_by(look_changed_ns_ + kLookChangeNs);
  if (now_ns() < jobs_rest_ns_) wake_by(jobs_rest_ns_);
  if (wake_ns) {
    const std::chrono::steady_clock::time_point wake{std::chrono::nanoseconds(*wake_ns)};
    changed_.wait_until(lock, wake, is_awake);
  } else {
    changed_.wait(lock, is_awake);
  }
  return take_jobs();
}

/// All news of viewers, and the next command when it has its turn. mutex_ is held.
std::deque<SimLoop::Job> SimLoop::take_jobs() {
  std::deque<Job> taken;
  bool has_command = is_preparing_ || is_counting() || now_ns() < jobs_rest_ns_;
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    if (job->is_command() && std::exchange(has_command, true)) {
      ++job;
      continue;
    }
    taken.push_back(std::move(*job));
    job = jobs_.erase(job);
  }
  return taken;
}

/// After a command others wait, the longer the more it took.
void SimLoop::carry_out_in_turn(const Job& job) {
  if (starts_to_prepare(job)) return;
  const int64_t begin_ns = now_ns();
  carry_out(job);
  // On demand there is no hair that would have to go on meanwhile.
  if (!job.is_command() || config_.is_lockstep) return;
  const int64_t end_ns = now_ns();
  const double rest_ns = static_cast<double>(end_ns - begin_ns) * (1.0 / kJobShare - 1.0);
  jobs_rest_ns_ = end_ns + static_cast<int64_t>(rest_ns);
}

/// A change whose solver takes long to load is prepared beside the loop, where hair goes on; it is carried
/// out, in its place, when that is done.
bool SimLoop::starts_to_prepare(const Job& job) {
  const auto* parameter = std::get_if<SetParameter>(&job.what);
  if (parameter == nullptr || job.is_prepared) return false;
  const Result<SceneDesc> scene = change_scene(config_.scene, parameter->assignment);
  if (!scene || !moves_otherwise(*scene, config_.scene)) return false;
  const Result<const SolverRow*> row = find_solver(scene->solver.name);
  if (!row || !(*row)->prepare) return false;
  {
    const std::lock_guard lock(mutex_);
    is_preparing_ = true;
  }
  preparation_ =
      std::jthread([this, job, scene = *scene, content = config_.content,
                    gravity = builder_->groom_gravity_in_head_mps2()](const std::stop_token& stop) {
        // Its error comes again, and is told, when the change is carried out.
        static_cast<void>(prepare_solver(scene, content->groom, gravity, stop));
        {
          const std::lock_guard lock(mutex_);
          jobs_.push_front(job);
          jobs_.front().is_prepared = true;
          is_preparing_ = false;
        }
        changed_.notify_all();
      });
  return true;
}

void SimLoop::push(Job job) {
  const bool is_demand = std::holds_alternative<SourceDemand>(job.what);
  bool is_full = false;
  {
    const std::lock_guard lock(mutex_);
    // Of the demands only the newest counts.
    if (is_demand)
      std::erase_if(jobs_, [](const Job& old) { return std::holds_alternative<SourceDemand>(old.what); });
    is_full = job.is_command() && jobs_.size() >= kMaxPendingJobs;
    if (!is_full) jobs_.push_back(std::move(job));
  }
  if (!is_full)
    changed_.notify_all();
  else if (job.reply)
    job.reply({true, fmt::format("{} commands are waiting already: try again later.", kMaxPendingJobs)});
}

void SimLoop::post(const ControlCommand& command, Reply reply, const std::string& who) {
  push({command, std::move(reply), who});
}
void SimLoop::post(const SetParameter& parameter, Reply reply, const std::string& who) {
  push({parameter, std::move(reply), who});
}
void SimLoop::set_demand(const SourceDemand& demand) {
  push({demand, {}, {}});
}
void SimLoop::set_tap(StepTap* tap, StateSource::OnTapped on_tapped) {
  push({TapChange{tap, std::move(on_tapped)}, {}, {}});
}

void SimLoop::carry_out(const Job& job) {
  if (const auto* demand = std::get_if<SourceDemand>(&job.what)) return apply_demand(*demand);
  if (const auto* tap = std::get_if<TapChange>(&job.what)) return apply_tap(*tap);
  const auto* control = std::get_if<ControlCommand>(&job.what);
  const auto* parameter = std::get_if<SetParameter>(&job.what);
  PostedChange posted{tick_, {}, job.who};
  if (control != nullptr)
    posted.what = *control;
  else
    posted.what = *parameter;
  if (config_.tap != nullptr) config_.tap->on_change(posted);
  const std::optional<Notice> notice =
      control != nullptr ? command(*control, job.reply) : change(parameter->assignment);
  if (config_.tap != nullptr) config_.tap->on_answer(notice.value_or(Notice{false, "Steps follow."}));
  update_stats();  // whoever reads the answer may count on it
  if (job.reply && notice) job.reply(*notice);
}

std::optional<Notice> SimLoop::command(const ControlCommand& command, const Reply& reply) {
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
        return Notice{true, "StepOnce needs a paused simulation: send Pause first."};
      if (command.step_count == 0) return Notice{false, fmt::format("Step {} follows.", tick_ + 1)};
      counted_steps_ = command.step_count;
      steps_reply_ = reply ? reply : [](const Notice&) {};
      return std::nullopt;
    case Command::Reset:
      if (const Status status = solver_->load(config_.content->groom, builder_->world_from_head().rotation);
          !status)
        return Notice{true, status.error().to_string()};
      publish();
      return Notice{false, fmt::format("All strands are at rest at step {}.", tick_)};
  }
  return Notice{true, "Unknown command."};
}

/// All steps that were asked for are done, and the last one is published.
void SimLoop::finish_steps() {
  update_stats();
  const std::shared_ptr<const Snapshot> state = std::exchange(counted_state_, nullptr);
  Notice notice{false, fmt::format("{} steps done: at step {}.", counted_steps_, tick_), tick_};
  if (state != nullptr) notice.state_hash = state_hash(*state);
  std::exchange(steps_reply_, nullptr)(notice);
}

/// The server time that the end of a step stands for; on demand it is the simulated one.
int64_t SimLoop::next_step_ns(int64_t time_ns) const {
  if (!config_.is_lockstep) return time_ns;
  return std::llround(static_cast<double>(tick_ + 1) / config_.scene.step_rate_hz * kNsPerS);
}

Notice SimLoop::change(const std::string& assignment) {
  const Result<SceneDesc> scene = change_scene(config_.scene, assignment);
  if (!scene) return {true, scene.error().to_string()};
  const SceneFeatures features = analyse(*scene, facts_);
  const bool is_other_solver = moves_otherwise(*scene, config_.scene);
  if (is_other_solver || needs_other_solver(*scene, features))
    if (const Status status = rebuild_solver(*scene, features); !status)
      return {true, status.error().to_string()};
  if (scene->substeps != config_.scene.substeps) stages_->plan_step(scene->substeps, explain(*scene, facts_));
  const std::string what = excerpt(assignment, kMaxToldChars);
  const std::string left_out = left_out_note(config_.scene, *scene);
  config_.scene = *scene;
  {
    const std::lock_guard lock(mutex_);
    scene_ = *scene;
  }
  builder_->change(stepped_scene(*scene, features), colliders_of(*scene, config_.content->head_colliders));
  detail_.change(scene->detail);
  follow_stream_settings();
  follow_look();
  if (has_other_look())
    return {false,
            fmt::format("{} soon: the look changes at most every {} ms.", what, kLookChangeNs / 1'000'000)};
  if (has_other_stream())
    return {false, fmt::format("{} soon: the stream changes at most every {} ms.", what,
                               kStreamChangeNs / 1'000'000)};
  return {false,
          fmt::format("{} from step {} on{}{}.", what, tick_ + 1, left_out.empty() ? "" : "; ", left_out)};
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

/// Nothing is simulated or encoded otherwise: who draws is told. Of many changes in a short time only the
/// last ever is.
void SimLoop::follow_look() {
  const int64_t time_ns = now_ns();
  if (!has_other_look() || (look_changed_ns_ != 0 && time_ns - look_changed_ns_ < kLookChangeNs)) return;
  look_ = wanted_look();
  look_changed_ns_ = time_ns;
  sink_.change_look(look_);
}

/// Builds the scene's solver; strands keep their state.
Status SimLoop::rebuild_solver(const SceneDesc& scene, const SceneFeatures& features) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(scene.solver.name));
  ASSIGN_OR_RETURN(const SolverParameters parameters, moving_parameters(*row, scene));
  catch_up();
  const SimulatedPart part = simulated_part(scene, facts_, config_.content->groom);
  const bool are_followed = !part.is_all();
  const bool are_kept = !are_followed && solver_ != nullptr && solver_->strands() != nullptr;
  const auto strands = are_kept ? strands_ : std::make_shared<StrandState>(*executor_);
  const glm::dvec3& groom_gravity = builder_->groom_gravity_in_head_mps2();
  ASSIGN_OR_RETURN(const auto notes, prepare_solver(scene, config_.content->groom, groom_gravity));
  RETURN_IF_ERROR(prepare_guides(scene, config_.content->groom, groom_gravity));
  const double wetness = scene.look.shading.wetness;
  const SolverContext context = {executor_.get(),
                                 features,
                                 KernelForm::Auto,
                                 strands,
                                 groom_gravity,
                                 wet_volume(scene.volume, wetness),
                                 config_.content->head_field,
                                 scene.bend_limit,
                                 config_.content->volume_target,
                                 scene.wind.along_share};
  ASSIGN_OR_RETURN(std::unique_ptr<Solver> solver, row->make(parameters, context));
  if (are_followed) solver = std::make_unique<FollowedSolver>(std::move(solver), part);
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
  ++solver_builds_;
  // The same model, built for other facts, says nothing new.
  if (!is_first && scene.solver == config_.scene.solver) return {};
  log_info("sim", "solver {}: {} strands x {} vertices, {} kB", row->name,
           config_.content->groom.strand_count(), config_.content->groom.uniform_vertex_count(),
           solver_->memory_bytes() / 1000);
  for (const std::string& note : notes) log_info("sim", "{}", note);
  if (!row->has_kernel)
    log_warn("sim", "solver {} is a reference: it runs in double on one thread of the processor", row->name);
  return {};
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
  // What stands still is there once more, for whoever begins with it.
  if (config_.tap != nullptr && clock_->is_paused()) publish();
  change.on_tapped(tick_);
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
  solver_->rebase(builder_->world_from_head().rotation);
}

/// While the loop slept nobody looked where the head was, and how it moves.
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
  const bool has_path = head_path_.size() > 1 && input_.has_motion && !input_.has_teleported;
  const double passed_s = static_cast<double>(head_path_.size() - 1) / config_.scene.step_rate_hz;
  move_with_head(*solver_,
                 has_path ? head_motion(head_path_.front(), head_path_.back(), passed_s) : HeadMotion{});
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
  take_input(time_ns);
  ++tick_;
  if (solver_features_.is_carried) return carry_step();
  const double end_time_s = static_cast<double>(tick_) / config_.scene.step_rate_hz;
  StageTurn turn(*builder_, *solver_, *publisher_);
  turn.input = input_;
  turn.end_time_s = end_time_s;
  turn.input_rate = input_rate_;
  turn.is_stopping = &is_stopping_;
  CHECK(stages_->step(turn, executor_->timer()).ok());  // stages of a step cannot fail
  if (is_stopping_) return;
  step_times_.add_ms(stages_->last_step_ms());
  if (solver_features_.has_body) report_body();
  step_log_.add(builder_->step_tick(tick_));
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
  snapshot->trail = nullptr;
  if (config_.on_publish) config_.on_publish(snapshot);
  sink_.put(std::move(snapshot));
  published_tick_ = tick_;
  ++published_count_;
}

void SimLoop::publish() {
  catch_up();
  StageTurn turn(*builder_, *solver_, *publisher_);
  PublishInput& input = turn.publish;
  input = publish_input();
  step_log_.set_scene(builder_->step_scene(solver_features_));
  if (!solver_features_.is_carried) input.trail = step_log_.trail();
  CHECK(stages_->publish(turn).ok());  // likewise
  std::shared_ptr<const Snapshot> snapshot = std::move(turn.snapshot);
  if (solver_features_.is_carried) carried_ = snapshot;
  if (is_counting()) counted_state_ = snapshot;
  if (config_.on_publish) config_.on_publish(snapshot);
  sink_.put(std::move(snapshot));
  published_tick_ = tick_;
  ++published_count_;
  if (publisher_->quarantined().empty()) return;
  publisher_->repair(*solver_);
  report_quarantine();
}

/// What of the body is not there, and what hair began inside of it: when that changes.
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
  stats.substeps = config_.scene.substeps;
  stats.strand_rate_hz = config_.scene.stream.strand_rate_hz;
  stats.sim_device = to_string(executor_->info().device);
  stats.sim_device_name = executor_->info().name;
  const std::lock_guard lock(mutex_);
  stats_ = std::move(stats);
}

SimStats SimLoop::stats() const {
  const std::lock_guard lock(mutex_);
  SimStats stats = stats_;
  stats.last_step_ns = last_step_ns_;
  if (const int64_t begin_ns = turn_begin_ns_; begin_ns != 0) stats.busy_ns = now_ns() - begin_ns;
  return stats;
}

SceneDesc SimLoop::scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

std::optional<Error> SimLoop::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace strandcast
