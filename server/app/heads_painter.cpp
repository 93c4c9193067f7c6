#include "server/app/heads_painter.h"

#include <mutex>
#include <utility>

#include "common/log/log.h"
#include "common/render/render_device.h"

namespace strandcast {
namespace {

using StatePtr = std::shared_ptr<const Snapshot>;

/// The newest state of another head. Any thread.
class OtherHead : public StreamReader {
 public:
  OtherHead(const PaintedHead& head, std::function<void()> on_news)
      : hub_(*head.hub), asset_(head.asset), on_news_(std::move(on_news)), reader_(hub_.add(*this)) {
    Demand states;
    states.has_states = true;
    (void)hub_.set_demand(reader_, states);  // no picture is asked for, which alone can be refused
  }
  ~OtherHead() override { hub_.remove(reader_); }
  OtherHead(const OtherHead&) = delete;
  OtherHead& operator=(const OtherHead&) = delete;

  void on_state(const StatePtr& state) override {
    {
      const std::lock_guard lock(mutex_);
      newest_ = state;
    }
    on_news_();
  }
  StatePtr newest() const {
    const std::lock_guard lock(mutex_);
    return newest_;
  }
  const SceneAsset& asset() const { return *asset_; }
  LookDesc look() const { return hub_.look().look; }

 private:
  StreamHub& hub_;
  const std::shared_ptr<const SceneAsset> asset_;
  const std::function<void()> on_news_;
  mutable std::mutex mutex_;
  StatePtr newest_;
  const ReaderId reader_;  // last: states come from here on
};

/// What one head is drawn with.
struct DrawnHead {
  std::unique_ptr<Renderer> renderer;
  StatePtr drawn;  // whose strands these are
  PosedStrands strands;

  void take(const StatePtr& state) {
    if (drawn == state) return;
    strands = {state->world_from_head, positions_in_head(*state),
               bust_turn(state->bust, state->world_from_head.rotation)};
    drawn = state;
  }
};

class HeadsPainter : public PicturePainter {
 public:
  HeadsPainter(std::shared_ptr<const SceneAsset> asset, const CameraDesc& scene_camera,
               std::unique_ptr<RenderDevice> device)
      : asset_(std::move(asset)), scene_camera_(scene_camera), device_(std::move(device)) {}
  ~HeadsPainter() override {
    others_.clear();
    if (device_->make_current()) drawn_.clear();  // from the context that made them
  }

  Status begin(const LookDesc& look, const std::vector<PaintedHead>& others,
               const std::function<void()>& on_news) {
    ASSIGN_OR_RETURN(auto own, device_->make_renderer(*asset_, look));
    drawn_.push_back({std::move(own), nullptr, {}});
    for (const PaintedHead& other : others) {
      looks_.push_back(other.hub->look().look);
      ASSIGN_OR_RETURN(auto renderer, device_->make_renderer(*other.asset, looks_.back()));
      drawn_.push_back({std::move(renderer), nullptr, {}});
      others_.push_back(std::make_unique<OtherHead>(other, on_news));
    }
    return {};
  }

  Result<Image> paint(const StatePtr& snapshot, const PictureView& view) override {
    drawn_.front().take(snapshot);
    std::vector<PlacedHead> heads{{drawn_.front().renderer.get(), &drawn_.front().strands}};
    for (size_t i = 0; i < others_.size(); ++i) {
      DrawnHead& other = drawn_[i + 1];
      const StatePtr newest = others_[i]->newest();
      if (newest == nullptr) continue;  // it comes with the next state
      follow_look(i);
      other.take(newest);
      heads.push_back({other.renderer.get(), &other.strands});
    }
    const ScopedStage stage(paint_timer_);
    ASSIGN_OR_RETURN(HeadsPicture picture, draw_heads(heads, {view.camera, scene_camera_}, view.size));
    profile_ = picture.profile;
    return std::move(picture.image);
  }

  Status set_look(const LookDesc& look) override { return drawn_.front().renderer->set_look(look); }
  RenderProfile profile() const override { return profile_; }

  gl::PassReports passes() const override {
    gl::PassReports passes = drawn_.front().renderer->passes().report();
    passes.push_back(gl::make_report("render/heads", gl::PassFate::Kept,
                                     "draws all heads, and writes the picture for its encoders",
                                     paint_timer_));
    return passes;
  }

 private:
  /// Each is tried once; what cannot be drawn leaves the look of before.
  void follow_look(size_t other) {
    const LookDesc look = others_[other]->look();
    if (look == looks_[other]) return;
    looks_[other] = look;
    if (const Status status = drawn_[other + 1].renderer->set_look(look); !status)
      log_warn("render", "pictures keep the look of a head: {}", status.error().to_string());
  }

  const std::shared_ptr<const SceneAsset> asset_;
  const CameraDesc scene_camera_;
  std::unique_ptr<RenderDevice> device_;  // outlives the renderers
  std::vector<DrawnHead> drawn_;          // of its own head, then of the others
  std::vector<LookDesc> looks_;           // of the others, as they were wanted last
  RenderProfile profile_;
  StageTimer paint_timer_;
  std::vector<std::unique_ptr<OtherHead>> others_;
};

}  // namespace

MakePicturePainter heads_picture_painter(PainterConfig config, const CameraDesc& scene_camera,
                                         std::function<std::vector<PaintedHead>()> others,
                                         std::function<void()> on_news) {
  // As device_picture_painter().
  config.device.driver_threads = gl::DriverThreads::Own;
  return [config = std::move(config), scene_camera, others = std::move(others),
          on_news = std::move(on_news)]() -> Result<std::unique_ptr<PicturePainter>> {
    ASSIGN_OR_RETURN(auto device, RenderDevice::open(config.device));
    log_info("render", "pictures of all heads are drawn by {}", device->info().name);
    auto painter = std::make_unique<HeadsPainter>(config.asset, scene_camera, std::move(device));
    RETURN_IF_ERROR(painter->begin(config.look, others(), on_news));
    return std::unique_ptr<PicturePainter>(std::move(painter));
  };
}

}  // namespace strandcast
