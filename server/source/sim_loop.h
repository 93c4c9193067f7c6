// SimLoop: the simulation thread with its executor: reads input, steps the solver, publishes. Commands and
// facts arrive through a queue and are carried out between two steps. Commands run one at a time and take at
// most kJobShare of the time. It never waits for a viewer.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>

#include "common/base/histogram.h"
#include "common/base/profile.h"
#include "common/base/result.h"
#include "common/scene/features.h"
#include "common/wire/messages.h"
#include "server/input/input_hub.h"
#include "server/publish/publisher.h"
#include "server/publish/shared_slot.h"
#include "server/scene/input_clock.h"
#include "server/scene/scene_content.h"
#include "server/scene/sim_clock.h"
#include "server/scene/step_builder.h"
#include "server/scene/step_log.h"
#include "server/sim/executor/executor.h"
#include "server/sim/followed_solver.h"
#include "server/sim/solver_registry.h"
#include "server/sim/strand_state.h"
#include "server/source/sim_detail.h"
#include "server/source/sim_stages.h"
#include "server/source/step_tap.h"
#include "server/stream/state_source.h"

namespace strandcast {

/// Observer of every published state, for tests and recordings. Must return quickly.
using SnapshotObserver = std::function<void(const std::shared_ptr<const Snapshot>&)>;

/// Receives the scene as it runs, on the simulation thread: after the start with no assignment, then after
/// each change with its assignment and before its answer. Its look and camera are the loop's, which may be
/// old.
using OnScene = std::function<void(const SceneDesc&, const std::string& assignment)>;

/// Longest time that the steps of one command may take; for more steps a client sends another command.
inline constexpr int64_t kLongestStepsNs = 60'000'000'000;

struct SimLoopConfig {
  SceneDesc scene;
  std::shared_ptr<const SceneContent> content;
  ExecutorConfig device;        // what simulates
  SnapshotObserver on_publish;  // may be empty; on the simulation thread
  // Both outlive the loop. With either every step is published, and nothing is left out for want of readers.
  StepTap* tap = nullptr;  // from the first step on; the loop puts set_tap()'s in its place
  StepScript* script = nullptr;
  bool is_lockstep = false;      // simulated time goes on by commands only
  SharedSlot* shared = nullptr;  // strands that viewers have; may be null
  OnScene on_scene = {};         // may be empty
  int64_t longest_steps_ns = kLongestStepsNs;
};

/// Largest number of commands that may wait for the simulation thread; each can require a new solver.
/// Sessions take turns. If it is reached, the session with most commands gives up one for a session with
/// fewer.
inline constexpr size_t kMaxPendingJobs = 32;
/// Returns the answer to a command that finds no place.
std::string full_queue_text();
/// Largest share of the time that commands may take, so that many changes of solver do not stop the hair.
inline constexpr double kJobShare = 0.25;
/// Shortest time between two changes of the stream's coding, since each costs every viewer a keyframe. The
/// newest settings are used.
inline constexpr int64_t kStreamChangeNs = 500'000'000;
/// Interval at which the loop wakes to report its state while nobody reads and hair only follows the head.
inline constexpr int64_t kAsleepNs = 500'000'000;
/// Number of steps over which the head's velocity is averaged when hair wakes up, since input samples arrive
/// unevenly.
inline constexpr int kHeadPathSteps = 4;

class SimLoop {
 public:
  /// Receives the answer to a command on the simulation thread, or on the caller's if kMaxPendingJobs already
  /// wait.
  using Reply = StateSource::Reply;

  /// Starts the thread. Returns when the solver is loaded and the rest state is published, or with an error.
  /// `hub` and `sink` must outlive the loop.
  static Result<std::unique_ptr<SimLoop>> start(SimLoopConfig config, InputHub& hub, StateSink& sink);
  /// Calls stop() if it was not called.
  ~SimLoop();
  SimLoop(const SimLoop&) = delete;
  SimLoop& operator=(const SimLoop&) = delete;

