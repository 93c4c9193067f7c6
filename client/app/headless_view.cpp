#include <algorithm>
#include <utility>

#include "client/app/clip_store.h"
#include "client/app/live_connection.h"
#include "client/app/views.h"
#include "common/log/log.h"
#include "common/log/progress.h"
#include "common/render/render_device.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPumpWait{20};
constexpr double kFirstPictureTimeoutS = 15.0;
constexpr double kStallTimeoutS = 15.0;  // no frame for this long although more are wanted

using SnapshotPtr = std::shared_ptr<const Snapshot>;
using Connections = std::vector<std::unique_ptr<LiveConnection>>;

/// What was received and is to be written. Of several heads the first gives the times.
struct Collected {
  ClipStore clip;
  std::vector<std::vector<SnapshotPtr>> clip_others;  // of the further heads, by picture
  SnapshotPtr screenshot_snapshot;
  std::vector<SnapshotPtr> screenshot_others;
  std::optional<Image> screenshot_image;
};

/// What snapshots are drawn with, after the connection is gone.
struct DrawnHead {
  std::shared_ptr<const SceneAsset> asset;
  LookDesc look;  // of the end
};
struct Drawn {
  RenderDevice* device = nullptr;
  std::vector<DrawnHead> heads;
  HeadsCamera camera;
  ClockOffset clock;
  std::shared_ptr<FrameTrace> trace;
};

/// How long a run connects and receives; nothing = as long as it takes.
class TimeLimit {
 public:
  explicit TimeLimit(const std::optional<double>& limit_s) : limit_s_(limit_s) {}
  bool is_over() const { return limit_s_ && elapsed_s() >= *limit_s_; }
  double limit_s() const { return limit_s_.value_or(0.0); }
  double elapsed_s() const { return static_cast<double>(now_ns() - begin_ns_) * 1e-9; }

 private:
  const std::optional<double> limit_s_;
  const int64_t begin_ns_ = now_ns();
};

/// Connects, however long it takes, within the limit and until a stop.
Status await_session(LiveConnection& live, const TimeLimit& limit, const std::atomic<bool>& stop) {
  while (!live.has_session()) {
    if (live.final_error()) return *live.final_error();
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
    if (limit.is_over())
      return make_error(ErrorCode::Timeout, "the server did not answer within {} s{}", limit.limit_s(),
                        live.trouble().empty() ? std::string() : "; last problem: " + live.trouble());
    live.pump(kPumpWait);
  }
  return {};
}

class Collector {
 public:
  /// `others` are the connections of the further heads.
  Collector(const ViewOptions& options, LiveConnection& live, Connections& others, FrameTrace& trace,
            const TimeLimit& limit, const std::atomic<bool>& stop)
      : options_(options),
        live_(live),
        others_(others),
        trace_(trace),
        limit_(limit),
        stop_(stop),
        collected_{ClipStore(options.clip_fps, options.clip_s, kMaxClipBytes / (1 + others.size())),
                   {},
                   {},
                   {},
                   {}} {
    begin_session();
  }
  ~Collector() { session().set_snapshot_listener({}); }

  Result<Collected> run() {
    RETURN_IF_ERROR(wait_for_first_picture());
    uint64_t seen_frames = decoded_frames();
    int64_t last_frame_ns = now_ns();
    while (!stop_ && !is_complete()) {
      RETURN_IF_ERROR(pump());
      if (session().mode() == StreamMode::Frames) take_image();
      if (decoded_frames() != seen_frames) {
        seen_frames = decoded_frames();
        last_frame_ns = now_ns();
      }
      // A server that is away comes back; and a run of so many seconds takes so many.
      if (!live_.is_connected() || options_.seconds) last_frame_ns = now_ns();
      if (static_cast<double>(now_ns() - last_frame_ns) * 1e-9 > kStallTimeoutS)
        return make_error(ErrorCode::Timeout, "no new frame for {} s (is the server paused?)",
                          kStallTimeoutS);
    }
    if (!collected_.screenshot_snapshot) take_screenshot(session().replay().newest());
    if (!collected_.screenshot_image && session().image()) collected_.screenshot_image = *session().image();
    return std::move(collected_);
  }

 private:
  ViewerSession& session() { return live_.session(); }
  uint64_t decoded_frames() { return earlier_frames_ + session().decoded_frames(); }

