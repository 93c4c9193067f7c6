// Parses the command line of strandcast-server.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/client/address.h"
#include "server/app/mocap_option.h"
#include "server/app/server.h"
#include "server/record/replay.h"

namespace strandcast {

/// Another server whose stream this one relays.
struct UpstreamOptions {
  Address address;
  std::filesystem::path token_path;       // of the relay's own token; empty: none
  std::filesystem::path tls_authorities;  // empty: the system's
  std::string head;                       // of those there; empty: the first
};

struct ServerOptions {
  std::filesystem::path scene_path;  // empty: the built-in scene
  std::vector<std::string> overrides;
  MocapOptions mocap;
  std::filesystem::path token_path;  // empty: no tokens
  std::filesystem::path port_path;   // the chosen port is written here
  std::string log_level = "info";
  bool has_json_log = false;
  double run_s = 0.0;  // 0 = until a signal
  uint32_t explained_frame_viewers = 0;
  bool is_listing_solvers = false;
  bool is_explaining = false;
  bool is_printing_scene = false;
  bool is_checking = false;                      // --check: draw the scene as loaded and leave
  std::filesystem::path check_folder = "check";  // for its pictures
  std::filesystem::path replay_path;             // a recording to simulate again; empty: none
  ReplayPace replay_pace = ReplayPace::AsFastAsItGoes;
  std::optional<UpstreamOptions> upstream;  // a relay, no scene
  std::string help;                         // not empty: print and leave
  ServerConfig config;                      // all but scene and tokens
};

/// Parses the options. BadInput names the option; `help` is set for --help and --version.
Result<ServerOptions> parse_options(int argc, const char* const* argv);

/// Loads the scene and applies its overrides.
Result<ServerConfig> load_config(const ServerOptions& options);

}  // namespace strandcast
