#include "client/app/windowed_view.h"

#include <algorithm>
#include <utility>

#include "client/app/viewer_thread.h"
#include "client/window/orbit_camera.h"
#include "client/window/window.h"
#include "common/gl/egl_context.h"
#include "common/gl/program.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr double kRateWindowS = 0.5;  // over which fps and kB/s are counted
constexpr double kMessageS = 4.0;     // how long a notice stays on the panel
constexpr int64_t kCameraSendNs = 33'000'000;
constexpr int64_t kReportNs = 1'000'000'000;
constexpr milliseconds kNewsWait{4};  // short enough that dragging feels immediate
constexpr double kNsToMs = 1e-6;

/// Counts per second over kRateWindowS.
class Rate {
 public:
  void update(uint64_t total, int64_t time_ns) {
    const double elapsed_s = static_cast<double>(time_ns - begin_ns_) * 1e-9;
    if (elapsed_s < kRateWindowS && total >= begin_total_) return;
    per_s_ =
        total >= begin_total_ && begin_ns_ != 0 ? static_cast<double>(total - begin_total_) / elapsed_s : 0.0;
    begin_total_ = total;
    begin_ns_ = time_ns;
  }
  double per_s() const { return per_s_; }

 private:
  uint64_t begin_total_ = 0;
  int64_t begin_ns_ = 0;
  double per_s_ = 0.0;
};

/// What decides the pixels of a strand picture; drawing again is only needed when it changes.
struct DrawnView {
  const Snapshot* snapshot = nullptr;
  CameraDesc camera;
  RenderSize size{0, 0};

  bool matches(const DrawnView& other) const {
    return snapshot == other.snapshot && camera.offset_m == other.camera.offset_m &&
           camera.target_m == other.camera.target_m && camera.fov_y_rad == other.camera.fov_y_rad &&
           size.width == other.size.width && size.height == other.size.height;
  }
};

class WindowedView {
 public:
  WindowedView(const ViewOptions& options, std::unique_ptr<LiveConnection> live,
               std::unique_ptr<Window> window, std::optional<gl::DeviceInfo> device)
      : options_(options),
        window_(std::move(window)),
        device_(std::move(device)),
        shaders_(options.shader_dir.empty() ? gl::ShaderLibrary() : gl::ShaderLibrary(options.shader_dir)),
        orbit_(live->session().welcome().camera),
        playout_(options.playout),
        viewer_(std::move(live)),
        state_(viewer_.look()) {
    viewer_.set_playout(playout_);
    if (!device_) own_reason_ = "frames: " + window_->why_no_strands();
  }

  Result<ViewReport> run(const std::atomic<bool>& stop) {
    const int64_t begin_ns = now_ns();
    while (!stop) {
      const WindowActions actions = window_->begin_picture();
      if (actions.wants_quit) break;
      const uint64_t session_number = state_->session_number;
      state_ = viewer_.look(state_, kNewsWait);
      if (state_->session_number != session_number) begin_session();
      RETURN_IF_ERROR(prepare_renderer());
      act(actions);
      RETURN_IF_ERROR(draw());
      ++turn_count_;
      window_->end_picture(hud());
      report();
      if (actions.wants_screenshot) save_screenshot();
      if (options_.seconds && static_cast<double>(now_ns() - begin_ns) * 1e-9 >= *options_.seconds) break;
    }
    if (state_->final_error) return *state_->final_error;
    ViewReport report = viewer_.stop_and_report();
    set_render_times(report, render_timer_);
    if (!own_reason_.empty()) set_mode_reason(report, own_reason_);
    return report;
  }

 private:
  bool is_frames() const { return state_->mode.shown == StreamMode::Frames; }

  void begin_session() { is_camera_sent_ = false; }

  Status prepare_renderer() {
    // Groom and look may have changed with the server; until the new ones are here the old picture stays.
    if (is_frames() || !device_ || state_->asset == nullptr || state_->asset == drawn_asset_) return {};
    auto made = Renderer::make(shaders_, *device_, *state_->asset, state_->welcome.look);
    if (made) {
      renderer_ = std::move(made).value();
      drawn_asset_ = state_->asset;
      drawn_ = {};
      player_.set_fill(StrandFill(state_->asset->rest_position_m, state_->asset->vertex_count));
      is_first_draw_ = true;
      return {};
    }
    if (viewer_.wanted_mode() == StreamMode::Strands) return made.error();
    // Somebody else can draw them.
    device_.reset();
    own_reason_ = "frames: strands cannot be drawn here: " + made.error().to_string();
    show_message(own_reason_);
    viewer_.request_mode(StreamMode::Frames);
    return {};
  }

