// strandcast-chaos: puts a bad link between viewers and a server. Viewers connect to --listen instead of the
// server.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <iostream>
#include <thread>

#include "client/app/stop_signal.h"
#include "common/base/profile.h"
#include "tests/tools/chaos_options.h"

namespace {

using namespace strandcast;
using namespace strandcast::chaos;

Status run(const ChaosOptions& options) {
  ASSIGN_OR_RETURN(const RelayConfig config, relay_config(options));
  ASSIGN_OR_RETURN(const auto relay, ChaosRelay::start(config));
  std::cout << fmt::format("relaying {}:{} to {}", config.listen_host, relay->port(),
                           Address{config.to_host, config.to_port}.to_string())
            << std::endl;

  const std::atomic<bool>& stop = catch_stop_signals();
  const int64_t begin_ns = now_ns();
  int64_t reset_ns = begin_ns;
  const auto seconds_since = [](int64_t time_ns) { return static_cast<double>(now_ns() - time_ns) * 1e-9; };
  while (!stop && (options.seconds == 0.0 || seconds_since(begin_ns) < options.seconds)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (options.reset_every_s == 0.0 || seconds_since(reset_ns) < options.reset_every_s) continue;
    relay->reset_all();
    reset_ns = now_ns();
  }
  const RelayCounters counters = relay->counters();
  std::cout << fmt::format(
                   "connections={} refused={} resets={} up_bytes={} down_bytes={} up_corrupted={} "
                   "down_corrupted={} "
                   "up_swallowed={} down_swallowed={} most_queued_bytes={}",
                   counters.connections, counters.refused, counters.resets, counters.bytes[0],
                   counters.bytes[1], counters.corrupted_bytes[0], counters.corrupted_bytes[1],
                   counters.swallowed_bytes[0], counters.swallowed_bytes[1], counters.most_queued_bytes)
            << std::endl;
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGPIPE, SIG_IGN);  // whoever read what is printed may have gone
  CLI::App app("Strandcast chaos: relays TCP connections to a server over a link that is bad on purpose.",
               "strandcast-chaos");
  ChaosOptions options;
  declare_chaos(app, options);
  CLI11_PARSE(app, argc, argv);
  if (const Status status = run(options); !status) {
    std::cerr << "strandcast-chaos: " << status.error().to_string() << '\n';
    return 2;
  }
  return 0;
}
