#include "client/app/diagnose.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "client/app/view_hud.h"
#include "client/app/viewer_session.h"
#include "client/app/way_out.h"
#include "client/window/window.h"
#include "common/base/units.h"
#include "common/base/version.h"
#include "common/render/render_device.h"
#include "common/strands/strand_codec.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kDiagnosePumpWait{20};
constexpr double kFarMs = 150.0;  // of a round trip: turning the server's pictures feels late

class Examination {
 public:
  Examination(const ViewOptions& options, const std::atomic<bool>& stop) : options_(options), stop_(stop) {}

  Diagnosis run() {
    look_at_drawing();
    look_at_display();
    look_at_decoders();
    if (const auto session = connect()) watch(*session);
    return std::move(lines_);
  }

 private:
  void add(Finding finding, const char* subject, std::string text, std::string way_out = {}) {
    lines_.push_back({finding, subject, std::move(text), std::move(way_out)});
  }

  void look_at_drawing() {
    const auto device = RenderDevice::open(options_.drawing);
    if (device) {
      const RenderDeviceInfo& info = (*device)->info();
      if (info.is_software)
        return add(Finding::Note, "drawing", "strands are drawn by " + info.name,
                   "a GPU with its driver draws them faster");
      return add(Finding::Ok, "drawing", "strands are drawn by " + info.name);
    }
    const bool is_needed = options_.mode == StreamMode::Strands;
    add(is_needed ? Finding::Missing : Finding::Note, "drawing",
        "strands cannot be drawn here: " + device.error().to_string(),
        is_needed
            ? "without --device and --renderer the processor draws them; --mode auto or frames shows the "
              "server's pictures"
            : "the server's pictures are shown instead");
  }

  void look_at_display() {
    if (options_.is_headless) return;
    if (Window::check_display()) return add(Finding::Ok, "display", "a window can be opened");
    add(Finding::Note, "display", "there is none: no window can be opened",
        "--headless --screenshot FILE or --clip FILE works without");
  }

  void look_at_decoders() {
    std::vector<std::string> strands, pictures, others;
    for (const StrandCodecInfo& codec : strand_codecs()) strands.push_back(codec.name);
    for (const PictureCodec codec : kPictureCodecs)
      ((options_.picture_codecs & decodable_picture_codecs() & codec_bit(codec)) != 0 ? pictures : others)
          .emplace_back(to_string(codec));
    add(Finding::Ok, "decoders",
        fmt::format("strands: {}; pictures: {}{}", fmt::join(strands, ", "), fmt::join(pictures, ", "),
                    others.empty() ? std::string() : fmt::format(" (not {})", fmt::join(others, ", "))));
  }

  /// Connects as the viewer does; says why not.
  std::unique_ptr<ViewerSession> connect() {
    ClientConfig config = client_config(options_);
    auto session = try_to_connect(config);
    if (session) return std::move(*session);
    const Error& error = session.error();
    const ConnectStep step = step_;
    std::string help = way_out(error, step, config.address);
    if (step == ConnectStep::AskForWebSocket && !config.address.is_tls && speaks_tls(config))
      help =
          fmt::format("the server speaks TLS: use wss://{}, and --tls-ca FILE for a certificate of your own",
                      config.address.to_string());
    if (step == ConnectStep::AwaitWelcome && is_refusal(error) && error.code == ErrorCode::Unsupported &&
        config.hello.role == Role::Controller && would_be_viewer(config))
      help = "--view-only works with this token, and steers nothing";
    add(Finding::Missing, subject_of(step, error), error.to_string(), help);
    return nullptr;
  }

  Result<std::unique_ptr<ViewerSession>> try_to_connect(ClientConfig config) {
    config.connect_timeout = config.welcome_timeout = kDiagnosisTimeout;
    config.on_step = [this](ConnectStep step) { step_ = step; };
    config.cancel = [this]() -> std::optional<Error> {
      if (!stop_) return std::nullopt;
      return make_error(ErrorCode::Unavailable, "stopped before the server had answered");
    };
    return ViewerSession::open(config);
  }

  /// What answered in the clear with something strange, asked again with TLS.
  bool speaks_tls(ClientConfig config) {
    config.address.is_tls = true;
    const auto session = try_to_connect(config);
    const bool is_beyond = step_ == ConnectStep::AskForWebSocket || step_ == ConnectStep::AwaitWelcome;
    return session.ok() || is_beyond ||
           (step_ == ConnectStep::BeginTls && session.error().code == ErrorCode::Unauthorized);
  }

  bool would_be_viewer(ClientConfig config) {
    config.hello.role = Role::Viewer;
    return try_to_connect(config).ok();
  }

  static const char* subject_of(ConnectStep step, const Error& error) {
    const bool is_refused =
        is_refusal(error) && (error.code == ErrorCode::Unauthorized || error.code == ErrorCode::Unsupported);
    return step == ConnectStep::BeginTls                     ? "TLS"
           : step == ConnectStep::AwaitWelcome && is_refused ? "role"
                                                             : "server";
  }

