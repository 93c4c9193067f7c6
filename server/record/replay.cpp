#include "server/record/replay.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/base/version.h"
#include "common/record/recording_reader.h"
#include "common/scene/scene_file.h"
#include "common/strands/asset/head.h"
#include "common/strands/asset/lattice.h"
#include "common/strands/shared_strands.h"
#include "server/record/recorded_step.h"

namespace strandcast {
namespace {

constexpr int64_t kProgressNs = 2'000'000'000;
constexpr std::chrono::milliseconds kPoll{50};
constexpr const char* kStatesTopic = "/states";

struct MadeState {
  uint64_t tick = 0;
  uint64_t hash = 0;
};

/// The states that a recording's keyframes tell, in their order.
class ToldStates {
 public:
  static Result<std::unique_ptr<ToldStates>> open(const std::filesystem::path& recording) {
    auto states = std::make_unique<ToldStates>();
    ASSIGN_OR_RETURN(states->reader_, RecordingReader::open(recording, RecordedPart::Frames));
    ASSIGN_OR_RETURN(const SceneAsset asset, states->reader_->asset());
    states->limits_ = {asset.strand_count, asset.vertex_count};
    states->rest_in_head_m_ = asset.rest_position_m;
    return states;
  }
  Result<SharedUpdate> find(const RecordedHandOver& wanted) {
    while (true) {
      ASSIGN_OR_RETURN(const auto item, reader_->next());
      if (!item)
        return make_error(ErrorCode::NotFound, "the keyframe of step {} is not in the recording",
                          wanted.frame_tick);
      const EncodedFramePtr& frame = std::get<RecordedFrame>(item->what).frame;
      const bool is_keyframe = frame->header.opcode == Opcode::StrandKeyframe;
      if (!is_keyframe || frame->header.sequence != wanted.frame_sequence) continue;
      ASSIGN_OR_RETURN(SharedUpdate update,
                       read_shared(frame->message, limits_, rest_in_head_m_, shared_workers()));
      if (update.tick == wanted.frame_tick) return update;
    }
  }

 private:
  std::unique_ptr<RecordingReader> reader_;
  StrandStreamLimits limits_;
  std::vector<glm::vec3> rest_in_head_m_;
};

/// Gives the simulation what the recording has, and holds what comes of it against what is recorded.
class ReplayScript : public StepScript, public StateSink {
 public:
  ReplayScript(RecordingReader& reader, const ReplayConfig& config) : reader_(reader), config_(config) {
    const RecordingContents contents = reader.contents();
    const auto states = contents.find(kStatesTopic);
    progress_.recorded = states != contents.end() ? states->second.items : 0;
  }

  // On the simulation thread.
  Next next() override {
    const Next action = find_action();
    if (std::holds_alternative<End>(action)) end();
    return action;
  }
  void put(std::shared_ptr<const Snapshot> state) override {
    made_.push_back({state->tick, state_hash(*state)});
  }
  void change_stream(const StreamDesc&) override {}
  void change_look(const LookChange&) override {}
  void change_shape(std::shared_ptr<const SceneAsset>) override {}

  /// True when it has ended.
  bool wait(std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, longest, [this] { return has_ended_; });
  }
  /// Once the simulation has stopped.
  const ReplayResult& result() const { return result_; }

 private:
  Next find_action();
  Next take_over(const RecordedHandOver& hand_over);
  void compare(const RecordedState& recorded);
  bool differs(uint64_t tick, std::string what);
  void wait_for_turn(int64_t time_ns);
  void end();
  bool is_stopped() const { return config_.stop != nullptr && *config_.stop; }

  RecordingReader& reader_;
  const ReplayConfig& config_;
  std::unique_ptr<ToldStates> told_;  // from the first hand-over on
  std::deque<MadeState> made_;
  ReplayResult result_;
  ReplayProgress progress_;
  int64_t told_ns_ = now_ns();
  std::optional<int64_t> behind_ns_;  // server clock then against the clock now

