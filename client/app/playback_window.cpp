#include "client/app/views.h"

#include <algorithm>
#include <utility>

#include "client/app/playback_clock.h"
#include "client/app/recording_player.h"
#include "client/app/strand_drawer.h"
#include "client/window/orbit_camera.h"
#include "client/window/window.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;
/// Strands between states are told to the drawing thread on a lattice far finer than any that is streamed.
constexpr float kShownLatticeM = 1e-5f;

class Playback {
 public:
  Playback(const ViewOptions& options, std::unique_ptr<RecordingPlayer> player,
           std::unique_ptr<Window> window)
      : options_(options),
        player_(std::move(player)),
        window_(std::move(window)),
        clock_(player_->length_s()),
        orbit_(player_->look().camera),
        drawer_({options.drawing, [] { Window::wake(); }}) {}

  Status run(const std::atomic<bool>& stop) {
    while (!stop) {
      const WindowActions actions = window_->wait(time_to_wait());
      if (actions.wants_quit) break;
      RETURN_IF_ERROR(act(actions));
      clock_.advance(now_ns());
      RETURN_IF_ERROR(show_moment());
      drawn_ = drawer_.look();
      if (drawn_.device && !drawn_.device->ok()) return drawn_.device->error();
      if (drawn_.trouble) return *drawn_.trouble;
      if (saves_whole_ && drawn_.asked_whole >= asked_whole_) save();
      const RenderSize size = window_->framebuffer_size();
      const bool is_visible = size.width > 0 && size.height > 0;
      drawer_.set_view(is_visible ? std::optional(DrawView{orbit_.camera(), size, debug_view_})
                                  : std::nullopt);
      if (is_visible && is_picture_due(actions)) present();
    }
    return {};
  }

 private:
  Status act(const WindowActions& actions) {
    orbit_.orbit(actions.orbit_heights);
    orbit_.pan(actions.pan_heights);
    if (actions.zoom_steps != 0.0f) orbit_.zoom(actions.zoom_steps);
    if (actions.wants_view_reset) orbit_.reset();
    if (actions.wants_debug_view) debug_view_ = next_of(debug_view_);
    if (actions.wants_screenshot) {
      saves_whole_ = true;
      asked_whole_ = drawer_.ask_whole();
    }
    const TimelineActions& timeline = actions.timeline;
    if (actions.wants_pause_toggle || timeline.wants_play_toggle) clock_.toggle();
    if (timeline.wants_loop_toggle) clock_.set_looping(!clock_.is_looping());
    if (timeline.speed) clock_.set_speed(*timeline.speed);
    for (int step = 0; step < std::abs(actions.speed_steps); ++step)
      clock_.set_speed(clock_.speed() * (actions.speed_steps > 0 ? 2.0 : 0.5));
    if (timeline.time_s) clock_.go_to(*timeline.time_s);
    if (actions.wants_beginning) clock_.go_to(0.0);
    if (actions.wants_end) clock_.go_to(clock_.length_s());
    using Direction = RecordingPlayer::Direction;
    for (int step = 0; step < std::abs(actions.state_steps); ++step) {
      clock_.pause();
      const auto direction = actions.state_steps > 0 ? Direction::On : Direction::Back;
      ASSIGN_OR_RETURN(const double time_s, player_->time_beside(clock_.time_s(), direction));
      clock_.go_to(time_s);
    }
    return {};
  }

