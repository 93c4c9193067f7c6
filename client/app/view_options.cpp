#include "client/app/view_options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iostream>

#include "client/app/recording_film.h"
#include "common/base/command_line_error.h"
#include "common/base/frame_rate.h"
#include "common/base/version.h"
#include "common/client/client_token.h"
#include "common/kernels/step_speed.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

Result<RenderSize> parse_size(const std::string& text) {
  RenderSize size;
  const char* const end = text.data() + text.size();
  const auto width = std::from_chars(text.data(), end, size.width);
  bool is_size = width.ec == std::errc() && width.ptr != end && *width.ptr == 'x';
  if (is_size) {
    const auto height = std::from_chars(width.ptr + 1, end, size.height);
    is_size = height.ec == std::errc() && height.ptr == end;
  }
  const auto fits = [](uint32_t side) { return side >= kMinViewSide && side <= kMaxImageSide; };
  if (!is_size || !fits(size.width) || !fits(size.height))
    return make_error(ErrorCode::BadInput, "'{}' is not a picture size (use WIDTHxHEIGHT, each {} to {})",
                      text, kMinViewSide, kMaxImageSide);
  return size;
}

Result<StreamMode> parse_mode(const std::string& text) {
  for (const StreamMode mode : {StreamMode::Strands, StreamMode::Frames, StreamMode::Auto})
    if (text == to_string(mode)) return mode;
  return make_error(ErrorCode::BadInput, "unknown mode '{}' (known: strands, frames, auto)", text);
}

Role role_of(const ViewOptions& options) {
  return options.is_headless || options.is_view_only ? Role::Viewer : Role::Controller;
}

ClientConfig client_config(const ViewOptions& options) {
  ClientConfig config;
  config.address = options.address;
  config.tls_authorities = options.tls_authorities;
  config.hello.role = role_of(options);
  config.hello.mode = options.mode;
  config.hello.name = "strandcast-view";
  config.hello.token = options.token;
  config.hello.frame_width = std::min(options.size.width, kMaxPictureWidth);
  config.hello.frame_height = std::min(options.size.height, kMaxPictureHeight);
  config.hello.picture_codecs = options.picture_codecs;
  config.hello.step_ns = measured_step_ns();
  config.hello.codec_wish = options.codec_wish;
  config.hello.keeps_camera = options.keeps_camera;
  config.hello.head = options.head;
  return config;
}

