#include "client/app/views.h"

#include <algorithm>
#include <array>
#include <future>
#include <string_view>
#include <utility>

#include "client/app/hair_sliders.h"
#include "client/app/look_form.h"
#include "client/app/save_scene.h"
#include "client/app/strand_drawer.h"
#include "client/app/view_hud.h"
#include "client/app/viewer_thread.h"
#include "client/window/orbit_camera.h"
#include "client/window/window.h"
#include "common/base/units.h"
#include "common/log/log.h"
#include "common/render/hair_size.h"
#include "common/scene/scene_file.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;
constexpr int64_t kCameraSendNs = 33 * kMsInNs;
constexpr int64_t kWindowSendNs = 200 * kMsInNs;  // while its edge is dragged
constexpr int64_t kReportNs = 1000 * kMsInNs;
constexpr int64_t kGrownReportNs = 100 * kMsInNs;  // when the hair is larger by so much:
constexpr double kGrownHair = 1.1;
constexpr double kLeastHairPx = 0.1;        // 0 says nothing
constexpr int64_t kWayNs = 1000 * kMsInNs;  // medians of so long
constexpr int64_t kSceneWaitNs = 5000 * kMsInNs;
constexpr const char* kDebugViewPath = "debug_view";
// Answers to sliders, which say it already.
constexpr std::array<std::string_view, 4> kSliderAnswers{"look={", "hair.", "quality=", "Left out: a newer"};

bool is_slider_answer(const std::string& text) {
  return std::any_of(kSliderAnswers.begin(), kSliderAnswers.end(),
                     [&](std::string_view begin) { return text.starts_with(begin); });
}

/// A further head of the server.
struct OtherHead {
  std::unique_ptr<ViewerThread> viewer;
  std::string trouble = {};  // as it was told
};

class WindowedView {
 public:
  WindowedView(const ViewOptions& options, ClientConfig config, std::unique_ptr<Window> window)
      : options_(options),
        config_(std::move(config)),
        window_(std::move(window)),
        playout_(options.playout),
        trace_(std::make_shared<FrameTrace>(kRecentFrames)),
        state_(std::make_shared<const ViewerState>()),
        drawer_({options.drawing, [] { Window::wake(); }}) {}

  Result<ViewReport> run(const std::atomic<bool>& stop) {
    const int64_t begin_ns = now_ns();
    if (!options_.trace.empty()) RETURN_IF_ERROR(trace_->open(options_.trace));
    while (!stop) {
      const WindowActions actions = window_->wait(time_to_wait());
      const int64_t woke_ns = now_ns();
      if (actions.wants_quit) break;
      RETURN_IF_ERROR(follow());
      act(actions);
      trace_->want_states(!options_.trace.empty() || window_->is_unfolded());
      tell_drawer();
      tell_window();
      report();
      if (is_picture_due(actions)) present(woke_ns);
      if (options_.seconds && static_cast<double>(now_ns() - begin_ns) * 1e-9 >= *options_.seconds) break;
    }
    return finish();
  }

 private:
  bool is_frames() const { return state_->mode.shown == StreamMode::Frames; }
  bool is_visible() const {
    const RenderSize size = window_->framebuffer_size();
    return size.width > 0 && size.height > 0;
  }
  bool can_draw() const { return drawn_.device && drawn_.device->ok() && !drawn_.trouble; }

  /// Takes what the other threads have. The error is one that trying again does not mend.
  Status follow() {
    drawn_ = drawer_.look();
    if (viewer_ == nullptr && drawn_.device) RETURN_IF_ERROR(begin_connecting());
    if (viewer_ == nullptr) return {};
    const uint64_t session_number = state_->session_number;
    state_ = viewer_->look();
    if (state_->session_number != session_number) begin_session(session_number == 0);
    follow_heads();
    if (drawn_.trouble && own_reason_.empty()) RETURN_IF_ERROR(leave_strands());
    if (wants_whole_ && drawn_.asked_whole >= asked_whole_) {
      wants_whole_ = false;
      save(drawn_.image);
    }
    for (const Notice& notice : viewer_->take_notices())
      if (notice.is_error || !is_slider_answer(notice.text)) show_message(notice.text);
    follow_look();
    follow_sliders();
    follow_camera();
    return {};
  }

