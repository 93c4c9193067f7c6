// strandcast-chaos: puts a bad link between viewers and a server. Viewers connect to --listen instead of the
// server.
#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <iostream>
#include <thread>

#include "client/app/stop_signal.h"
#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/chaos/chaos_relay.h"
#include "common/client/address.h"

namespace {

using namespace strandcast;
using namespace strandcast::chaos;

constexpr double kMaxMs = 60'000.0;
constexpr double kBytesPerMbit = 125e3;

struct CommandLine {
  std::string listen = "127.0.0.1:7900";
  std::string to = "127.0.0.1:" + std::to_string(kDefaultPort);
  std::string direction = "both";
  std::string writes = "as-read";
  double delay_ms = 0.0, jitter_ms = 0.0, rate_mbit = 0.0, queue_kb = 128.0;
  double freeze_every_ms = 0.0, freeze_ms = 0.0, corrupt_per_mb = 0.0, reset_every_s = 0.0, seconds = 0.0;
  uint64_t reset_after_bytes = 0, silent_after_bytes = 0, seed = 1;
};

void declare(CLI::App& app, CommandLine& line) {
  const auto ms = CLI::Range(0.0, kMaxMs);
  app.add_option("--listen", line.listen, "HOST:PORT that viewers connect to")->capture_default_str();
  app.add_option("--to", line.to, "HOST:PORT of the server")->capture_default_str();
  app.add_option("--direction", line.direction, "Where the faults apply: up is to the server")
      ->check(CLI::IsMember({"both", "up", "down"}))
      ->capture_default_str();
  app.add_option("--delay-ms", line.delay_ms, "Delay of each direction")->check(ms);
  app.add_option("--jitter-ms", line.jitter_ms, "Up to this much more, order kept")->check(ms);
  app.add_option("--rate-mbit", line.rate_mbit, "Rate of each direction, 0 = unlimited")
      ->check(CLI::Range(0.0, 1e5));
  app.add_option("--queue-kb", line.queue_kb, "Bytes that may wait for the rate")
      ->check(CLI::Range(1.5, 8e3));
  app.add_option("--freeze-every-ms", line.freeze_every_ms, "Period of freezes, 0 = none")->check(ms);
  app.add_option("--freeze-ms", line.freeze_ms, "Length of a freeze")->check(ms);
  app.add_option("--reset-every", line.reset_every_s,
                 "Reset all connections every so many seconds, 0 = never")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--reset-after-bytes", line.reset_after_bytes,
                 "Reset a connection after so many bytes, 0 = never");
  app.add_option("--silent-after-bytes", line.silent_after_bytes,
                 "Swallow everything after so many bytes (half-open), 0 = never");
  app.add_option("--corrupt-per-mb", line.corrupt_per_mb, "Wrong bits per million bytes")
      ->check(CLI::Range(0.0, 5e5));
  app.add_option("--writes", line.writes, "How bytes leave")
      ->check(CLI::IsMember({"as-read", "one-byte", "split", "merged"}))
      ->capture_default_str();
  app.add_option("--seed", line.seed, "Seed of corruption, cuts and jitter")->capture_default_str();
  app.add_option("--seconds", line.seconds, "Stop after this long, 0 = until Ctrl-C")
      ->check(CLI::Range(0.0, 1e6));
}

LinkPlan plan_of(const CommandLine& line) {
  LinkPlan plan;
  plan.delay_us = static_cast<int64_t>(line.delay_ms * kUsPerMs);
  plan.jitter_us = static_cast<int64_t>(line.jitter_ms * kUsPerMs);
  plan.bytes_per_s = static_cast<uint64_t>(line.rate_mbit * kBytesPerMbit);
  plan.queue_bytes = static_cast<size_t>(line.queue_kb * 1e3);
  plan.freeze_every_us = static_cast<int64_t>(line.freeze_every_ms * kUsPerMs);
  plan.freeze_us = static_cast<int64_t>(line.freeze_ms * kUsPerMs);
  plan.reset_after_bytes = line.reset_after_bytes;
  plan.silent_after_bytes = line.silent_after_bytes;
  plan.corrupt_per_byte = line.corrupt_per_mb * 1e-6;
  plan.writes = line.writes == "one-byte" ? Writes::OneByte
                : line.writes == "split"  ? Writes::Split
                : line.writes == "merged" ? Writes::Merged
                                          : Writes::AsRead;
  return plan;
}

Status run(const CommandLine& line) {
  // Port 0, any free one, is no address for a viewer and so not for parse_address.
  const bool takes_free_port = line.listen.ends_with(":0");
  const std::string listen_host = line.listen.substr(0, line.listen.size() - (takes_free_port ? 2 : 0));
  ASSIGN_OR_RETURN(Address listen, parse_address(takes_free_port ? listen_host : line.listen));
  if (takes_free_port) listen.port = 0;
  ASSIGN_OR_RETURN(const Address to, parse_address(line.to));
  RelayConfig config{listen.host, listen.port, to.host, to.port, {}, {}, line.seed};
  if (line.direction != "down") config.up = plan_of(line);
  if (line.direction != "up") config.down = plan_of(line);
  ASSIGN_OR_RETURN(const auto relay, ChaosRelay::start(config));
  std::cout << fmt::format("relaying {}:{} to {}", listen.host, relay->port(), to.to_string()) << std::endl;

  const std::atomic<bool>& stop = catch_stop_signals();
  const int64_t begin_ns = now_ns();
  int64_t reset_ns = begin_ns;
  const auto seconds_since = [](int64_t time_ns) { return static_cast<double>(now_ns() - time_ns) * 1e-9; };
  while (!stop && (line.seconds == 0.0 || seconds_since(begin_ns) < line.seconds)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    if (line.reset_every_s == 0.0 || seconds_since(reset_ns) < line.reset_every_s) continue;
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
  CommandLine line;
  declare(app, line);
  CLI11_PARSE(app, argc, argv);
  if (const Status status = run(line); !status) {
    std::cerr << "strandcast-chaos: " << status.error().to_string() << '\n';
    return 2;
  }
  return 0;
}
