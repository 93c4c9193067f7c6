#include "client/app/windowed_view.h"

#include <algorithm>
#include <utility>

#include "client/app/live_connection.h"
#include "client/window/orbit_camera.h"
#include "client/window/window.h"
#include "common/base/log.h"
#include "common/gl/egl_context.h"
#include "common/gl/program.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr double kRateWindowS = 0.5;  // over which fps and kB/s are counted
constexpr double kMessageS = 4.0;     // how long a notice stays on the panel
constexpr int64_t kCameraSendNs = 33'000'000;
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
               std::unique_ptr<Window> window, gl::DeviceInfo device)
      : options_(options),
        live_(std::move(live)),
        window_(std::move(window)),
        device_(std::move(device)),
        shaders_(options.shader_dir.empty() ? gl::ShaderLibrary() : gl::ShaderLibrary(options.shader_dir)),
        orbit_(live_->session().welcome().camera),
        playout_(options.playout) {}

  Result<ViewReport> run(const std::atomic<bool>& stop) {
    begin_session();
    const int64_t begin_ns = now_ns();
    while (!stop) {
      const WindowActions actions = window_->begin_frame();
      if (actions.wants_quit) break;
      if (live_->pump(milliseconds(1))) begin_session();
      RETURN_IF_ERROR(prepare_renderer());
      act(actions);
      RETURN_IF_ERROR(draw());
      ++frame_count_;
      window_->end_frame(hud());
      if (actions.wants_screenshot) save_screenshot();
      if (options_.seconds && static_cast<double>(now_ns() - begin_ns) * 1e-9 >= *options_.seconds) break;
    }
    if (live_->final_error()) return *live_->final_error();
    ViewReport report = make_report(session());
    set_render_times(report, render_timer_);
    return report;
  }

 private:
  ViewerSession& session() { return live_->session(); }
  bool is_frames() { return session().welcome().mode == StreamMode::Frames; }

  void begin_session() {
    session().replay().set_playout(playout_);
    renderer_.reset();  // groom and look may have changed with the server
    drawn_ = {};
    is_camera_sent_ = false;
  }

  Status prepare_renderer() {
    if (renderer_ || is_frames() || session().asset() == nullptr) return {};
    ASSIGN_OR_RETURN(renderer_,
                     Renderer::make(shaders_, device_, *session().asset(), session().welcome().look));
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
      send(ControlCommand{session().status().is_paused ? Command::Resume : Command::Pause});
    if (actions.wants_step) send(ControlCommand{Command::StepOnce});
    if (actions.wants_mode_toggle) live_->change_mode(is_frames() ? StreamMode::Strands : StreamMode::Frames);
    if (actions.wants_playout_toggle) {
      playout_ = playout_ == Playout::Smooth ? Playout::LowLatency : Playout::Smooth;
      session().replay().set_playout(playout_);
    }
    if (is_frames() && !is_camera_sent_ && now_ns() - camera_sent_ns_ > kCameraSendNs) {
      camera_sent_ns_ = now_ns();
      is_camera_sent_ = send(CameraChange{orbit_.camera()});
    }
    for (const Notice& notice : session().take_notices()) show_message(notice.text);
  }

  bool send(const ClientMessage& message) {
    if (!live_->is_connected()) return false;
    const auto sent = session().client().send(message);
    if (!sent) show_message(sent.error().to_string());
    return sent.ok();
  }

  Status draw() {
    const RenderSize window_size = window_->framebuffer_size();
    if (window_size.width == 0 || window_size.height == 0) return {};
    window_->clear();
    if (is_frames()) {
      if (session().image()) window_->show_image(*session().image(), session().image_count());
      return {};
    }
    const auto newest = session().replay().newest();
    if (!renderer_ || !newest) return {};
    const RenderSize size{std::min(window_size.width, kMaxImageSide),
                          std::min(window_size.height, kMaxImageSide)};
    const DrawnView view{newest.get(), orbit_.camera(), size};
    const bool is_moving = playout_ == Playout::Smooth && live_->is_connected();
    if (is_moving || !view.matches(drawn_)) {
      const auto picture = session().replay().picture_at(now_ns());
      RETURN_IF_ERROR(renderer_->draw(*picture, orbit_.camera(), size));
      const RenderProfile& profile = renderer_->profile();
      render_timer_.add_ms(profile.expand_ms + profile.strands_ms + profile.head_ms + profile.resolve_ms);
      drawn_ = view;
      shown_ = newest;  // keeps the pointer in drawn_ from being reused
    }
    renderer_->blit_to(0, window_size);
    return {};
  }

  void save_screenshot() {
    std::optional<Image> image;
    if (is_frames()) {
      if (session().image()) image = *session().image();
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
    const ClockOffset clock = session().client().clock();
    const ConnectionCounters net = session().client().counters();
    const Welcome& welcome = session().welcome();
    const ServerStatus& status = session().status();
    StrandReplay& replay = session().replay();
    fps_.update(frame_count_, time_ns);
    bytes_.update(net.received_bytes, time_ns);
    received_.update(session().decoded_frames(), time_ns);

    HudState hud;
    hud.is_connected = live_->is_connected();
    hud.title =
        fmt::format("{}: {} strands x {}", welcome.scene_name, welcome.strand_count, welcome.vertex_count);
    hud.connection = hud.is_connected ? options_.address.to_string() : live_->trouble();
    hud.mode = is_frames()
                   ? "server's pictures"
                   : fmt::format("strands, {}", playout_ == Playout::Smooth ? "smooth" : "newest state");
    const StreamQuality& quality = session().quality();
    if (!is_frames() && session().quality_changes() > 0)
      hud.mode += fmt::format(", {:.3g} % of them every {} steps within {:.2g} mm",
                              quality.strand_share * 1e2, quality.rate_divisor, quality.bound_m * 1e3);
    if (static_cast<double>(time_ns - message_ns_) * 1e-9 < kMessageS) hud.message = message_;
    hud.fps = fps_.per_s();
    hud.render_ms = render_timer_.median_ms();
    hud.decode_ms = (is_frames() ? session().picture_decode_timer() : replay.decode_timer()).median_ms();
    hud.sim_ms = status.sim_ms;
    hud.encode_ms = status.encode_ms;
    hud.realtime_factor = status.realtime_factor;
    hud.kilobytes_per_s = bytes_.per_s() * 1e-3;
    hud.frames_per_s = received_.per_s();
    hud.state_age_ms = replay.state_age_ms(time_ns, clock);
    hud.motion_to_decoded_ms = replay.motion_latency_timer().median_ms();
    hud.playout_delay_ms = playout_ == Playout::Smooth && !is_frames() ? replay.playout_delay_ms() : 0.0;
    hud.round_trip_ms = clock.has_value() ? 2.0 * static_cast<double>(clock.error_ns()) * kNsToMs : 0.0;
    hud.queue_delay_ms = status.queue_delay_ms;
    hud.tick = status.tick;
    hud.dropped_by_server = status.dropped_frames;
    hud.missed_frames = is_frames() ? session().picture_stats().missed_frames : replay.stats().missed_frames;
    hud.dropped_by_client = net.dropped_strand_frames;
    hud.viewer_count = status.viewer_count;
    hud.is_paused = status.is_paused;
    hud.is_motion_stale = session().has_status() && status.is_motion_stale;
    return hud;
  }

  const ViewOptions& options_;
  std::unique_ptr<LiveConnection> live_;
  std::unique_ptr<Window> window_;
  gl::DeviceInfo device_;
  gl::ShaderLibrary shaders_;
  std::unique_ptr<Renderer> renderer_;  // below window_: it needs the window's context to go
  OrbitCamera orbit_;
  Playout playout_;
  StageTimer render_timer_;
  DrawnView drawn_;
  std::shared_ptr<const Snapshot> shown_;
  bool is_camera_sent_ = false;
  int64_t camera_sent_ns_ = 0;
  uint64_t frame_count_ = 0;
  uint32_t screenshot_count_ = 0;
  std::string message_;
  int64_t message_ns_ = 0;
  Rate fps_, bytes_, received_;
};

}  // namespace

Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(auto live, LiveConnection::open(client_config(options)));
  ASSIGN_OR_RETURN(auto window, Window::open("Strandcast", options.size));
  ASSIGN_OR_RETURN(auto device, gl::read_device_info());
  return WindowedView(options, std::move(live), std::move(window), std::move(device)).run(stop);
}

}  // namespace strandcast