  /// The further heads of a server have sessions of their own while strands are drawn here; the server's
  /// pictures show all heads.
  void follow_heads() {
    std::vector<std::string> wanted;
    if (options_.head.empty() && !is_frames() && state_->session_number > 0) wanted = state_->welcome.heads;
    if (wanted != heads_) {
      // To say goodbye takes a moment.
      leaving_ = std::async(std::launch::async, [others = std::move(others_)]() mutable { others.clear(); });
      others_.clear();
      heads_ = std::move(wanted);
      drawer_.set_head_count(std::max<size_t>(heads_.size(), 1));
      for (size_t i = 1; i < heads_.size(); ++i) join_head(i);
    }
    for (size_t i = 0; i < others_.size(); ++i) {
      const std::string trouble = others_[i].viewer->look()->trouble;
      if (std::exchange(others_[i].trouble, trouble) != trouble && !trouble.empty())
        show_message(fmt::format("{}: {}", heads_[i + 1], trouble));
    }
  }

  void join_head(size_t head) {
    ClientConfig config = config_;
    config.hello.head = heads_[head];
    config.hello.mode = StreamMode::Strands;
    others_.push_back({std::make_unique<ViewerThread>(
        LiveConnection::begin(config), [this, head](const auto& state) { drawer_.set_state(state, head); })});
    others_.back().viewer->set_playout(playout_);
  }

  /// What the panel has on top, once it is open.
  void follow_sliders() {
    const bool is_asked = asked_session_ == state_->session_number;
    if (window_->is_form_visible() && !is_asked && state_->is_connected &&
        send(ParameterRequest{kHairSliderPrefixes, 0, true}))
      asked_session_ = state_->session_number;
    sliders_.follow(state_->parameters != nullptr ? *state_->parameters : std::vector<ParameterInfo>{},
                    look_.is_steering());
  }

  void follow_look() {
    if (state_->session_number > 0 && orbit_.set_home(state_->look.camera)) is_camera_sent_ = false;
    look_.follow(state_->look,
                 state_->welcome.role == Role::Controller || state_->welcome.role == Role::Admin);
    if (drawn_.look_trouble && drawn_.look_trouble->to_string() != look_trouble_)
      show_message("this look cannot be drawn here: " + drawn_.look_trouble->to_string());
    look_trouble_ = drawn_.look_trouble ? drawn_.look_trouble->to_string() : std::string();
    if (const auto scene = viewer_->take_scene(); scene && scene_asked_ns_ != 0) {
      scene_asked_ns_ = 0;
      const auto whole = scene_of(*scene, look_.shown(now_ns()), orbit_.camera());
      if (whole)
        save_text(to_text(*whole));
      else
        show_message("the scene is not saved: " + whole.error().to_string());
    }
    if (scene_asked_ns_ != 0 && now_ns() - scene_asked_ns_ > kSceneWaitNs) {
      scene_asked_ns_ = 0;
      show_message("the scene is not saved: the server does not send it");
    }
  }

  /// What this machine can draw decides what to ask for.
  Status begin_connecting() {
    if (!drawn_.device->ok()) {
      const Error& why = drawn_.device->error();
      if (options_.mode == StreamMode::Strands)
        return make_error(why.code, "{}; --mode frames shows the server's pictures", why.to_string());
      config_.hello.mode = StreamMode::Frames;
      own_reason_ = "pictures: strands cannot be drawn here: " + why.to_string();
      log_warn("render", "{}", own_reason_);
    }
    auto live = LiveConnection::begin(config_);
    live->set_trace(trace_);
    viewer_ = std::make_unique<ViewerThread>(std::move(live), [this](const auto& state) {
      drawer_.set_state(state);
      Window::wake();
    });
    viewer_->set_playout(playout_);
    return {};
  }

  void begin_session(bool is_first) {
    if (is_first) orbit_ = OrbitCamera(state_->look.camera);
    is_camera_sent_ = false;
    const Welcome& welcome = state_->welcome;
    if (!config_.hello.codec_wish.empty() && config_.hello.codec_wish != welcome.codec)
      show_message(fmt::format("not by the codec {}: {}", config_.hello.codec_wish, welcome.codec_reason));
    told_window_ = {config_.hello.frame_width, config_.hello.frame_height, false};
    camera_moves_ = 0;
  }

