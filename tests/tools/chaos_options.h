// Command line of strandcast-chaos. Pure parsing.
#pragma once

#include <cstdint>
#include <string>

#include "common/chaos/chaos_relay.h"
#include "common/client/address.h"

namespace CLI {
class App;
}

namespace strandcast::chaos {

struct ChaosOptions {
  std::string listen = "127.0.0.1:7900";
  std::string to = "127.0.0.1:" + std::to_string(kDefaultPort);
  std::string direction = "both";
  std::string writes = "as-read";
  double delay_ms = 0.0, jitter_ms = 0.0, loss = 0.0, rate_mbit = 0.0, queue_kb = 128.0;
  double freeze_every_ms = 0.0, freeze_ms = 0.0, corrupt_per_mb = 0.0, reset_every_s = 0.0, seconds = 0.0;
  uint64_t reset_after_bytes = 0, silent_after_bytes = 0, seed = 1;
};

/// Adds the options to `app`, which stores pointers into `options`.
void declare_chaos(CLI::App& app, ChaosOptions& options);

/// Returns the relay that the options state. BadInput names an address that is none.
Result<RelayConfig> relay_config(const ChaosOptions& options);

}  // namespace strandcast::chaos