  void begin_session() {
    session().set_snapshot_listener([this](const auto& snapshot) { take(snapshot); });
    session().replay().set_playout(options_.playout);
    taken_images_ = 0;
    known_frames_ = 0;
    camera_ = session().welcome().camera;  // it is shown so to begin with
  }

  /// Waits for the server if it went away; the error is one that waiting does not mend.
  Status pump() {
    const uint32_t strands = session().welcome().strand_count, vertices = session().welcome().vertex_count;
    known_frames_ = session().decoded_frames();
    if (live_.pump(kPumpWait)) {
      earlier_frames_ += known_frames_;
      begin_session();
      // Pictures of one clip are drawn with one groom.
      const bool is_drawn = !options_.screenshot.empty() || !options_.clip.empty();
      if (is_drawn &&
          (strands != session().welcome().strand_count || vertices != session().welcome().vertex_count))
        return make_error(ErrorCode::Unavailable, "the server came back with another scene");
    }
    if (live_.final_error()) return *live_.final_error();
    for (const auto& other : others_) {
      if (other->pump(milliseconds(0))) other->session().replay().set_playout(options_.playout);
      if (other->final_error()) return *other->final_error();
    }
    follow_camera();
    report();
    return {};
  }

  /// Tells the server where this viewer looks from, and so its pictures, when that changes.
  void follow_camera() {
    const CameraDesc& camera = session().camera();
    if (camera == camera_ || !session().client().send(CameraChange{camera})) return;
    camera_ = camera;
  }

  /// Tells the server about once a second how fast this machine decodes; it draws afterwards.
  void report() {
    constexpr int64_t kReportNs = 1'000'000'000;
    if (!live_.is_connected() || now_ns() - reported_ns_ < kReportNs) return;
    reported_ns_ = now_ns();
    ViewerReport now;
    now.decode_ms = std::min(session().replay().decode_timer().median_ms(), kMaxReportedMs);
    now.picture_decode_ms = std::min(session().picture_decode_timer().median_ms(), kMaxReportedMs);
    now.wrong_states = static_cast<uint32_t>(session().replay().stats().wrong_states);
    // One that is lost is followed by the next.
    (void)session().client().send(now);
  }

  Status wait_for_first_picture() {
    int64_t begin_ns = now_ns();
    while (!stop_ && !has_pictures()) {
      RETURN_IF_ERROR(pump());
      if (!live_.is_connected()) begin_ns = now_ns();
      if (has_pictures()) break;
      if (limit_.is_over() || static_cast<double>(now_ns() - begin_ns) * 1e-9 > kFirstPictureTimeoutS)
        return make_error(ErrorCode::Timeout, "the server sent nothing to show for {} s{}",
                          std::min(kFirstPictureTimeoutS, options_.seconds.value_or(kFirstPictureTimeoutS)),
                          session().replay().stats().last_error.empty()
                              ? std::string()
                              : "; last problem: " + session().replay().stats().last_error);
    }
    return {};
  }

  /// Of every head.
  bool has_pictures() { return session().has_picture() && others_have_pictures(); }
  bool others_have_pictures() {
    return std::all_of(others_.begin(), others_.end(),
                       [](const auto& other) { return other->session().has_picture(); });
  }

  bool is_complete() {
    if (limit_.is_over()) return true;
    const bool wants_clip = !options_.clip.empty();
    if (options_.seconds || (wants_clip && !collected_.clip.is_full())) return false;
    if (wants_clip && options_.screenshot.empty()) return true;
    return decoded_frames() >= options_.after_frames;
  }

  /// States from before every head has come are passed over: a picture would lack one.
  void take(const std::shared_ptr<const Snapshot>& snapshot) {
    if (!others_have_pictures()) return;
    if (!options_.clip.empty()) collected_.clip.add(snapshot);
    while (collected_.clip_others.size() < collected_.clip.snapshots().size())
      collected_.clip_others.push_back(newest_of_others());
    if (!collected_.screenshot_snapshot && decoded_frames() >= options_.after_frames)
      take_screenshot(snapshot);
  }

  void take_screenshot(const SnapshotPtr& snapshot) {
    collected_.screenshot_snapshot = snapshot;
    collected_.screenshot_others = newest_of_others();
  }

  std::vector<SnapshotPtr> newest_of_others() {
    std::vector<SnapshotPtr> newest;
    for (const auto& other : others_) newest.push_back(other->session().replay().newest());
    return newest;
  }