namespace {

constexpr const char* kAnyCodec = "auto";
constexpr double kMostFilmS = 86'400.0;

/// Values that need more than CLI11's own conversion.
struct RawOptions {
  std::string connect = "127.0.0.1:" + std::to_string(kDefaultPort);
  std::string diagnose;  // instead of connect; empty = no
  std::string mode = "auto";
  std::string pictures = "any";
  std::string codec = kAnyCodec;
  std::string size = "960x540";
  std::string clip_size;  // empty = as size
  std::string token_file;
  bool is_tls = false;
  double seconds = 0.0;
  std::string playout = "low-latency";
};

void declare(CLI::App& app, RawOptions& raw, ViewOptions& options) {
  const CLI::Validator frame_rates([](std::string& text) { return make_frame_rate(text, 1.0, kMaxClipFps); },
                                   "");
  app.add_option("recording", options.recording, "A recording (.mcap) to play, instead of a server");
  app.add_option("--export", options.film,
                 "Draw the recording into a film (.webm, or .webp) or into pictures (frames/%04d.png), "
                 "without a window");
  app.add_option("--fps", options.film_fps, "Frames per second of --export, such as 24, 23.976 or 24000/1001")
      ->transform(frame_rates)
      ->capture_default_str();
  const auto seconds = without_nan(CLI::Range(0.0, kMostFilmS));
  app.add_option("--from", options.film_from_s, "Begin --export so many seconds after the first state")
      ->check(seconds);
  app.add_option("--to", options.film_to_s, "End --export so many seconds after the first state")
      ->check(seconds);
  app.add_option("--connect", raw.connect, "Server as HOST:PORT")->capture_default_str();
  app.add_option(
      "--diagnose", raw.diagnose,
      "Say what a session with the server at HOST:PORT needs and what is missing, and leave: 0 when "
      "it would work, 1 when something is missing");
  app.add_option("--mode", raw.mode,
                 "strands: drawn here; frames: the server's pictures; auto: whichever is better now")
      ->capture_default_str();
  app.add_option("--pictures", raw.pictures,
                 "In frames mode: jpeg, tiles, vp8, h264 or any (the server chooses)")
      ->check(CLI::IsMember({"jpeg", "tiles", "vp8", "h264", "any"}))
      ->capture_default_str();
  app.add_option(
         "--codec", raw.codec,
         "Of strands: auto (the server chooses by what this machine can), or the name of one to insist on")
      ->capture_default_str();
  app.add_option("--head", options.head,
                 "Of a server with several heads show the one of this name alone (default: all)");
  app.add_option("--token-file", raw.token_file,
                 "File with the token: the token alone, or lines 'role token'");
  app.add_option("--token", options.token, kTokenHelp)->envname(kTokenVariable);
  app.add_flag("--tls", raw.is_tls, "Encrypt the connection, as an address with wss:// does");
  app.add_option("--tls-ca", options.tls_authorities, kTlsAuthoritiesHelp);
  app.add_flag("--view-only", options.is_view_only,
               "Ask for a viewer's role: no steering of the server, and another look is seen here alone");
  app.add_option("--size", raw.size, "Picture or window size, WIDTHxHEIGHT")->capture_default_str();
  app.add_option(
         "--playout", raw.playout,
         "low-latency: the newest state; smooth: between states, one frame behind, or two (and on cubics) "
         "where 20 to 45 states come a second")
      ->check(CLI::IsMember({"low-latency", "smooth"}))
      ->capture_default_str();
  app.add_flag("--headless", options.is_headless, "No window: pictures, clip and report only");
  app.add_option("--screenshot", options.screenshot, "Write a PNG (headless)");
  app.add_option("--after-frames", options.after_frames, "Decoded frames before the screenshot")
      ->check(CLI::Range(uint64_t{1}, uint64_t{1'000'000}))
      ->capture_default_str();
  app.add_option("--clip", options.clip, "Write an animated WebP (headless)");
  app.add_option("--clip-seconds", options.clip_s, "Length of the clip, simulated seconds")
      ->check(without_nan(CLI::Range(0.1, kMaxClipS)))
      ->capture_default_str();
  app.add_option("--clip-fps", options.clip_fps, "Pictures per second of the clip")
      ->transform(frame_rates)
      ->capture_default_str();
  app.add_option("--clip-size", raw.clip_size, "Size of the clip (default: as --size)");
  app.add_option("--seconds", raw.seconds, "Stop receiving after this long; what came is then drawn")
      ->check(without_nan(CLI::Range(0.1, 1e6)));
  app.add_option("--report", options.report, "Write what was measured: .json, else key=value lines");
  app.add_option(
      "--trace", options.trace,
      "Write when each frame was where on its way from motion to picture, as CSV, a line per frame "
      "by the ticks of the server's --trace");
  app.add_flag("--own-camera", options.keeps_camera,
               "Let nobody else move this view (strandcast-ctl camera)");
  app.add_option("--renderer", options.drawing.renderer,
                 "What draws strands: tiles (the processor), gl, or auto: gl where the device is hardware")
      ->check(CLI::IsMember({"auto", "tiles", "gl"}))
      ->capture_default_str();
  app.add_option("--shader-dir", options.drawing.shader_folder, "Read shaders from this folder");
  app.add_option("--device", options.drawing.gl_device,
                 "GL device that draws strands: auto, software, hardware or a number")
      ->capture_default_str();
  app.add_option("--log", options.log_level, "error, warn, info, debug or off")->capture_default_str();
}

/// A file that cannot be written is better known before a long run than after it.
Status check_folder_of(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  std::error_code ignored;
  if (file.empty() || folder.empty() || std::filesystem::is_directory(folder, ignored)) return {};
  return at(file.string(), make_error(ErrorCode::BadInput, "there is no folder '{}'", folder.string()));
}

/// What goes with a recording, and what does not.
Status check_recording(const ViewOptions& options) {
  if (!options.film.empty()) {
    if (options.recording.empty())
      return make_error(ErrorCode::BadInput,
                        "--export draws a recording: name it (strandcast-view run.mcap --export {})",
                        options.film.string());
    if (options.film_to_s && options.seconds)
      return make_error(ErrorCode::BadInput, "--to and --seconds both say where it ends: give one of them");
    if (options.film_to_s && *options.film_to_s < options.film_from_s)
      return make_error(ErrorCode::BadInput, "--to {:g} is before --from {:g}", *options.film_to_s,
                        options.film_from_s);
    return check_film_path(options.film);
  }
  if (options.film_to_s || options.film_from_s > 0.0)
    return make_error(ErrorCode::BadInput, "--from and --to say which part of a recording --export draws");
  if (options.recording.empty()) return {};
  if (!options.trace.empty())
    return make_error(ErrorCode::BadInput, "--trace is of frames that a server sends: a recording has none");
  if (options.is_headless || !options.screenshot.empty() || !options.clip.empty())
    return make_error(
        ErrorCode::BadInput,
        "a recording without a window is drawn by --export FILE; a server is named by --connect");
  return {};
}

Result<ViewOptions> complete(const RawOptions& raw, ViewOptions options) {
  options.is_diagnosis = !raw.diagnose.empty();
  ASSIGN_OR_RETURN(options.address, parse_address(options.is_diagnosis ? raw.diagnose : raw.connect));
  options.address.is_tls = options.address.is_tls || raw.is_tls || !options.tls_authorities.empty();
  ASSIGN_OR_RETURN(options.mode, parse_mode(raw.mode));
  ASSIGN_OR_RETURN(options.size, parse_size(raw.size));
  ASSIGN_OR_RETURN(options.clip_size, parse_size(raw.clip_size.empty() ? raw.size : raw.clip_size));
  if (!raw.token_file.empty()) {
    ASSIGN_OR_RETURN(options.token, load_token(raw.token_file, role_of(options)));
  }
  if (raw.seconds > 0.0) options.seconds = raw.seconds;
  for (const PictureCodec codec : kPictureCodecs)
    if (raw.pictures == to_string(codec)) options.picture_codecs = codec_bit(codec);
  if ((options.picture_codecs & decodable_picture_codecs()) == 0)
    return make_error(ErrorCode::Unsupported,
                      "this build cannot show --pictures {} (docs/use/try-it.md says how to build it in)",
                      raw.pictures);
  if (raw.codec != kAnyCodec) {
    RETURN_IF_ERROR(strand_codec_info(raw.codec));
    options.codec_wish = raw.codec;
  }
  if (raw.playout == "smooth") options.playout = Playout::Smooth;
  RETURN_IF_ERROR(check_recording(options));
  if (!options.is_headless && !(options.screenshot.empty() && options.clip.empty()))
    return make_error(ErrorCode::BadInput,
                      "--screenshot and --clip need --headless (in the window, S takes a picture)");
  for (const auto* file : {&options.screenshot, &options.clip, &options.report, &options.trace})
    RETURN_IF_ERROR(check_folder_of(*file));
  const auto is_named = [](const std::filesystem::path& file, const char* ending) {
    return file.empty() || file.extension() == ending;
  };
  if (!is_named(options.screenshot, ".png"))
    return make_error(ErrorCode::BadInput, "--screenshot {}: it writes a .png", options.screenshot.string());
  if (!is_named(options.clip, ".webp"))
    return make_error(ErrorCode::BadInput, "--clip {}: it writes a .webp", options.clip.string());
  return options;
}

}  // namespace

ViewCommandLine read_view_command_line(int argc, const char* const* argv) {
  CLI::App app("Strandcast viewer: shows the hair of a running strandcast-server, or of a recording.",
               "strandcast-view");
  app.set_version_flag("--version", fmt::format("strandcast-view {}", version()));
  app.failure_message(command_line_failure<CLI::App, CLI::Error>);
  RawOptions raw;
  ViewOptions options;
  declare(app, raw, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& stop) {
    return {std::nullopt, app.exit(stop) == 0 ? 0 : 2};
  }
  auto completed = complete(raw, std::move(options));
  if (!completed) {
    std::cerr << "strandcast-view: " << completed.error().to_string() << '\n';
    return {std::nullopt, 2};
  }
  return {std::move(completed).value(), 0};
}

}  // namespace strandcast
