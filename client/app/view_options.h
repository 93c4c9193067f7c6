// Command line of strandcast-view. Pure parsing; the only I/O is reading the token file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "common/client/viewer_client.h"
#include "common/render/render_device.h"
#include "common/replay/strand_replay.h"

namespace strandcast {

struct ViewOptions {
  Address address;
  std::filesystem::path recording;  // shown instead of a server; empty = none
  std::filesystem::path film;       // that a recording is drawn into, without a window; empty = none
  double film_fps = 30.0;
  double film_from_s = 0.0;         // after the first state
  std::optional<double> film_to_s;  // nothing: to the end
  StreamMode mode = StreamMode::Auto;
  Playout playout = Playout::LowLatency;
  std::filesystem::path tls_authorities;
  PictureCodecs picture_codecs = decodable_picture_codecs();  // in frames mode
  std::string codec_wish;                                     // of strands; empty = the server chooses
  std::string head;                                           // that alone is shown; empty = all
  std::string token;
  RenderSize size{960, 540};
  bool is_diagnosis = false;  // say what a session needs, and leave
  bool is_headless = false;
  bool keeps_camera = false;         // nobody else moves it
  bool is_view_only = false;         // ask for a viewer's role only; headless never asks for more
  std::filesystem::path screenshot;  // empty = none
  uint64_t after_frames = 60;        // the screenshot shows the state after this many decoded frames
  std::filesystem::path clip;        // empty = none
  double clip_s = 3.0;
  double clip_fps = 15.0;
  RenderSize clip_size{960, 540};
  std::optional<double> seconds;  // stop after this long
  std::filesystem::path report;   // empty = none
  std::filesystem::path trace;    // times of every frame; empty = none
  RenderDeviceConfig drawing;     // what draws strands
  std::string log_level = "warn";
};

/// Environment variable with the token. Command lines are visible to all users of a machine; a file or the
/// environment is private.
inline constexpr const char* kTokenVariable = "STRANDCAST_TOKEN";
inline constexpr const char* kTlsAuthoritiesHelp =
    "Certificates (PEM) that the server's must come from, instead of the system's; means --tls";
inline constexpr const char* kTokenHelp =
    "Token itself; other users of this machine can see it here, so prefer --token-file";

inline constexpr double kMaxClipS = 60.0;
inline constexpr double kMaxClipFps = 60.0;
inline constexpr uint32_t kMinViewSide = 16;

/// Result of reading a command line: options, or an exit code after help or an error was printed.
struct ViewCommandLine {
  std::optional<ViewOptions> options;
  int exit_code = 0;
};
ViewCommandLine read_view_command_line(int argc, const char* const* argv);

/// Parses a size such as "640x360" with sides from kMinViewSide to kMaxImageSide.
Result<RenderSize> parse_size(const std::string& text);
/// Parses "strands", "frames" or "auto".
Result<StreamMode> parse_mode(const std::string& text);

/// Returns the session's role: Viewer if the options rule out steering.
Role role_of(const ViewOptions& options);

/// Returns the connection settings for these options.
ClientConfig client_config(const ViewOptions& options);

}  // namespace strandcast