  /// Somebody who controls moved this view; from there on it is the person's again.
  void follow_camera() {
    if (state_->camera_moves == camera_moves_ || !state_->moved_camera) return;
    camera_moves_ = state_->camera_moves;
    orbit_.look_from(*state_->moved_camera);
    is_camera_sent_ = true;  // the server knows
    is_due_ = true;
  }

  /// This scene cannot be drawn here; somebody else can draw it.
  Status leave_strands() {
    if (viewer_->wanted_mode() == StreamMode::Strands) return *drawn_.trouble;
    own_reason_ = "pictures: strands cannot be drawn here: " + drawn_.trouble->to_string();
    show_message(own_reason_);
    viewer_->request_mode(StreamMode::Frames);
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
    if (actions.wants_screenshot) ask_screenshot();
    if (actions.wants_debug_view) debug_view_ = next_of(debug_view_);
    if (saving_.valid() && saving_.wait_for(milliseconds(0)) == std::future_status::ready)
      show_message(saving_.get());
    if (viewer_ == nullptr) return;
    act(actions.form);

    if (actions.wants_pause_toggle)
      steer(ControlCommand{state_->status.is_paused ? Command::Resume : Command::Pause});
    if (actions.wants_step) steer(ControlCommand{Command::StepOnce});
    if (actions.wants_record_toggle) toggle_take();
    if (actions.wants_mode_toggle) change_mode();
    if (actions.wants_playout_toggle) {
      playout_ = playout_ == Playout::Smooth ? Playout::LowLatency : Playout::Smooth;
      viewer_->set_playout(playout_);
      for (const OtherHead& other : others_) other.viewer->set_playout(playout_);
    }
    // Also while strands are drawn here: the server's first picture then shows what the person sees.
    if (!is_camera_sent_ && now_ns() - camera_sent_ns_ > kCameraSendNs && state_->is_connected) {
      camera_sent_ns_ = now_ns();
      is_camera_sent_ = send(CameraChange{orbit_.camera()});
    }
  }

  void act(FormActions done) {
    const int64_t time_ns = now_ns();
    std::erase_if(done.edits, [&](const FormEdit& edit) {
      if (edit.path != kDebugViewPath) return false;
      debug_view_ = debug_view_named(std::get<std::string>(edit.value));
      return true;
    });
    sliders_.take_edits(done.edits, time_ns);
    if (const Status status = look_.edit(done.edits, time_ns); !status)
      show_message(status.error().to_string());
    if (done.wants_undo) look_.undo();
    if (done.file) look_.set_file(*done.file);
    if (done.wants_save) save_scene_now();
    if (done.wants_share) send(CameraCommand{0, orbit_.camera()});
    drawer_.set_own_look(look_.own_look());
    if (!state_->is_connected) return;
    if (const auto assignment = sliders_.take_assignment(time_ns)) send(SetParameter{*assignment});
    if (auto assignment = look_.take_assignment(time_ns); assignment && !send(SetParameter{*assignment}))
      look_.put_back();
  }

  /// The scene of whoever may ask the server for it, else what is known here.
  void save_scene_now() {
    if (!look_.is_steering()) return save_text(to_text(look_.shown(now_ns()), orbit_.camera()));
    if (send(SceneRequest{})) scene_asked_ns_ = now_ns();
  }

  void save_text(const std::string& text) {
    const Status saved = save_scene(look_.file(), text);
    show_message(saved ? fmt::format("saved {0}: strandcast-server --scene {0}", look_.file())
                       : saved.error().to_string());
  }

  /// Begins a take, or ends it. A recording that runs alone, and was not begun here, may be the server's
  /// whole run: a take begins beside it.
  void toggle_take() {
    const std::string& recorded = state_->status.recording;
    const bool is_beside = recorded.find(".mcap: ") != recorded.rfind(".mcap: ");
    const bool begins = recorded.empty() || !(has_begun_take_ || is_beside);
    has_begun_take_ = recorded.empty();
    steer(RecordCommand{begins});
  }

