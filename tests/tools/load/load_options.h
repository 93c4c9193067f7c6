// Command line of strandcast-load. Pure parsing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/client/address.h"

namespace CLI {
class App;
}

namespace strandcast::load {

struct LoadOptions {
  std::string connect = "127.0.0.1:" + std::to_string(kDefaultPort);
  std::string token;
  std::filesystem::path token_file;
  bool is_tls = false;
  std::filesystem::path tls_authorities;
  uint32_t viewers = 16, frame_viewers = 0, silent_viewers = 0, stalled_viewers = 0;
  double seconds = 10.0, warm_up_s = 2.0;
  int64_t churn_ms = 0;
  int server_pid = 0;
};

/// Adds the options to `app`, which stores pointers into `options`.
void declare_load(CLI::App& app, LoadOptions& options);

}  // namespace strandcast::load