  /// Pictures carry no simulation time to the listener, so the clip takes them as they come, on the wall
  /// clock.
  void take_image() {
    if (session().image_count() == taken_images_ || session().image() == nullptr) return;
    taken_images_ = session().image_count();
    if (const ClockOffset clock = session().client().clock(); clock.has_value())
      trace_.note_presented(StreamMode::Frames, session().image_sim_time_ns(), clock.to_server_ns(now_ns()));
    if (!options_.clip.empty()) collected_.clip.add(*session().image(), now_ns());
    if (!collected_.screenshot_image && taken_images_ >= options_.after_frames)
      collected_.screenshot_image = *session().image();
  }

  const ViewOptions& options_;
  LiveConnection& live_;
  Connections& others_;
  FrameTrace& trace_;
  const TimeLimit& limit_;
  const std::atomic<bool>& stop_;
  Collected collected_;
  int64_t reported_ns_ = 0;
  uint64_t earlier_frames_ = 0;  // of sessions that broke
  uint64_t known_frames_ = 0;    // of the running one
  uint64_t taken_images_ = 0;
  CameraDesc camera_;  // of the server's pictures
};

Status write_images(const ViewOptions& options, const Collected& collected) {
  if (!options.screenshot.empty() && collected.screenshot_image)
    RETURN_IF_ERROR(save_png(options.screenshot, *collected.screenshot_image));
  if (options.clip.empty() || collected.clip.images().empty()) return {};
  ASSIGN_OR_RETURN(ClipWriter clip, ClipWriter::make(options.clip, options.clip_fps));
  for (const Image& image : collected.clip.images()) RETURN_IF_ERROR(clip.add(image));
  return clip.finish();
}

/// Draws states of all heads with the same renderers as the server and the window.
class SnapshotDrawer {
 public:
  SnapshotDrawer(const Drawn& scene, StageTimer& render_timer) : scene_(scene), timer_(render_timer) {}

  Status begin() {
    for (const DrawnHead& head : scene_.heads) {
      ASSIGN_OR_RETURN(auto renderer, scene_.device->make_renderer(*head.asset, head.look));
      renderers_.push_back(std::move(renderer));
      fills_.emplace_back(head.asset->rest_position_m, head.asset->vertex_count);
    }
    return {};
  }

  /// A head of which nothing has come is left out.
  Result<Image> draw(const SnapshotPtr& first, const std::vector<SnapshotPtr>& others, RenderSize size) {
    const int64_t begin_ns = now_ns();
    std::vector<PosedStrands> strands;
    strands.reserve(1 + others.size());
    std::vector<PlacedHead> heads;
    for (size_t i = 0; i <= others.size() && i < renderers_.size(); ++i) {
      const SnapshotPtr& snapshot = i == 0 ? first : others[i - 1];
      if (snapshot == nullptr) continue;
      strands.push_back(posed_strands_of(*snapshot, fills_[i]));
      heads.push_back({renderers_[i].get(), &strands.back()});
    }
    ASSIGN_OR_RETURN(HeadsPicture picture, draw_heads(heads, scene_.camera, size));
    // It was read back, which waits for the GPU, so the time is the whole picture's.
    const int64_t end_ns = now_ns();
    timer_.add_ms(static_cast<double>(end_ns - begin_ns) * 1e-6);
    if (scene_.clock.has_value())
      scene_.trace->note_presented(StreamMode::Strands, first->sim_time_ns,
                                   scene_.clock.to_server_ns(end_ns));
    return std::move(picture.image);
  }

 private:
  const Drawn& scene_;
  StageTimer& timer_;
  std::vector<std::unique_ptr<Renderer>> renderers_;
  std::vector<StrandFill> fills_;
};

/// After a stop nothing more is drawn, and a clip that has begun is not written.
Status render_snapshots(const ViewOptions& options, const Drawn& scene, const Collected& collected,
                        StageTimer& render_timer, const std::atomic<bool>& stop) {
  SnapshotDrawer drawer(scene, render_timer);
  RETURN_IF_ERROR(drawer.begin());
  if (!options.screenshot.empty() && collected.screenshot_snapshot) {
    ASSIGN_OR_RETURN(const Image image,
                     drawer.draw(collected.screenshot_snapshot, collected.screenshot_others, options.size));
    RETURN_IF_ERROR(save_png(options.screenshot, image));
  }
  if (options.clip.empty()) return {};
  ASSIGN_OR_RETURN(ClipWriter clip, ClipWriter::make(options.clip, options.clip_fps));
  const auto& snapshots = collected.clip.snapshots();
  Progress progress({"drawing the clip", false, "picture"});
  progress.expect(static_cast<uint32_t>(snapshots.size()), static_cast<double>(snapshots.size()));
  for (size_t i = 0; i < snapshots.size(); ++i) {
    if (stop) return {};
    progress.begin_run(options.clip.string());
    ASSIGN_OR_RETURN(const Image image,
                     drawer.draw(snapshots[i], collected.clip_others[i], options.clip_size));
    RETURN_IF_ERROR(clip.add(image));
    progress.end_run(1.0);
  }
  if (stop) return {};
  return clip.finish();
}