  /// Changes from strands to frames, to the server's choice, and back to strands.
  void change_mode() {
    if (!can_draw()) return show_message(own_reason_);
    const StreamMode last = viewer_->wanted_mode();
    viewer_->request_mode(last == StreamMode::Auto      ? StreamMode::Strands
                          : last == StreamMode::Strands ? StreamMode::Frames
                                                        : StreamMode::Auto);
  }

  void tell_drawer() {
    const bool is_wanted = is_visible() && state_->session_number > 0 && (!is_frames() || wants_whole_);
    drawer_.set_view(is_wanted
                         ? std::optional(DrawView{orbit_.camera(), window_->framebuffer_size(), debug_view_})
                         : std::nullopt);
  }

  /// The server's pictures are as large as the window, and none come while it is minimised.
  void tell_window() {
    const int64_t time_ns = now_ns();
    if (!state_->is_connected) return;
    WindowChange window = told_window_;
    window.is_hidden = !is_visible();
    if (window.is_hidden == told_window_.is_hidden && time_ns - window_told_ns_ < kWindowSendNs) return;
    if (is_visible()) {
      const RenderSize size = window_->framebuffer_size();
      window.frame_width = std::clamp(size.width, kMinPictureSide, kMaxPictureWidth);
      window.frame_height = std::clamp(size.height, kMinPictureSide, kMaxPictureHeight);
    }
    if (window == told_window_ || !send(window)) return;
    for (const OtherHead& other : others_) (void)other.viewer->send(window);
    told_window_ = window;
    window_told_ns_ = time_ns;
  }

  /// Tells the server about once a second what this machine makes of the stream.
  void report() {
    const int64_t time_ns = now_ns();
    if (!state_->is_connected) return;
    // What gets larger is told sooner, for more of it may have to be simulated.
    const double hair_px_now = hair_px();
    const bool has_grown = hair_px_now > kGrownHair * reported_hair_px_;
    if (time_ns - reported_ns_ < (has_grown ? kGrownReportNs : kReportNs)) return;
    reported_ns_ = time_ns;
    reported_hair_px_ = hair_px_now;
    ViewerReport now;
    now.decode_ms = std::min(state_->strand_decode_ms, kMaxReportedMs);
    now.wrong_states = static_cast<uint32_t>(state_->wrong_states);
    now.draw_ms = std::min(drawn_.fair_ms, kMaxReportedMs);
    now.picture_decode_ms = std::min(state_->picture_decode_ms, kMaxReportedMs);
    now.shown_hz = std::min(hud_.shown_hz(), kMaxReportedHz);
    now.device = !can_draw()                          ? DrawingDevice::None
                 : drawn_.device->value().is_software ? DrawingDevice::Software
                                                      : DrawingDevice::Hardware;
    now.hair_px = hair_px_now;
    // One that is lost is followed by the next.
    (void)viewer_->send(now);
  }

  /// How high the hair is in the window; where it is not in it, as little as can be told.
  double hair_px() {
    if (state_->asset == nullptr) return 0.0;
    if (measured_ != state_->asset) hair_ = hair_extent(*state_->asset);
    measured_ = state_->asset;
    const RenderSize size = window_->framebuffer_size();
    return std::clamp(hair_height_px(hair_, orbit_.camera(), {size.width, size.height}), kLeastHairPx,
                      kMaxReportedPx);
  }

  bool send(const ClientMessage& message) {
    if (!state_->is_connected) return false;
    const auto sent = viewer_->send(message);
    if (!sent) show_message(sent.error().to_string());
    return sent.ok();
  }

  /// What a viewer may not send would end the session.
  void steer(const ClientMessage& message) {
    if (state_->is_connected && !look_.is_steering())
      return show_message("this window only looks on: its role on the server is that of a viewer");
    (void)send(message);
  }

  /// Chooses the picture to show: the server's in frames mode, else the one drawn here. Until there is
  /// one the previous picture stays.
  void choose_image() {
    std::shared_ptr<const Image> chosen = is_frames() ? state_->image : drawn_.image;
    fit_ = is_frames() ? PictureFit::Inside : PictureFit::Stretched;
    if (chosen == nullptr) return;
    if (chosen != image_) ++shown_count_;
    image_ = std::move(chosen);
    image_mode_ = is_frames() ? StreamMode::Frames : StreamMode::Strands;
    image_sim_time_ns_ = is_frames() ? state_->image_sim_time_ns : drawn_.sim_time_ns;
  }