  void act(const WindowActions& actions) {
    const bool moves = actions.orbit_heights != glm::vec2(0.0f) || actions.pan_heights != glm::vec2(0.0f) ||
                       actions.zoom_steps != 0.0f || actions.wants_view_reset;
    orbit_.orbit(actions.orbit_heights);
    orbit_.pan(actions.pan_heights);
    if (actions.zoom_steps != 0.0f) orbit_.zoom(actions.zoom_steps);
    if (actions.wants_view_reset) orbit_.reset();
    if (moves) is_camera_sent_ = false;

    if (actions.wants_pause_toggle)
      send(ControlCommand{state_->status.is_paused ? Command::Resume : Command::Pause});
    if (actions.wants_step) send(ControlCommand{Command::StepOnce});
    if (actions.wants_mode_toggle) change_mode();
    if (actions.wants_playout_toggle) {
      playout_ = playout_ == Playout::Smooth ? Playout::LowLatency : Playout::Smooth;
      viewer_.set_playout(playout_);
    }
    // Also while strands are drawn here: the server's first picture then shows what the person sees.
    if (!is_camera_sent_ && now_ns() - camera_sent_ns_ > kCameraSendNs) {
      camera_sent_ns_ = now_ns();
      is_camera_sent_ = send(CameraChange{orbit_.camera()});
    }
    for (const Notice& notice : viewer_.take_notices()) show_message(notice.text);
  }

  /// Strands, frames, the server's choice, and again.
  void change_mode() {
    if (!device_) return show_message(own_reason_);
    const StreamMode last = viewer_.wanted_mode();
    viewer_.request_mode(last == StreamMode::Auto      ? StreamMode::Strands
                         : last == StreamMode::Strands ? StreamMode::Frames
                                                       : StreamMode::Auto);
  }

  /// Tells the server about once a second what this machine makes of the stream.
  void report() {
    const int64_t time_ns = now_ns();
    shown_.update(shown_count_, time_ns);
    if (time_ns - reported_ns_ < kReportNs) return;
    reported_ns_ = time_ns;
    // The newest second counts; while pictures are shown, what strands took when they were drawn last.
    if (draw_timer_.count() > 0) draw_ms_ = draw_timer_.median_ms();
    draw_timer_ = StageTimer();
    ViewerReport now;
    now.decode_ms = std::min(state_->strand_decode_ms, kMaxReportedMs);
    now.draw_ms = std::min(draw_ms_, kMaxReportedMs);
    now.picture_decode_ms = std::min(state_->picture_decode_ms, kMaxReportedMs);
    now.shown_hz = std::min(shown_.per_s(), kMaxReportedHz);
    now.device = !device_               ? DrawingDevice::None
                 : device_->is_software ? DrawingDevice::Software
                                        : DrawingDevice::Hardware;
    // One that is lost is followed by the next.
    if (state_->is_connected) (void)viewer_.send(now);
  }

  bool send(const ClientMessage& message) {
    if (!state_->is_connected) return false;
    const auto sent = viewer_.send(message);
    if (!sent) show_message(sent.error().to_string());
    return sent.ok();
  }

  Status draw() {
    const RenderSize window_size = window_->framebuffer_size();
    if (window_size.width == 0 || window_size.height == 0) return {};
    window_->clear();
    const auto newest = state_->timeline.newest();
    // What there is already goes on being shown while the renderer for strands is not there.
    if (is_frames() || !renderer_ || !newest || state_->asset != drawn_asset_) {
      if (state_->image == nullptr) {
        if (renderer_ && drawn_.snapshot != nullptr) renderer_->blit_to(0, window_size);
        return {};
      }
      window_->show_image(*state_->image, state_->image_count);
      if (std::exchange(shown_image_, state_->image_count) != state_->image_count) ++shown_count_;
      return {};
    }
    const RenderSize size{std::min(window_size.width, kMaxImageSide),
                          std::min(window_size.height, kMaxImageSide)};
    const DrawnView view{newest.get(), orbit_.camera(), size};
    const bool is_moving = playout_ == Playout::Smooth && state_->is_connected;
    if (is_moving || !view.matches(drawn_)) RETURN_IF_ERROR(draw_strands(view, newest));
    renderer_->blit_to(0, window_size);
    return {};
  }

  Status draw_strands(const DrawnView& view, const std::shared_ptr<const Snapshot>& newest) {
    const auto strands = player_.strands_at(state_->timeline, now_ns());
    RETURN_IF_ERROR(renderer_->draw(*strands, view.camera, view.size));
    const double draw_ms = renderer_->profile().total_ms;
    render_timer_.add_ms(draw_ms);
    const bool is_other_size = view.size.width != drawn_.size.width || view.size.height != drawn_.size.height;
    if (is_other_size) draw_timer_ = StageTimer();  // says nothing about this size
    if (!std::exchange(is_first_draw_, false)) draw_timer_.add_ms(draw_ms);
    ++shown_count_;
    drawn_ = view;
    shown_snapshot_ = newest;  // keeps the pointer in drawn_ from being reused
    return {};
  }

  void save_screenshot() {
    std::optional<Image> image;
    if (is_frames()) {
      if (state_->image) image = *state_->image;
    } else if (renderer_ && drawn_.snapshot != nullptr) {
      image = renderer_->read_image();
    }
    if (!image) return show_message("nothing to save yet");
    const std::string path = fmt::format("strandcast-{:04}.png", ++screenshot_count_);
    const auto saved = save_png(path, *image);
    show_message(saved ? "saved " + path : saved.error().to_string());
  }