  void watch(ViewerSession& session) {
    const Welcome& welcome = session.welcome();
    add(welcome.server_version == version() ? Finding::Ok : Finding::Note, "server",
        fmt::format("{} answers: version {}, scene '{}', {} strands x {} by {}", options_.address.to_string(),
                    welcome.server_version, welcome.scene_name, welcome.strand_count, welcome.vertex_count,
                    welcome.codec),
        welcome.server_version == version() ? std::string()
                                            : fmt::format("this viewer is version {}", version()));
    add(Finding::Ok, "role",
        fmt::format("{}{}", to_string(welcome.role),
                    options_.address.is_tls ? ", encrypted" : ", not encrypted"));
    if (!welcome.heads.empty())
      add(Finding::Ok, "heads", fmt::format("{} (--head NAME shows one)", fmt::join(welcome.heads, ", ")));
    if (!welcome.codec_reason.empty()) add(Finding::Ok, "codec", welcome.codec_reason);
    const auto end = Clock::now() + kDiagnosisTimeout;
    const auto enough = Clock::now() + kDiagnosisWatch;
    Status pumped;
    while (!stop_ && pumped && Clock::now() < (session.has_picture() ? enough : end))
      pumped = session.pump(kDiagnosePumpWait);
    say_stream(session, pumped);
    say_clock(session);
    say_link(session);
  }

  void say_stream(const ViewerSession& session, const Status& pumped) {
    if (!pumped) return add(Finding::Missing, "stream", pumped.error().to_string());
    const std::string& trouble = session.replay().stats().last_error;
    if (!session.has_picture())
      return add(Finding::Missing, "stream",
                 fmt::format("the server sent nothing to show for {} s{}", kDiagnosisTimeout.count() / 1000,
                             trouble.empty() ? "" : "; last problem: " + trouble),
                 "look at its log, and whether its simulation runs (strandcast-ctl health)");
    const bool is_frames = session.mode() == StreamMode::Frames;
    const StageTimer& decode = is_frames ? session.picture_decode_timer() : session.replay().decode_timer();
    add(Finding::Ok, "stream",
        fmt::format("{}: {} frames, decoded in {:.1f} ms each",
                    is_frames ? "the server's pictures" : "strands", session.decoded_frames(),
                    decode.median_ms()));
    const double pace = session.status().realtime_factor;
    if (session.has_status() && session.status().is_paused)
      add(Finding::Note, "pace", "the simulation is paused", "strandcast-ctl resume");
    else if (session.has_status() && pace > 0.0 && pace < kSlowMotion)
      add(Finding::Note, "pace", fmt::format("the server runs at {:.2f} of real time", pace),
          "fewer strands or a cheaper solver there");
  }

  void say_clock(ViewerSession& session) {
    const ClockOffset clock = session.client().clock();
    if (!clock.has_value())
      return add(Finding::Missing, "clock", "the server answers no clock probes",
                 "use the viewer and the server of one version");
    const double error_ms = static_cast<double>(clock.error_ns()) * 1e-6;
    add(Finding::Ok, "clock", fmt::format("the server's is known within {:.2f} ms", error_ms));
  }

  void say_link(ViewerSession& session) {
    const ConnectionCounters net = session.client().counters();
    const ClockOffset clock = session.client().clock();
    const double round_trip_ms = clock.has_value() ? 2.0 * static_cast<double>(clock.error_ns()) * 1e-6 : 0.0;
    const double mbit = static_cast<double>(net.received_bytes) * kMbitPerByte / session.connected_s();
    const std::string text = fmt::format("round trip {:.1f} ms, {:.2f} Mbit/s arrive", round_trip_ms, mbit);
    if (session.quality_changes() > 0 && session.quality().strand_share < 1.0f)
      return add(Finding::Note, "link", text + "; " + session.quality().reason,
                 "a faster link, or fewer strands at the server");
    if (round_trip_ms > kFarMs)
      return add(Finding::Note, "link", text, "--mode strands turns the view without the way to the server");
    add(Finding::Ok, "link", text);
  }

  const ViewOptions& options_;
  const std::atomic<bool>& stop_;
  std::atomic<ConnectStep> step_{ConnectStep::FindHost};
  Diagnosis lines_;
};

const char* to_word(Finding finding) {
  return finding == Finding::Ok ? "ok" : finding == Finding::Note ? "note" : "missing";
}

}  // namespace

Diagnosis diagnose(const ViewOptions& options, const std::atomic<bool>& stop) {
  return Examination(options, stop).run();
}

bool would_work(const Diagnosis& diagnosis) {
  return std::none_of(diagnosis.begin(), diagnosis.end(),
                      [](const DiagnosisLine& line) { return line.finding == Finding::Missing; });
}

std::string to_text(const Diagnosis& diagnosis) {
  std::string text;
  for (const DiagnosisLine& line : diagnosis)
    text += fmt::format("{:<8} {:<9} {}{}{}\n", to_word(line.finding), line.subject, line.text,
                        line.way_out.empty() ? "" : "; ", line.way_out);
  return text + (would_work(diagnosis) ? "a session would work\n" : "a session would not work\n");
}

}  // namespace strandcast