  std::mutex mutex_;
  std::condition_variable changed_;
  bool has_ended_ = false;
};

void ReplayScript::end() {
  {
    const std::lock_guard lock(mutex_);
    has_ended_ = true;
  }
  changed_.notify_all();
}

/// What the simulation does next; states that stand before it are compared.
StepScript::Next ReplayScript::find_action() {
  while (!is_stopped()) {
    auto item = reader_.next();
    if (!item) {
      result_.early_end =
          fmt::format("step {} on is damaged: {}", progress_.tick + 1, item.error().to_string());
      return End{};
    }
    if (!*item) return End{};
    const auto& message = std::get<RecordedMessage>((*item)->what);
    if (const auto* state = std::get_if<RecordedState>(&message)) {
      compare(*state);
      if (result_.difference) return End{};
      continue;
    }
    if (const auto* loss = std::get_if<RecordedLoss>(&message); loss != nullptr && loss->messages > 0) {
      result_.early_end = fmt::format("{} messages behind step {} were lost when it was recorded",
                                      loss->messages, progress_.tick);
      return End{};
    }
    const bool is_action =
        std::holds_alternative<RecordedStep>(message) || std::holds_alternative<RecordedChange>(message) ||
        std::holds_alternative<RecordedStream>(message) || std::holds_alternative<RecordedHandOver>(message);
    if (!is_action) continue;
    if (!made_.empty()) {
      differs(made_.front().tick, "was published now, and was not when it was recorded");
      return End{};
    }
    if (const auto* step = std::get_if<RecordedStep>(&message)) {
      wait_for_turn(step->time_ns);
      return to_taken(*step);
    }
    if (const auto* change = std::get_if<RecordedChange>(&message))
      return PostedChange{change->tick, change->what, change->who};
    if (const auto* hand_over = std::get_if<RecordedHandOver>(&message)) return take_over(*hand_over);
    return LatticeChange{std::get<RecordedStream>(message).tick, {}};
  }
  result_.early_end = fmt::format("it was stopped after step {}", progress_.tick);
  return End{};
}

StepScript::Next ReplayScript::take_over(const RecordedHandOver& hand_over) {
  const auto find = [&]() -> Result<SharedUpdate> {
    if (told_ == nullptr) {
      ASSIGN_OR_RETURN(told_, ToldStates::open(config_.recording));
    }
    return told_->find(hand_over);
  };
  Result<SharedUpdate> update = find();
  if (update) return HandOver{hand_over.tick, std::move(*update)};
  result_.early_end = fmt::format("after step {} strands of a keyframe were taken over: {}", hand_over.tick,
                                  update.error().to_string());
  return End{};
}

void ReplayScript::compare(const RecordedState& recorded) {
  progress_.tick = recorded.tick;
  if (made_.empty()) {
    differs(recorded.tick, "was recorded, and is not published now");
    return;
  }
  const MadeState made = made_.front();
  made_.pop_front();
  ++result_.compared;
  if (made.tick != recorded.tick)
    differs(recorded.tick, fmt::format("was recorded, and step {} is published now", made.tick));
  else if (made.hash != recorded.state_hash)
    differs(recorded.tick,
            fmt::format("has the hash {:016x}, and {:016x} was recorded", made.hash, recorded.state_hash));
  else
    ++result_.equal;
  progress_.compared = result_.compared;
  if (!config_.on_progress || now_ns() - told_ns_ < kProgressNs) return;
  told_ns_ = now_ns();
  config_.on_progress(progress_);
}

bool ReplayScript::differs(uint64_t tick, std::string what) {
  result_.difference = ReplayDifference{tick, std::move(what)};
  return true;
}

void ReplayScript::wait_for_turn(int64_t time_ns) {
  if (config_.pace == ReplayPace::AsFastAsItGoes) return;
  if (!behind_ns_) behind_ns_ = now_ns() - time_ns;
  std::unique_lock lock(mutex_);
  while (!is_stopped() && now_ns() < time_ns + *behind_ns_) {
    const auto left = std::chrono::nanoseconds(time_ns + *behind_ns_ - now_ns());
    changed_.wait_for(lock, std::min<std::chrono::nanoseconds>(left, kPoll));
  }
}

void note(const ReplayConfig& config, const std::string& sentence) {
  if (config.on_note) config.on_note(sentence);
}

/// Says where other bits may come from.
ExecutorConfig choose_device(const ReplayConfig& config, const RecordingStart& start) {
  ExecutorConfig device = config.device;
  if (start.server_version != version())
    note(config, fmt::format("it was recorded by strandcast-server {}, and this is {}: other builds may take "
                             "other steps",
                             start.server_version, version()));
  if (device.sim_device == "auto" && !start.sim_device.empty()) device.sim_device = start.sim_device;
  if (device.sim_device != start.sim_device)
    note(config, fmt::format("it was recorded on {} ({}), and is simulated on {} now: the states will differ",
                             start.sim_device, start.sim_device_name, device.sim_device));
  return device;
}

bool is_same_hair(const SceneAsset& a, const SceneAsset& b) {
  return a.strand_count == b.strand_count && a.vertex_count == b.vertex_count &&
         a.rest_position_m == b.rest_position_m && a.triangle == b.triangle &&
         a.head.position_m == b.head.position_m && a.head.triangle == b.head.triangle;
}

Result<std::unique_ptr<StateSource>> make_replayed(const ReplayConfig& config, RecordingReader& reader,
                                                   ReplayScript& script, InputHub& inputs) {
  const RecordingStart& start = reader.start();
  SimulationConfig simulation;
  ASSIGN_OR_RETURN(simulation.scene, parse_recorded_scene(start.scene_text, "the recording's scene"));
  simulation.device = choose_device(config, start);
  simulation.script = &script;
  ASSIGN_OR_RETURN(auto source, make_simulation(std::move(simulation), inputs));
  ASSIGN_OR_RETURN(SceneAsset recorded, reader.asset());
  // Earlier versions did not round what they loaded.
  round_to_lattice(recorded.rest_position_m, kRestStepBits);
  recorded.head = as_sent(recorded.head);
  const std::shared_ptr<const SceneAsset> loaded = source->asset();
  if (!is_same_hair(recorded, *loaded))
    return make_error(
        ErrorCode::BadInput,
        "the scene's hair or head ({} strands x {} vertices) is not what was recorded ({} x {}): "
        "its files have changed since",
        loaded->strand_count, loaded->vertex_count, recorded.strand_count, recorded.vertex_count);
  return source;
}

}  // namespace