  void show_message(std::string text) {
    message_ = std::move(text);
    message_ns_ = now_ns();
  }

  HudState hud() {
    const int64_t time_ns = now_ns();
    const ViewerState& now = *state_;
    fps_.update(turn_count_, time_ns);
    bytes_.update(now.net.received_bytes, time_ns);
    received_.update(now.decoded_frames, time_ns);

    HudState hud;
    hud.is_connected = now.is_connected;
    hud.title = fmt::format("{}: {} strands x {}", now.welcome.scene_name, now.welcome.strand_count,
                            now.welcome.vertex_count);
    hud.connection = hud.is_connected ? options_.address.to_string() : now.trouble;
    hud.mode = is_frames()
                   ? "server's pictures"
                   : fmt::format("strands, {}", playout_ == Playout::Smooth ? "smooth" : "newest state");
    if (!is_frames() && now.quality_changes > 0)
      hud.mode +=
          fmt::format(", {:.3g} % of them every {} steps within {:.2g} mm", now.quality.strand_share * 1e2,
                      now.quality.rate_divisor, now.quality.bound_m * 1e3);
    hud.mode_wish = now.mode.wish();
    hud.mode_reason = own_reason_.empty() ? now.mode.reason : own_reason_;
    if (static_cast<double>(time_ns - message_ns_) * 1e-9 < kMessageS) hud.message = message_;
    hud.fps = fps_.per_s();
    hud.render_ms = render_timer_.median_ms();
    hud.decode_ms = is_frames() ? now.picture_decode_ms : now.strand_decode_ms;
    hud.sim_ms = now.status.sim_ms;
    hud.encode_ms = now.status.encode_ms;
    hud.realtime_factor = now.status.realtime_factor;
    hud.kilobytes_per_s = bytes_.per_s() * 1e-3;
    hud.frames_per_s = received_.per_s();
    if (now.state_age_ms > 0.0)
      hud.state_age_ms = now.state_age_ms + static_cast<double>(time_ns - now.made_ns) * kNsToMs;
    hud.motion_to_decoded_ms = now.motion_to_decoded_ms;
    hud.playout_delay_ms = playout_ == Playout::Smooth && !is_frames() ? now.playout_delay_ms : 0.0;
    hud.round_trip_ms = now.round_trip_ms;
    hud.queue_delay_ms = now.status.queue_delay_ms;
    hud.tick = now.status.tick;
    hud.dropped_by_server = now.status.dropped_frames;
    hud.missed_frames = now.missed_frames;
    hud.dropped_by_client = now.net.dropped_frames;
    hud.viewer_count = now.status.viewer_count;
    hud.is_paused = now.status.is_paused;
    hud.is_motion_stale = now.has_status && now.status.is_motion_stale;
    return hud;
  }

  const ViewOptions& options_;
  std::unique_ptr<Window> window_;
  std::optional<gl::DeviceInfo> device_;  // none: strands cannot be drawn here
  gl::ShaderLibrary shaders_;
  std::unique_ptr<Renderer> renderer_;  // below window_: it needs the window's context to go
  OrbitCamera orbit_;
  std::string own_reason_;  // why this machine needs frames; empty = the server's reason counts
  Playout playout_;
  TimelinePlayer player_;
  StageTimer render_timer_;  // of the whole run
  StageTimer draw_timer_;    // since the last report
  double draw_ms_ = 0.0;
  bool is_first_draw_ = true;                      // it compiles and uploads
  std::shared_ptr<const SceneAsset> drawn_asset_;  // that renderer_ was made for
  DrawnView drawn_;
  std::shared_ptr<const Snapshot> shown_snapshot_;
  uint64_t shown_image_ = 0;
  uint64_t shown_count_ = 0;  // different pictures
  bool is_camera_sent_ = false;
  int64_t camera_sent_ns_ = 0;
  int64_t reported_ns_ = 0;
  uint64_t turn_count_ = 0;
  uint32_t screenshot_count_ = 0;
  std::string message_;
  int64_t message_ns_ = 0;
  Rate fps_, bytes_, received_, shown_;
  ViewerThread viewer_;
  std::shared_ptr<const ViewerState> state_;  // what this turn of the loop shows
};

}  // namespace

Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop) {
  // The window first, hidden: what it can draw decides what to ask for.
  ASSIGN_OR_RETURN(auto window, Window::open("Strandcast", options.size));
  std::optional<gl::DeviceInfo> device;
  ClientConfig config = client_config(options);
  if (window->why_no_strands().empty()) {
    ASSIGN_OR_RETURN(device, gl::read_device_info());
  } else if (options.mode == StreamMode::Strands) {
    return make_error(ErrorCode::Unavailable, "{}; --mode frames shows the server's pictures",
                      window->why_no_strands());
  } else {
    config.hello.mode = StreamMode::Frames;
  }
  config.cancel = [&stop]() -> std::optional<Error> {
    if (!stop) return std::nullopt;
    return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
  };
  ASSIGN_OR_RETURN(auto live, LiveConnection::open(config));
  window->show();
  return WindowedView(options, std::move(live), std::move(window), std::move(device)).run(stop);
}

}  // namespace strandcast
