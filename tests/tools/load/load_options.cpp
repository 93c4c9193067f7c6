#include "tests/tools/load/load_options.h"

#include <CLI/CLI.hpp>

#include "client/app/view_options.h"
#include "common/base/command_line_error.h"

namespace strandcast::load {

void declare_load(CLI::App& app, LoadOptions& options) {
  app.add_option("--connect", options.connect, "HOST:PORT of the server, numeric; wss://HOST:PORT for TLS")
      ->capture_default_str();
  app.add_option("--token", options.token, kTokenHelp)->envname(kTokenVariable);
  app.add_option("--token-file", options.token_file, "File with the token");
  app.add_flag("--tls", options.is_tls, "Encrypt the connections, as an address with wss:// does");
  app.add_option("--tls-ca", options.tls_authorities, kTlsAuthoritiesHelp);
  app.add_option("--viewers", options.viewers, "Viewers of strands that acknowledge")->capture_default_str();
  app.add_option("--frame-viewers", options.frame_viewers, "Viewers of the server's pictures besides");
  app.add_option("--silent-viewers", options.silent_viewers,
                 "Viewers of strands that never acknowledge, besides");
  app.add_option("--stalled-viewers", options.stalled_viewers,
                 "Viewers that join and never read again, besides");
  app.add_option("--seconds", options.seconds, "How long to measure")
      ->check(without_nan(CLI::Range(0.1, 1e6)))
      ->capture_default_str();
  app.add_option("--warm-up", options.warm_up_s, "Seconds before that")
      ->check(without_nan(CLI::Range(0.0, 1e3)))
      ->capture_default_str();
  app.add_option("--churn-ms", options.churn_ms,
                 "The oldest viewer leaves and a new one joins this often, 0 = never")
      ->check(CLI::Range(0, 100'000));
  app.add_option("--server-pid", options.server_pid, "Watch memory and file descriptors of this process");
}

}  // namespace strandcast::load
