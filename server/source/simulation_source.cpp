#include "server/source/simulation_source.h"

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/base/thread_name.h"
#include "common/groom/groom_asset.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "server/scene/first_camera.h"
#include "server/source/scene_change.h"
#include "server/source/wet_hair.h"

namespace strandcast {
namespace {

LookChange look_of(const SceneDesc& scene) {
  return {scene.look, scene.camera};
}

/// Owns the scene as it runs. What only changes how hair looks is judged here, and never enters the loop.
class SimulationSource : public StateSource {
 public:
  SimulationSource(SimulationConfig config, std::shared_ptr<const SceneContent> content, InputHub& inputs)
      : config_(std::move(config)),
        content_(std::move(content)),
        asset_(std::make_shared<const SceneAsset>(make_scene_asset(content_->groom, content_->head))),
        inputs_(inputs),
        scene_(config_.scene) {}
  ~SimulationSource() override { stop(); }

  std::shared_ptr<const SceneAsset> asset() const override {
    auto newest = loop_ != nullptr ? loop_->asset() : nullptr;
    return newest != nullptr ? newest : asset_;
  }
  Status start(StateSink& sink, const StreamDesc& stream) override {
    SimLoopConfig config{config_.scene, content_,       config_.device,      config_.on_publish,
                         config_.tap,   config_.script, config_.is_lockstep, config_.shared};
    config.scene.stream = stream;
    config.on_scene = [this](const SceneDesc& scene, const std::string& assignment) {
      follow(scene, assignment);
    };
    {
      const std::lock_guard lock(mutex_);
      sink_ = &sink;
      told_ = look_of(scene_);
    }
    ASSIGN_OR_RETURN(loop_, SimLoop::start(std::move(config), inputs_, sink));
    announcer_ = std::jthread([this](const std::stop_token& stop) {
      name_thread("look");
      tell_late_looks(stop);
    });
    return {};
  }
  void stop() override {
    if (loop_ != nullptr) loop_->stop();
    announcer_ = {};  // told to stop, and waited for
    const std::lock_guard telling(telling_mutex_);
    const std::lock_guard lock(mutex_);
    sink_ = nullptr;
  }
  void set_demand(const SourceDemand& demand) override { loop_->set_demand(demand); }
  void post(const ControlCommand& command, Reply reply, const std::string& who) override {
    loop_->post(command, std::move(reply), who);
  }
  void post(const SetParameter& parameter, Reply reply, const std::string& who) override {
    if (!names_look(parameter.assignment)) return loop_->post(parameter, std::move(reply), who);
    if (const std::optional<Notice> answer = change_look(parameter, who)) {
      tell_look();
      if (reply) reply(*answer);
      return;
    }
    const auto answered = [this, reply = std::move(reply)](Notice notice) {
      {
        const std::lock_guard lock(mutex_);
        --looks_in_loop_;
      }
      if (reply) reply(std::move(notice));
    };
    loop_->post(parameter, answered, who);
  }
  void leave(const std::string& who) override {
    if (loop_ != nullptr) loop_->leave(who);
  }
  void set_tap(StepTap* tap, OnTapped on_tapped) override { loop_->set_tap(tap, std::move(on_tapped)); }
  SimStats stats() const override { return loop_ != nullptr ? loop_->stats() : SimStats{}; }
  std::optional<glm::vec3> wind_mps() const override {
    return loop_ != nullptr ? loop_->wind_mps() : std::nullopt;
  }
  std::optional<SceneDesc> scene() const override {
    SceneDesc scene;
    {
      const std::lock_guard lock(mutex_);
      scene = scene_;
    }
    // Where the scene left the codec to the machine that runs it, it still does.
    if (!config_.scene.stream.has_codec) {
      scene.stream.codec = config_.scene.stream.codec;
      scene.stream.has_codec = false;
    }
    return with_absolute_paths(std::move(scene));
  }
  std::optional<Error> failure() const override { return loop_ != nullptr ? loop_->failure() : std::nullopt; }

