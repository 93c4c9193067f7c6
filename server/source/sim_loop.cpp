// The part of SimLoop that is its thread: turns, and what waits for one.
#include "server/source/sim_loop.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <future>
#include <set>
#include <string_view>
#include <utility>

#include "common/base/thread_name.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/strands/strand_codec.h"
#include "server/source/scene_change.h"
#include "server/source/wet_hair.h"

namespace strandcast {
namespace {

/// Medians cost a sort of the window; viewers are told twice a second.
constexpr uint64_t kStatsInterval = 8;
constexpr int64_t kStatsNs = 250'000'000;  // when steps take long

}  // namespace

std::string full_queue_text() {
  return fmt::format("{} commands are waiting already: try again later.", kMaxPendingJobs);
}

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
  builder_->set_bust(config_.content->bust);
  detail_.change(config_.scene.detail);
  const StreamDesc& stream = config_.scene.stream;
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(stream.codec, stream.bound_m));
  publisher_.emplace(config_.content->groom, quantum_m);
  stream_ = stream;
  const Groom& groom = config_.content->groom;
  const StageSizes sizes{groom.strand_count(), groom.uniform_vertex_count(), config_.scene.substeps,
                         static_cast<uint32_t>(config_.content->colliders.size()),
                         config_.content->head_field ? config_.content->head_field->size_bytes() : 0};
  stages_.emplace(sizes, explain(config_.scene, facts_));
  RETURN_IF_ERROR(rebuild_solver(config_.scene, analyse(config_.scene, facts_)));
  RETURN_IF_ERROR(settle_quality());
  publish();
  clock_.emplace(1.0 / config_.scene.step_rate_hz, now_ns());
  if (config_.is_lockstep) clock_->pause();
  input_clock_.emplace(1.0 / config_.scene.step_rate_hz);
  is_tapped_ = config_.tap != nullptr;
  if (config_.on_scene) config_.on_scene(config_.scene, {});
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
    follow_detail();
    if (is_asleep()) {
      sleep_through();
      continue;
    }
    const auto time_ns = clock_->take_step(now_ns());
    if (time_ns) step(next_step_ns(*time_ns));
    if (is_counting() && !clock_->has_single_steps() && !is_stopping_) finish_steps();
    if (is_counting() && now_ns() - steps_begin_ns_ >= config_.longest_steps_ns)
      break_steps(fmt::format("a command has {:.0f} s, ask for the rest by another",
                              static_cast<double>(config_.longest_steps_ns) / kNsPerS));
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
    } else if (const auto* hand_over = std::get_if<HandOver>(&next)) {
      take_over(hand_over->update);
    } else {
      begin_stream();
    }
  }
}

std::deque<SimLoop::Job> SimLoop::wait_for_jobs() {
  // A job may have asked for a single step: it is taken by the turn of the loop that carries the job out, or,
  // when there are several, by the next ones, which then must not sleep.
  std::unique_lock lock(mutex_);
  const auto is_awake = [this] {
    const auto is_at_once = [](const Job& job) { return !job.is_command(); };
    const bool has_turn = next_command() != jobs_.end();
    return is_stopping_ || has_turn || clock_->has_single_steps() ||
           std::any_of(jobs_.begin(), jobs_.end(), is_at_once);
  };
  std::optional<int64_t> wake_ns = clock_->next_due_ns();
  if (is_asleep()) wake_ns = now_ns() + kAsleepNs;
  const auto wake_by = [&](int64_t time_ns) { wake_ns = std::min(wake_ns.value_or(time_ns), time_ns); };
  if (has_other_stream()) wake_by(stream_changed_ns_ + kStreamChangeNs);
  if (now_ns() < jobs_rest_ns_) wake_by(jobs_rest_ns_);
  if (wake_ns) {
    const std::chrono::steady_clock::time_point wake{std::chrono::nanoseconds(*wake_ns)};
    changed_.wait_until(lock, wake, is_awake);
  } else {
    changed_.wait(lock, is_awake);
  }
  return take_jobs();
}