  bool is_picture_due(const WindowActions& actions) {
    const uint64_t shown = shown_count_;
    choose_image();
    const int64_t elapsed_ns = now_ns() - presented_ns_;
    is_due_ = is_due_ || actions.is_touched || shown_count_ != shown || elapsed_ns >= kPanelNs;
    return is_due_ && elapsed_ns >= kDisplayNs && is_visible();
  }

  milliseconds time_to_wait() const {
    if (!is_due_ || !is_visible()) return kLongestWait;
    const int64_t left_ns = kDisplayNs - (now_ns() - presented_ns_);
    return std::clamp(milliseconds(left_ns / kMsInNs + 1), milliseconds(0), kLongestWait);
  }

  void present(int64_t woke_ns) {
    const int64_t time_ns = now_ns();
    is_due_ = false;
    presented_ns_ = time_ns;
    const bool has_form = window_->is_form_visible() && state_->session_number > 0;
    window_->present(image_, fit_, hud_.write(*state_, facts(time_ns), time_ns),
                     has_form ? std::optional(form(time_ns)) : std::nullopt);
    if (image_ != nullptr && state_->server_clock_offset_ns)
      trace_->note_presented(image_mode_, image_sim_time_ns_, now_ns() + *state_->server_clock_offset_ns);
    answer_timer_.add_ms(static_cast<double>(now_ns() - woke_ns) / kMsInNs);
  }

  /// The look, and below it what this window alone shows.
  FormState form(int64_t time_ns) const {
    FormState form = look_.form(is_frames(), time_ns);
    const std::vector<FormField> sliders = sliders_.fields(time_ns);
    form.fields.insert(form.fields.begin(), sliders.begin(), sliders.end());
    form.top_note = sliders_.reason();
    FormField view;
    view.path = kDebugViewPath;
    view.section = "View";
    view.title = "shows (V)";
    view.help = "what the drawing on the processor is made of, in this window alone";
    view.widget = FormWidget::Choice;
    view.value = std::string(name_of(debug_view_));
    view.is_idle = is_frames();
    for (const DebugView choice : kDebugViews) view.choices.emplace_back(name_of(choice));
    form.fields.push_back(std::move(view));
    if (look_.is_steering()) form.share = "Show everybody this view";
    return form;
  }

  ViewFacts facts(int64_t time_ns) const {
    ViewFacts facts;
    facts.address = options_.address;
    facts.playout = playout_;
    facts.interpolation = drawn_.interpolation;
    facts.own_reason = own_reason_;
    if (time_ns - message_ns_ < kMessageNs) facts.message = message_;
    facts.has_own_look = look_.own_look().has_value();
    facts.is_starting = viewer_ == nullptr;
    facts.draw_step = drawn_.step;
    facts.draw_ms = drawn_.draw_timer.median_ms();
    if (drawn_.device && drawn_.device->ok()) facts.drawn_by = drawn_.device->value().name;
    facts.passes = drawn_.passes;
    facts.renderer_bytes = drawn_.renderer_bytes;
    facts.profile = drawn_.profile;
    facts.debug_view = debug_view_;
    facts.answer_ms = answer_timer_.median_ms();
    facts.shown_count = shown_count_;
    if (window_->is_unfolded() && state_->server_clock_offset_ns)
      facts.way = way_parts(trace_->decoded_since(time_ns + *state_->server_clock_offset_ns - kWayNs));
    facts.heads = heads_;
    for (size_t i = 0; i < others_.size(); ++i)
      if (const auto other = others_[i].viewer->look(); other->has_status && other->status.is_motion_stale)
        facts.stale_heads.push_back(heads_[i + 1]);
    return facts;
  }