  /// Gives the drawing thread the strands of this moment.
  Status show_moment() {
    if (shown_s_ == clock_.time_s()) return {};
    ASSIGN_OR_RETURN(const PosedStrands strands, player_->strands_at(clock_.time_s()));
    shown_s_ = clock_.time_s();
    const SceneAsset& asset = *player_->asset();
    QuantiseInput input;
    input.sim_time_ns = player_->sim_time_ns(clock_.time_s());
    input.world_from_head = strands.world_from_head;
    input.strand_count = asset.strand_count;
    input.vertex_count = asset.vertex_count;
    input.quantum_m = kShownLatticeM;
    input.position_in_head_m = strands.position_m;
    input.fallback_m = asset.rest_position_m;
    auto state = std::make_shared<ViewerState>();
    state->session_number = 1;
    state->asset = player_->asset();
    state->look = player_->look();
    state->timeline.add(std::make_shared<const Snapshot>(quantise(input).snapshot), now_ns(),
                        Continuity::SameStream);
    orbit_.set_home(state->look.camera);
    drawer_.set_state(std::move(state));
    return {};
  }

  milliseconds time_to_wait() const {
    if (!clock_.is_playing()) return kLongestWait;
    const int64_t left_ns = kDisplayNs - (now_ns() - presented_ns_);
    return std::clamp(milliseconds(left_ns / kMsInNs + 1), milliseconds(0), kLongestWait);
  }

  bool is_picture_due(const WindowActions& actions) {
    const int64_t elapsed_ns = now_ns() - presented_ns_;
    is_due_ = is_due_ || actions.is_touched || drawn_.image != image_ || clock_.is_playing() ||
              elapsed_ns >= kPanelNs;
    return is_due_ && elapsed_ns >= kDisplayNs;
  }

  void present() {
    is_due_ = false;
    presented_ns_ = now_ns();
    image_ = drawn_.image;
    HudState hud;
    hud.title = fmt::format("{}: {:.2f} s of {:.2f} s", options_.recording.filename().string(),
                            clock_.time_s(), clock_.length_s());
    if (now_ns() - message_ns_ < kMessageNs) hud.warnings.push_back(message_);
    for (std::string& remark : player_->remarks()) hud.warnings.push_back(std::move(remark));
    const SceneAsset& asset = *player_->asset();
    hud.rows = {{"strands", fmt::format("{} x {} vertices", asset.strand_count, asset.vertex_count)},
                {"simulated",
                 fmt::format("{:.3f} s", static_cast<double>(player_->sim_time_ns(clock_.time_s())) * 1e-9)},
                {"drawing", fmt::format("{:.1f} ms", drawn_.draw_timer.median_ms())}};
    if (drawn_.device && drawn_.device->ok()) hud.rows.push_back({"drawn by", drawn_.device->value().name});
    hud.timeline = {clock_.time_s(), clock_.length_s(), clock_.speed(), clock_.is_playing(),
                    clock_.is_looping()};
    window_->present(image_, PictureFit::Stretched, hud, std::nullopt);
  }

  void save() {
    saves_whole_ = false;
    if (drawn_.image == nullptr) return;
    const std::string path = fmt::format("strandcast-{:04}.png", ++screenshot_count_);
    const Status saved = save_png(path, *drawn_.image);
    message_ = saved ? "saved " + path : saved.error().to_string();
    message_ns_ = now_ns();
  }

  const ViewOptions& options_;
  std::unique_ptr<RecordingPlayer> player_;
  std::unique_ptr<Window> window_;  // before what wakes it
  PlaybackClock clock_;
  OrbitCamera orbit_;
  DebugView debug_view_ = DebugView::None;
  double shown_s_ = -1.0;  // the moment that the drawing thread knows
  bool is_due_ = true;
  int64_t presented_ns_ = 0;
  std::shared_ptr<const Image> image_;  // that is shown
  DrawnState drawn_;
  bool saves_whole_ = false;
  uint64_t asked_whole_ = 0;
  uint32_t screenshot_count_ = 0;
  std::string message_;
  int64_t message_ns_ = 0;
  StrandDrawer drawer_;  // last: it wakes the window
};

}  // namespace

Status run_playback(const ViewOptions& options, const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(auto player, RecordingPlayer::open(options.recording));
  ASSIGN_OR_RETURN(auto window, Window::open("Strandcast", options.size));
  return Playback(options, std::move(player), std::move(window)).run(stop);
}

}  // namespace strandcast