/// While steps are counted, commands of who asked for them wait, and so do steps of others; all else of
/// others comes between two steps. mutex_ is held.
bool SimLoop::may_go_now(const Job& job) const {
  if (!is_counting()) return true;
  const auto* control = std::get_if<ControlCommand>(&job.what);
  return job.who != steps_who_ && (control == nullptr || control->command != Command::StepOnce);
}

/// Of the first commands of all sessions that of the one whose turn was longest ago. mutex_ is held.
std::deque<SimLoop::Job>::iterator SimLoop::next_command() {
  if (is_preparing_ || now_ns() < jobs_rest_ns_) return jobs_.end();
  auto next = jobs_.end();
  uint64_t next_turn = 0;
  std::set<std::string_view> seen;
  for (auto job = jobs_.begin(); job != jobs_.end(); ++job) {
    if (!job->is_command()) continue;
    if (job->is_prepared) return job;  // it had its turn
    if (!seen.insert(job->who).second || !may_go_now(*job)) continue;
    const auto found = turn_of_.find(job->who);
    const uint64_t turn = found == turn_of_.end() ? 0 : found->second;
    if (next != jobs_.end() && turn >= next_turn) continue;
    next = job;
    next_turn = turn;
  }
  return next;
}

/// Takes all news of viewers, and the next command if one is due. mutex_ is held.
std::deque<SimLoop::Job> SimLoop::take_jobs() {
  std::deque<Job> taken;
  if (const auto next = next_command(); next != jobs_.end()) {
    turn_of_[next->who] = ++turns_;
    taken.push_back(std::move(*next));
    jobs_.erase(next);
  }
  for (auto job = jobs_.begin(); job != jobs_.end();) {
    if (job->is_command()) {
      ++job;
      continue;
    }
    taken.push_back(std::move(*job));
    job = jobs_.erase(job);
  }
  // Whoever waits for nothing has no turn to remember.
  std::erase_if(turn_of_, [&](const auto& entry) {
    return entry.second + kMaxPendingJobs < turns_ &&
           std::none_of(jobs_.begin(), jobs_.end(), [&](const Job& job) { return job.who == entry.first; });
  });
  return taken;
}

/// The newest command of the session that has most waiting, if it has more than one above `who`; else none.
/// mutex_ is held.
std::deque<SimLoop::Job>::iterator SimLoop::least_worthy(const std::string& who) {
  std::map<std::string_view, size_t> count_of;
  for (const Job& job : jobs_)
    if (job.is_command()) ++count_of[job.who];
  const auto most = std::max_element(count_of.begin(), count_of.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == count_of.end() || most->second <= count_of[who] + 1) return jobs_.end();
  for (auto job = jobs_.end(); job != jobs_.begin();)
    if (--job; job->is_command() && !job->is_prepared && job->who == most->first) return job;
  return jobs_.end();
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
  const bool has_other_shape = scene && is_shaped_otherwise(*scene, config_.scene);
  if (!scene || !(has_other_shape || moves_otherwise(*scene, config_.scene))) return false;
  const Result<const SolverRow*> row = find_solver(scene->solver.name);
  if (!row || !(has_other_shape || (*row)->prepare)) return false;
  {
    const std::lock_guard lock(mutex_);
    is_preparing_ = true;
  }
  preparation_ =
      std::jthread([this, job, scene = *scene, content = config_.content, has_other_shape,
                    gravity = builder_->groom_gravity_in_head_mps2()](const std::stop_token& stop) mutable {
        // Its error comes again, and is told, when the change is carried out.
        if (has_other_shape)
          if (auto other = load_scene_content(scene))
            content = std::make_shared<const SceneContent>(std::move(other).value());
        static_cast<void>(prepare_solver(scene, content->groom, gravity, stop));
        {
          const std::lock_guard lock(mutex_);
          jobs_.push_front(job);
          jobs_.front().is_prepared = true;
          if (has_other_shape) jobs_.front().content = content;
          is_preparing_ = false;
        }
        changed_.notify_all();
      });
  return true;
}