  /// A picture of strands is drawn once more, whole, before it is saved.
  void ask_screenshot() {
    wants_whole_ = false;
    if (is_frames()) return save(state_->image);
    wants_whole_ = true;
    asked_whole_ = drawer_.ask_whole();
  }
  void save(const std::shared_ptr<const Image>& image) {
    if (image == nullptr) return show_message("nothing to save yet");
    if (saving_.valid()) return show_message("the last picture is being saved still");
    saving_ = std::async(std::launch::async, [image, number = ++screenshot_count_]() -> std::string {
      const std::string path = fmt::format("strandcast-{:04}.png", number);
      const auto saved = save_png(path, *image);
      Window::wake();
      return saved ? "saved " + path : saved.error().to_string();
    });
  }

  void show_message(std::string text) {
    message_ = std::move(text);
    message_ns_ = now_ns();
    is_due_ = true;
  }

  Result<ViewReport> finish() {
    const auto measured = viewer_ == nullptr ? std::nullopt : viewer_->stop_and_report();
    RETURN_IF_ERROR(trace_->close());
    if (state_->final_error) return *state_->final_error;
    if (!measured)
      return make_error(ErrorCode::Unavailable, "left before the server had answered{}{}",
                        state_->trouble.empty() ? "" : ": ", state_->trouble);
    ViewReport report = *measured;
    const DrawnState drawn = drawer_.look();
    set_render_times(report, drawn.draw_timer);
    set_interpolation(report, drawn.linear_count, drawn.cubic_count);
    add_answer_times(report, answer_timer_);
    if (!own_reason_.empty()) set_mode_reason(report, own_reason_);
    return report;
  }

  const ViewOptions& options_;
  ClientConfig config_;
  std::unique_ptr<Window> window_;  // before what wakes it
  OrbitCamera orbit_{CameraDesc{}};
  std::string own_reason_;  // why this machine needs frames; empty = the server's reason counts
  Playout playout_;
  bool has_begun_take_ = false;  // when nothing else was recorded
  LookControl look_;
  HairSliders sliders_;
  uint64_t asked_session_ = 0;  // for the sliders' values; 0 = none
  DebugView debug_view_ = DebugView::None;
  std::string look_trouble_;    // as it was told
  int64_t scene_asked_ns_ = 0;  // for saving it; 0 = not asked
  HudWriter hud_;
  StageTimer answer_timer_;
  bool is_camera_sent_ = false;
  int64_t camera_sent_ns_ = 0;
  WindowChange told_window_;  // that the server knows
  int64_t window_told_ns_ = 0;
  uint64_t camera_moves_ = 0;  // by others, that were followed
  int64_t reported_ns_ = 0;
  double reported_hair_px_ = 0.0;
  std::shared_ptr<const SceneAsset> measured_;  // what hair_ is of
  HairExtent hair_;
  int64_t presented_ns_ = 0;
  bool is_due_ = true;                  // a picture
  std::shared_ptr<const Image> image_;  // that is shown
  StreamMode image_mode_ = StreamMode::Strands;
  int64_t image_sim_time_ns_ = 0;
  PictureFit fit_ = PictureFit::Stretched;
  uint64_t shown_count_ = 0;  // different pictures
  bool wants_whole_ = false;
  uint64_t asked_whole_ = 0;
  uint32_t screenshot_count_ = 0;
  std::string message_;
  int64_t message_ns_ = 0;
  const std::shared_ptr<FrameTrace> trace_;
  DrawnState drawn_;                          // what this turn of the loop shows
  std::shared_ptr<const ViewerState> state_;  // likewise
  std::future<std::string> saving_;
  StrandDrawer drawer_;
  // Last: they tell the drawer.
  std::unique_ptr<ViewerThread> viewer_;
  std::vector<std::string> heads_;  // all that are drawn, by name; none where there is one
  std::vector<OtherHead> others_;   // those behind the first
  std::future<void> leaving_;       // of those that were
};

}  // namespace

Result<ViewReport> run_windowed(const ViewOptions& options, const std::atomic<bool>& stop) {
  ASSIGN_OR_RETURN(auto window, Window::open("Strandcast", options.size));
  ClientConfig config = client_config(options);
  config.cancel = [&stop]() -> std::optional<Error> {
    if (!stop) return std::nullopt;
    return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
  };
  return WindowedView(options, std::move(config), std::move(window)).run(stop);
}

}  // namespace strandcast