 private:
  /// The answer; empty where the loop is to carry it out. Wet hair moves otherwise, and later looks do not
  /// overtake it.
  std::optional<Notice> change_look(const SetParameter& parameter, const std::string& who) {
    const std::lock_guard lock(mutex_);
    Result<SceneDesc> changed = change_scene(scene_, parameter.assignment);
    if (looks_in_loop_ > 0 || (changed && moves_otherwise(*changed, scene_))) {
      ++looks_in_loop_;
      return std::nullopt;
    }
    Notice answer{false, excerpt(parameter.assignment, kMaxToldChars) + " from now on."};
    if (!changed) answer = {true, changed.error().to_string()};
    if (!loop_->note(parameter, answer, who)) return Notice{true, full_queue_text()};
    if (changed) scene_ = std::move(changed).value();
    return answer;
  }

  /// Takes over a scene from the simulation thread. The look in it may be old, so `assignment` is
  /// applied to the newest look.
  void follow(const SceneDesc& scene, const std::string& assignment) {
    {
      const std::lock_guard lock(mutex_);
      const Result<SceneDesc> mine = assignment.empty() ? scene : change_scene(scene_, assignment);
      LookChange look = look_of(mine ? *mine : scene_);
      scene_ = scene;
      scene_.look = std::move(look.look);
      scene_.camera = look.camera;
    }
    tell_look();
  }

  bool has_other_look() const { return sink_ != nullptr && look_of(scene_) != told_; }

  /// Of many changes in a short time only the last is told, by announcer_.
  void tell_look() {
    const std::lock_guard telling(telling_mutex_);
    LookChange look;
    {
      const std::lock_guard lock(mutex_);
      if (!has_other_look()) return;
      const int64_t time_ns = now_ns();
      if (told_ns_ != 0 && time_ns - told_ns_ < kLookChangeNs) return changed_.notify_one();
      told_ns_ = time_ns;
      look = told_ = look_of(scene_);
    }
    sink_->change_look(look);
  }

  void tell_late_looks(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [this] { return has_other_look(); }) && !stop.stop_requested()) {
      const std::chrono::steady_clock::time_point due{std::chrono::nanoseconds(told_ns_ + kLookChangeNs)};
      changed_.wait_until(lock, stop, due, [] { return false; });
      lock.unlock();
      tell_look();
      lock.lock();
    }
  }

  const SimulationConfig config_;
  const std::shared_ptr<const SceneContent> content_;
  const std::shared_ptr<const SceneAsset> asset_;  // at first
  InputHub& inputs_;
  std::mutex telling_mutex_;  // held while the sink is told of a look; taken before mutex_

  mutable std::mutex mutex_;  // guards the block below
  std::condition_variable_any changed_;
  SceneDesc scene_;             // as it runs
  StateSink* sink_ = nullptr;   // null before start() and after stop()
  LookChange told_;             // as the sink knows it
  int64_t told_ns_ = 0;         // 0 = never
  uint32_t looks_in_loop_ = 0;  // that move hair, or came after one that does

  std::unique_ptr<SimLoop> loop_;  // null before start()
  std::jthread announcer_;
};

}  // namespace

Result<std::unique_ptr<StateSource>> make_simulation(SimulationConfig config, InputHub& inputs) {
  RETURN_IF_ERROR(check_solver(config.scene));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(config.scene));
  config.scene = with_material(std::move(config.scene), content.material);
  for (const std::string& note : content.notes) log_info("scene", "{}", note);
  if (!content.unlikely.empty()) log_warn("scene", "{}", content.unlikely);
  if (config.scene.camera == CameraDesc{})
    config.scene.camera = first_camera(config.scene.camera, content.groom.rest_position_m);
  return std::unique_ptr<StateSource>(std::make_unique<SimulationSource>(
      std::move(config), std::make_shared<const SceneContent>(std::move(content)), inputs));
}

}  // namespace strandcast