/// Whether a slider that is dragged says otherwise before the value that waits last had its turn: only the
/// newest counts then. Commands of a server in lockstep are all carried out. Under the lock.
bool SimLoop::is_newer_value(const Job& job) const {
  if (config_.is_lockstep || jobs_.empty() || jobs_.back().is_prepared) return false;
  const auto* newer = std::get_if<SetParameter>(&job.what);
  const auto* older = std::get_if<SetParameter>(&jobs_.back().what);
  if (newer == nullptr || older == nullptr) return false;
  const std::string path = newer->assignment.substr(0, newer->assignment.find('='));
  return path.starts_with("hair.") && older->assignment.starts_with(path + '=');
}

void SimLoop::push(Job job) {
  const bool is_demand = std::holds_alternative<SourceDemand>(job.what);
  bool is_full = false;
  std::optional<Job> older;
  std::optional<Job> left_out;
  {
    const std::lock_guard lock(mutex_);
    if (is_newer_value(job)) {
      older = std::move(jobs_.back());
      jobs_.pop_back();
    }
    // Of the demands only the newest counts.
    if (is_demand)
      std::erase_if(jobs_, [](const Job& old) { return std::holds_alternative<SourceDemand>(old.what); });
    is_full = job.is_command() && jobs_.size() >= kMaxPendingJobs;
    if (is_full) {
      if (const auto place = least_worthy(job.who); place != jobs_.end()) {
        left_out = std::move(*place);
        jobs_.erase(place);
        is_full = false;
      }
    }
    if (!is_full) jobs_.push_back(std::move(job));
  }
  if (older && older->reply) older->reply({false, "Left out: a newer value came before its turn."});
  if (left_out && left_out->reply)
    left_out->reply({true, "Left out: your commands filled the queue, and somebody else has some, too."});
  if (!is_full)
    changed_.notify_all();
  else if (job.reply)
    job.reply({true, full_queue_text()});
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
void SimLoop::leave(const std::string& who) {
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(jobs_, [&](const Job& job) {
      const auto* control = std::get_if<ControlCommand>(&job.what);
      return control != nullptr && control->step_count > 0 && job.who == who;
    });
    if (who != steps_who_) return;
  }
  push({Leaving{}, {}, who});
}
void SimLoop::set_tap(StepTap* tap, StateSource::OnTapped on_tapped) {
  push({TapChange{tap, std::move(on_tapped)}, {}, {}});
}

bool SimLoop::note(const SetParameter& parameter, const Notice& answer, const std::string& who) {
  if (!is_tapped_) return true;
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() >= kMaxPendingJobs) return false;
    jobs_.push_back({Noted{parameter, answer}, {}, who});
  }
  changed_.notify_all();
  return true;
}

/// The server time that the end of a step stands for; on demand it is the simulated one.
int64_t SimLoop::next_step_ns(int64_t time_ns) const {
  if (!config_.is_lockstep) return time_ns;
  return std::llround(static_cast<double>(tick_ + 1) / config_.scene.step_rate_hz * kNsPerS);
}

std::shared_ptr<const SceneAsset> SimLoop::asset() const {
  const std::lock_guard lock(mutex_);
  return asset_;
}

std::optional<glm::vec3> SimLoop::wind_mps() const {
  const std::lock_guard lock(mutex_);
  return wind_mps_;
}

SimStats SimLoop::stats() const {
  const std::lock_guard lock(mutex_);
  SimStats stats = stats_;
  stats.last_step_ns = last_step_ns_;
  stats.built_ns = is_preparing_ ? now_ns() : built_ns_.load();
  if (const int64_t begin_ns = turn_begin_ns_; begin_ns != 0) stats.busy_ns = now_ns() - begin_ns;
  return stats;
}

std::optional<Error> SimLoop::failure() const {
  const std::lock_guard lock(mutex_);
  return failure_;
}

}  // namespace strandcast
