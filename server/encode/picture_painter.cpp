#include "server/encode/picture_painter.h"

#include <utility>

#include "common/log/log.h"
#include "common/render/render_device.h"
#include "common/render/renderer.h"

namespace strandcast {
namespace {

class DevicePicturePainter : public PicturePainter {
 public:
  DevicePicturePainter(std::shared_ptr<const SceneAsset> asset, std::unique_ptr<RenderDevice> device,
                       std::unique_ptr<Renderer> renderer)
      : asset_(std::move(asset)), device_(std::move(device)), renderer_(std::move(renderer)) {}
  ~DevicePicturePainter() override {
    if (device_->make_current()) renderer_.reset();  // GL objects are deleted from the context that made them
  }

  Result<Image> paint(const std::shared_ptr<const Snapshot>& snapshot, const PictureView& view) override {
    // Several views of one snapshot share its positions.
    if (painted_ != snapshot) {
      strands_ = {snapshot->world_from_head, positions_in_head(*snapshot),
                  bust_turn(snapshot->bust, snapshot->world_from_head.rotation)};
      painted_ = snapshot;
    }
    RETURN_IF_ERROR(renderer_->draw(strands_, view.camera, view.size));
    const ScopedStage stage(read_timer_);
    return renderer_->read_image();
  }

  Status set_look(const LookDesc& look) override { return renderer_->set_look(look); }

  RenderProfile profile() const override { return renderer_->profile(); }

  gl::PassReports passes() const override {
    gl::PassReports passes = renderer_->passes().report();
    passes.push_back(read_back_report(read_timer_));
    return passes;
  }

 private:
  const std::shared_ptr<const SceneAsset> asset_;  // that the renderer is made for
  std::unique_ptr<RenderDevice> device_;           // outlives the renderer
  std::unique_ptr<Renderer> renderer_;
  StageTimer read_timer_;
  PosedStrands strands_;
  std::shared_ptr<const Snapshot> painted_;  // whose strands these are
};

}  // namespace

gl::PassReport read_back_report(const StageTimer& timer) {
  return gl::make_report("render/read", gl::PassFate::Kept, "writes the picture for its encoders", timer);
}

MakePicturePainter device_picture_painter(PainterConfig config) {
  // Else a picture in the shared queue of a software renderer would hold up the simulation until it is drawn.
  config.device.driver_threads = gl::DriverThreads::Own;
  return [config = std::move(config)]() -> Result<std::unique_ptr<PicturePainter>> {
    ASSIGN_OR_RETURN(auto device, RenderDevice::open(config.device));
    ASSIGN_OR_RETURN(auto renderer, device->make_renderer(*config.asset, config.look));
    log_info("render", "pictures are drawn by {}", device->info().name);
    return std::unique_ptr<PicturePainter>(
        std::make_unique<DevicePicturePainter>(config.asset, std::move(device), std::move(renderer)));
  };
}

gl::PassReports picture_passes(const PictureTimers& timers, const gl::PassReports& painted,
                               PictureCodecs wanted) {
  gl::PassReports passes = {
      gl::make_report("encode/decode", gl::PassFate::Kept, "writes what a viewer would have", timers.decode)};
  passes.insert(passes.end(), painted.begin(), painted.end());
  for (const PictureCodec codec : kPictureCodecs) {
    // Of what nobody wants it is not tried whether its encoder starts.
    if ((decodable_picture_codecs() & codec_bit(codec)) == 0) continue;
    const bool is_wanted = (wanted & codec_bit(codec)) != 0;
    passes.push_back(gl::make_report(
        fmt::format("encode/{}", to_string(codec)), is_wanted ? gl::PassFate::Kept : gl::PassFate::Unread,
        is_wanted ? "writes pictures for viewers" : "no viewer takes pictures coded so",
        timers.encode[static_cast<size_t>(codec)]));
  }
  return passes;
}

Result<gl::PassReports> plan_picture_passes(const SceneAsset& asset, const LookDesc& look, RendererKind kind,
                                            PictureCodecs wanted) {
  ASSIGN_OR_RETURN(gl::PassReports painted, plan_renderer(asset, look, kind));
  painted.push_back(read_back_report(StageTimer()));
  return picture_passes({}, painted, wanted);
}

}  // namespace strandcast
