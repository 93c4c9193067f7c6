#include "tests/tools/chaos_options.h"

#include <CLI/CLI.hpp>

#include "common/base/command_line_error.h"
#include "common/base/units.h"

namespace strandcast::chaos {
namespace {

constexpr double kMaxMs = 60'000.0;
constexpr double kBytesPerMbit = 125e3;

LinkPlan plan_of(const ChaosOptions& options) {
  LinkPlan plan;
  plan.delay_us = static_cast<int64_t>(options.delay_ms * kUsPerMs);
  plan.jitter_us = static_cast<int64_t>(options.jitter_ms * kUsPerMs);
  plan.loss = options.loss;
  plan.bytes_per_s = static_cast<uint64_t>(options.rate_mbit * kBytesPerMbit);
  plan.queue_bytes = static_cast<size_t>(options.queue_kb * 1e3);
  plan.freeze_every_us = static_cast<int64_t>(options.freeze_every_ms * kUsPerMs);
  plan.freeze_us = static_cast<int64_t>(options.freeze_ms * kUsPerMs);
  plan.reset_after_bytes = options.reset_after_bytes;
  plan.silent_after_bytes = options.silent_after_bytes;
  plan.corrupt_per_byte = options.corrupt_per_mb * 1e-6;
  plan.writes = options.writes == "one-byte" ? Writes::OneByte
                : options.writes == "split"  ? Writes::Split
                : options.writes == "merged" ? Writes::Merged
                                             : Writes::AsRead;
  return plan;
}

}  // namespace

void declare_chaos(CLI::App& app, ChaosOptions& options) {
  const auto ms = without_nan(CLI::Range(0.0, kMaxMs));
  app.add_option("--listen", options.listen, "HOST:PORT that viewers connect to")->capture_default_str();
  app.add_option("--to", options.to, "HOST:PORT of the server")->capture_default_str();
  app.add_option("--direction", options.direction, "Where the faults apply: up is to the server")
      ->check(CLI::IsMember({"both", "up", "down"}))
      ->capture_default_str();
  app.add_option("--delay-ms", options.delay_ms, "Delay of each direction")->check(ms);
  app.add_option("--jitter-ms", options.jitter_ms, "Up to this much more, order kept")->check(ms);
  app.add_option("--loss", options.loss,
                 "Share of packets that TCP has to send again, with those behind waiting")
      ->check(without_nan(CLI::Range(0.0, 0.5)));
  app.add_option("--rate-mbit", options.rate_mbit, "Rate of each direction, 0 = unlimited")
      ->check(without_nan(CLI::Range(0.0, 1e5)));
  app.add_option("--queue-kb", options.queue_kb, "Bytes that may wait for the rate")
      ->check(without_nan(CLI::Range(1.5, 8e3)));
  app.add_option("--freeze-every-ms", options.freeze_every_ms, "Period of freezes, 0 = none")->check(ms);
  app.add_option("--freeze-ms", options.freeze_ms, "Length of a freeze")->check(ms);
  app.add_option("--reset-every", options.reset_every_s,
                 "Reset all connections every so many seconds, 0 = never")
      ->check(without_nan(CLI::Range(0.0, 1e6)));
  app.add_option("--reset-after-bytes", options.reset_after_bytes,
                 "Reset a connection after so many bytes, 0 = never");
  app.add_option("--silent-after-bytes", options.silent_after_bytes,
                 "Swallow everything after so many bytes (half-open), 0 = never");
  app.add_option("--corrupt-per-mb", options.corrupt_per_mb, "Wrong bits per million bytes")
      ->check(without_nan(CLI::Range(0.0, 5e5)));
  app.add_option("--writes", options.writes, "How bytes leave")
      ->check(CLI::IsMember({"as-read", "one-byte", "split", "merged"}))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "Seed of corruption, cuts, loss and jitter")->capture_default_str();
  app.add_option("--seconds", options.seconds, "Stop after this long, 0 = until Ctrl-C")
      ->check(without_nan(CLI::Range(0.0, 1e6)));
}

Result<RelayConfig> relay_config(const ChaosOptions& options) {
  // Port 0, any free one, is no address for a viewer and so not for parse_address.
  const bool takes_free_port = options.listen.ends_with(":0");
  const std::string listen_host = options.listen.substr(0, options.listen.size() - (takes_free_port ? 2 : 0));
  ASSIGN_OR_RETURN(Address listen, parse_address(takes_free_port ? listen_host : options.listen));
  if (takes_free_port) listen.port = 0;
  ASSIGN_OR_RETURN(const Address to, parse_address(options.to));
  RelayConfig config{listen.host, listen.port, to.host, to.port, {}, {}, options.seed};
  if (options.direction != "down") config.up = plan_of(options);
  if (options.direction != "up") config.down = plan_of(options);
  return config;
}

}  // namespace strandcast::chaos
