#include "server/source/simulation_source.h"

#include <utility>

#include "common/groom/groom_asset.h"
#include "common/log/log.h"
#include "common/scene/scene_file.h"
#include "server/scene/first_camera.h"
#include "server/source/scene_change.h"

namespace strandcast {
namespace {

class SimulationSource : public StateSource {
 public:
  SimulationSource(SimulationConfig config, std::shared_ptr<const SceneContent> content, InputHub& inputs)
      : config_(std::move(config)),
        content_(std::move(content)),
        asset_(std::make_shared<const SceneAsset>(make_scene_asset(content_->groom, content_->head))),
        inputs_(inputs) {}

  std::shared_ptr<const SceneAsset> asset() const override {
    auto newest = loop_ != nullptr ? loop_->asset() : nullptr;
    return newest != nullptr ? newest : asset_;
  }
  Status start(StateSink& sink, const StreamDesc& stream) override {
    SimLoopConfig config{config_.scene, content_,       config_.device,      config_.on_publish,
                         config_.tap,   config_.script, config_.is_lockstep, config_.shared};
    config.scene.stream = stream;
    ASSIGN_OR_RETURN(loop_, SimLoop::start(std::move(config), inputs_, sink));
    return {};
  }
  void stop() override {
    if (loop_ != nullptr) loop_->stop();
  }
  void set_demand(const SourceDemand& demand) override { loop_->set_demand(demand); }
  void post(const ControlCommand& command, Reply reply, const std::string& who) override {
    loop_->post(command, std::move(reply), who);
  }
  void post(const SetParameter& parameter, Reply reply, const std::string& who) override {
    loop_->post(parameter, std::move(reply), who);
  }
  void leave(const std::string& who) override {
    if (loop_ != nullptr) loop_->leave(who);
  }
  void set_tap(StepTap* tap, OnTapped on_tapped) override { loop_->set_tap(tap, std::move(on_tapped)); }
  SimStats stats() const override { return loop_ != nullptr ? loop_->stats() : SimStats{}; }
  std::optional<SceneDesc> scene() const override {
    SceneDesc scene = loop_ != nullptr ? loop_->scene() : config_.scene;
    // Where the scene left the codec to the machine that runs it, it still does.
    if (!config_.scene.stream.has_codec) {
      scene.stream.codec = config_.scene.stream.codec;
      scene.stream.has_codec = false;
    }
    return with_absolute_paths(std::move(scene));
  }
  std::optional<Error> failure() const override { return loop_ != nullptr ? loop_->failure() : std::nullopt; }

 private:
  const SimulationConfig config_;
  const std::shared_ptr<const SceneContent> content_;
  const std::shared_ptr<const SceneAsset> asset_;  // at first
  InputHub& inputs_;
  std::unique_ptr<SimLoop> loop_;  // null before start()
};

}  // namespace

Result<std::unique_ptr<StateSource>> make_simulation(SimulationConfig config, InputHub& inputs) {
  RETURN_IF_ERROR(check_solver(config.scene));
  ASSIGN_OR_RETURN(SceneContent content, load_scene_content(config.scene));
  for (const std::string& note : content.notes) log_info("scene", "{}", note);
  if (config.scene.camera == CameraDesc{})
    config.scene.camera = first_camera(config.scene.camera, content.groom.rest_position_m);
  return std::unique_ptr<StateSource>(std::make_unique<SimulationSource>(
      std::move(config), std::make_shared<const SceneContent>(std::move(content)), inputs));
}

}  // namespace strandcast