Result<ReplayResult> replay_recording(const ReplayConfig& config) {
  ASSIGN_OR_RETURN(const auto reader, RecordingReader::open(config.recording, RecordedPart::Messages));
  if (const auto tick = first_recorded_tick(config.recording); tick && *tick > 0)
    return at(
        config.recording.string(),
        make_error(ErrorCode::Unsupported,
                   "it began while the simulation ran, at step {}: it can be played, scrubbed and exported, "
                   "but not simulated again; strandcast-server --record makes one that can",
                   *tick));
  ReplayScript script(*reader, config);
  InputHub inputs;
  auto source = make_replayed(config, *reader, script, inputs);
  if (!source) return at(config.recording.string(), source.error());
  ASSIGN_OR_RETURN(const SceneDesc scene,
                   parse_recorded_scene(reader->start().scene_text, "the recording's scene"));
  const int64_t begin_ns = now_ns();
  RETURN_IF_ERROR((*source)->start(script, scene.stream));
  while (!script.wait(kPoll) && !(*source)->failure()) {
  }
  (*source)->stop();
  if (const std::optional<Error> failure = (*source)->failure()) return *failure;
  ReplayResult result = script.result();
  result.seconds = static_cast<double>(now_ns() - begin_ns) / kNsPerS;
  return result;
}

std::string to_sentence(const ReplayResult& result) {
  std::string text = fmt::format("{} of {} state hashes are equal", result.equal, result.compared);
  if (result.difference)
    text += fmt::format("; step {} is the first that differs: it {}", result.difference->tick,
                        result.difference->what);
  if (!result.early_end.empty())
    text += fmt::format("; it could not be replayed to its end: {}", result.early_end);
  return text;
}

}  // namespace strandcast