  // From any thread; return at once.
  void post(const ControlCommand& command, Reply reply, const std::string& who = {});
  void post(const SetParameter& parameter, Reply reply, const std::string& who = {});
  /// Sets what the readers demand; the loop itself determines has_wind_stream.
  void set_demand(const SourceDemand& demand);
  /// Does what StateSource::leave() does.
  void leave(const std::string& who);
  /// Does what StateSource::set_tap() does; `tap` must exist until the loop ends or on_tapped is called for
  /// the next tap.
  void set_tap(StepTap* tap, StateSource::OnTapped on_tapped);
  /// Tells the tap, if there is one, between two steps of a change that nothing simulated follows. False if
  /// kMaxPendingJobs already wait.
  bool note(const SetParameter& parameter, const Notice& answer, const std::string& who);
  SimStats stats() const;
  /// Does what StateSource::wind_mps() does.
  std::optional<glm::vec3> wind_mps() const;
  /// Returns the asset of strands whose shape has changed since the start; null if it has not.
  std::shared_ptr<const SceneAsset> asset() const;
  /// Ends the thread after the current substep or command. Call it from one thread only.
  void stop();
  /// Returns why the simulation ended; empty while it runs.
  std::optional<Error> failure() const;

 private:
  struct TapChange {
    StepTap* tap = nullptr;
    StateSource::OnTapped on_tapped;
  };
  struct Leaving {};  // who asked is gone
  struct Noted {      // carried out elsewhere
    SetParameter parameter;
    Notice answer;
  };
  struct Job {
    std::variant<ControlCommand, SetParameter, SourceDemand, TapChange, Leaving, Noted> what;
    Reply reply;
    std::string who = {};                              // asked for it
    bool is_prepared = false;                          // what takes long of it is done
    std::shared_ptr<const SceneContent> content = {};  // of other lengths or curls, loaded by then

    /// Returns whether the job is a command that waits for its turn; other jobs are all carried out before
    /// the next step.
    bool is_command() const {
      return std::holds_alternative<ControlCommand>(what) || std::holds_alternative<SetParameter>(what);
    }
  };

  SimLoop(SimLoopConfig config, InputHub& hub, StateSink& sink);
  void run(std::function<void(Status)> on_ready);
  Status begin();
  void loop();
  void follow_script();
  void push(Job job);
  bool is_newer_value(const Job& job) const;
  std::deque<Job> wait_for_jobs();
  std::deque<Job> take_jobs();
  bool may_go_now(const Job& job) const;
  std::deque<Job>::iterator next_command();
  std::deque<Job>::iterator least_worthy(const std::string& who);
  void carry_out_in_turn(const Job& job);
  bool starts_to_prepare(const Job& job);
  void carry_out(const Job& job);
  /// Carries out a command; an empty result means that the answer comes later.
  std::optional<Notice> command(const ControlCommand& command, const Job& job);
  void finish_steps();
  void break_steps(const std::string& reason);
  Notice change(const std::string& assignment, std::shared_ptr<const SceneContent> content);
  Status reshape(const SceneDesc& scene, const SceneFeatures& features,
                 std::shared_ptr<const SceneContent> content);
  void take_content(std::shared_ptr<const SceneContent> content);
  void follow_stream_settings();
  void begin_stream();
  bool has_other_stream() const { return config_.scene.stream != stream_; }
  Status rebuild_solver(const SceneDesc& scene, const SceneFeatures& features);
  Status settle_quality();
  Result<double> time_step_ms();
  void apply_demand(const SourceDemand& demand);
  void apply_tap(const TapChange& change);
  void tell_tap(const Noted& noted, const std::string& who);
  void apply_facts(const RuntimeFacts& facts);
  bool is_recorded() const { return config_.tap != nullptr || config_.script != nullptr; }
  bool is_watched() const { return SourceDemand{facts_, has_state_readers_, hair_px_}.is_watched(); }
  void follow_detail();
  void set_detail(int64_t time_ns);
  bool needs_other_solver(const SceneDesc& scene, const SceneFeatures& features) const;
  static SceneDesc stepped_scene(const SceneDesc& scene, const SceneFeatures& features);
  bool is_asleep() const { return solver_features_.is_carried && !is_watched() && !clock_->is_paused(); }
  void sleep_through();
  bool is_counting() const { return static_cast<bool>(steps_reply_); }
  int64_t next_step_ns(int64_t time_ns) const;
  bool shares() const;
  void follow_viewers();
  bool take_over(SharedUpdate update);
  void leave_viewers();
  StageTurn turn();
  void take_input(int64_t time_ns);
  void carry_step();
  void catch_up();
  void find_head(int64_t time_ns);
  void wake();
  void step(int64_t time_ns);
  void publish();
  void publish_carried();
  PublishInput publish_input() const;
  void report_quarantine();
  void report_body();
  void update_stats();