/// Connections to the further heads of a server, whose strands are drawn beside the first's. None where one
/// head was asked for, and where pictures were: they show all.
Result<Connections> open_others(ClientConfig config, const Welcome& first, const TimeLimit& limit,
                                const std::atomic<bool>& stop) {
  Connections others;
  if (!config.hello.head.empty() || config.hello.mode == StreamMode::Frames) return others;
  config.hello.mode = StreamMode::Strands;
  for (size_t i = 1; i < first.heads.size(); ++i) {
    config.hello.head = first.heads[i];
    others.push_back(LiveConnection::begin(config));
    RETURN_IF_ERROR(await_session(*others.back(), limit, stop));
  }
  return others;
}

}  // namespace

Result<ViewReport> run_headless(const ViewOptions& options, const std::atomic<bool>& stop) {
  const bool wants_render = !options.screenshot.empty() || !options.clip.empty();
  ClientConfig config = client_config(options);
  std::unique_ptr<RenderDevice> device;
  std::string own_reason;
  if (wants_render && options.mode != StreamMode::Frames) {
    auto made = RenderDevice::open(options.drawing);
    if (!made && options.mode == StreamMode::Strands) return made.error();
    if (made) {
      device = std::move(made).value();
    } else {
      config.hello.mode = StreamMode::Frames;
      own_reason = "pictures: strands cannot be drawn here: " + made.error().to_string();
    }
  }
  const TimeLimit limit(options.seconds);
  config.cancel = [&]() -> std::optional<Error> {
    if (stop) return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
    if (!limit.is_over()) return std::nullopt;
    return make_error(ErrorCode::Timeout, "the server did not answer within {} s", *options.seconds);
  };
  const auto trace = std::make_shared<FrameTrace>();
  if (!options.trace.empty()) RETURN_IF_ERROR(trace->open(options.trace));
  auto live = LiveConnection::begin(config);
  RETURN_IF_ERROR(await_session(*live, limit, stop));
  if (!options.trace.empty()) {
    trace->want_states(true);
    live->set_trace(trace);
  }
  ASSIGN_OR_RETURN(Connections others, open_others(config, live->session().welcome(), limit, stop));
  const Result<Collected> ended = Collector(options, *live, others, *trace, limit, stop).run();
  ViewerSession* session = &live->session();

  StageTimer render_timer;
  ViewReport report = make_report(*session, scope_of(*live));
  if (!own_reason.empty()) set_mode_reason(report, own_reason);
  if (!ended) {
    // What came before is what somebody looks for in the report then.
    if (!options.report.empty()) RETURN_IF_ERROR(save_report(options.report, report));
    return ended.error();
  }
  const Collected& collected = *ended;
  const StreamMode mode = session->mode();  // a clip holds what came in the mode that the run ended in
  Drawn scene{device.get(),
              {{session->shared_asset(), session->look().look}},
              {session->camera(), session->look().camera},
              session->client().clock(),
              trace};
  for (const auto& other : others)
    scene.heads.push_back({other->session().shared_asset(), other->session().look().look});
  others.clear();
  live.reset();  // the server need not serve a viewer that only draws now
  if (stop && wants_render) log_warn("render", "stopped: nothing is drawn");
  if (stop) return report;
  if (collected.clip.is_cut())
    log_warn("render", "the clip ends early: its states would take more than {} MiB", kMaxClipBytes >> 20);
  if (wants_render && mode == StreamMode::Frames) RETURN_IF_ERROR(write_images(options, collected));
  if (wants_render && mode == StreamMode::Strands && scene.heads.front().asset && scene.device)
    RETURN_IF_ERROR(render_snapshots(options, scene, collected, render_timer, stop));
  set_render_times(report, render_timer);
  RETURN_IF_ERROR(trace->close());
  return report;
}

}  // namespace strandcast