  SimLoopConfig config_;
  InputHub& hub_;
  StateSink& sink_;

  // Of the simulation thread.
  std::unique_ptr<Executor> executor_;
  std::shared_ptr<StrandState> strands_;  // of solvers with a kernel, one after the other; else null
  std::unique_ptr<Solver> solver_;
  SceneFeatures solver_features_;  // what the solver was built for
  SimulatedPart solver_part_;      // of the hair that it simulates
  SimDetail detail_{DetailDesc()};
  uint64_t detail_changes_ = 0;
  uint32_t simulated_strands_ = 0;
  bool is_behind_ = false;      // the head has turned since, and the solver's strands have not gone along
  std::deque<Pose> head_path_;  // of the head that carries hair, a step apart, to the builder's
  std::shared_ptr<const Snapshot> carried_;  // the state that goes with the head, where nothing is simulated
  std::optional<StepBuilder> builder_;
  StepLog step_log_;  // for a codec that predicts by steps
  SharedHair shared_hair_;
  std::optional<Publisher> publisher_;
  std::optional<SimClock> clock_;
  std::optional<InputClock> input_clock_;
  std::optional<SimStages> stages_;
  RuntimeFacts facts_;
  bool has_state_readers_ = false;
  double hair_px_ = 0.0;
  Histogram step_times_;
  InputFrame input_;
  double input_rate_ = 1.0;              // of the newest step, as InputClock has it
  const TakenStep* scripted_ = nullptr;  // the step that a script has taken
  uint64_t next_quarantine_report_ = 1;  // at so many broken strands since start
  std::string quality_reason_;           // of the machine's choice, while it is as it chose
  std::vector<std::string> told_missing_joints_;
  size_t told_capsule_count_ = 0;
  uint64_t next_overstretch_report_ = 1;  // at so many over-stretched ones
  uint64_t tick_ = 0;
  uint64_t published_tick_ = 0;
  uint64_t published_count_ = 0;
  uint64_t solver_builds_ = 0;
  int64_t stats_ns_ = 0;           // when they were made
  StreamDesc stream_;              // as it is published; the scene's is what it is to be
  int64_t stream_changed_ns_ = 0;  // 0 = never
  int64_t head_seen_ns_ = 0;       // when hair that is carried went along with it last
  int64_t jobs_rest_ns_ = 0;       // no command is carried out before
  Reply steps_reply_;              // of the steps under way; who asked for them waits till they are done
  int64_t steps_begin_ns_ = 0;
  uint64_t steps_begin_tick_ = 0;
  uint32_t counted_steps_ = 0;                     // as they were asked for
  std::shared_ptr<const Snapshot> counted_state_;  // published last while steps are counted
  std::atomic<bool> is_tapped_{false};
  std::atomic<int64_t> last_step_ns_{0};
  std::atomic<int64_t> built_ns_{0};       // the newest solver, but for the first
  std::atomic<int64_t> turn_begin_ns_{0};  // of the loop; 0 = it waits for what comes next

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  std::string steps_who_;                    // asked for the steps under way, or for the last ones
  std::map<std::string, uint64_t> turn_of_;  // of those who wait, when they had their last turn
  uint64_t turns_ = 0;
  bool is_preparing_ = false;  // no command is carried out before the one that is being prepared
  std::atomic<bool> is_stopping_{false};
  SimStats stats_;
  std::optional<glm::vec3> wind_mps_;
  std::shared_ptr<const SceneAsset> asset_;
  std::optional<Error> failure_;

  std::jthread preparation_;  // of the command that comes next; started by thread_
  std::thread thread_;        // last: starts when everything else is there
};

}  // namespace strandcast
