// strandcast-ctl step N: runs simulation steps on a server that is paused or in lockstep, however long they
// take.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>

#include "client/app/ctl_commands.h"
#include "common/client/viewer_client.h"

namespace strandcast {

struct StepOptions {
  uint32_t count = 1;
  /// Longest time to wait for an answer; none: as long as the connection lasts.
  std::optional<std::chrono::milliseconds> answer_limit = {};
};

/// Receives the number of finished steps, after each portion but the last.
using StepListener = std::function<void(uint32_t done)>;

/// Returns how many steps to request after `portion` steps took this long. Aims at half a second, so that
/// progress is visible and a stop is obeyed; at most four times the last portion.
uint32_t next_portion(uint32_t portion, std::chrono::nanoseconds took);

/// Makes the server run `options.count` steps in portions and returns its last notice. Errors say how many
/// steps are done: Refused by the server, Unavailable if `stop` was set or the connection ended, Timeout
/// beyond the limit. The current portion is finished in any case.
Result<Notice> take_steps(ViewerClient& client, const StepOptions& options, const std::atomic<bool>& stop,
                          const StepListener& listener);

/// Runs take_steps() for the command line and shows its progress on standard error if that is a terminal.
int run_step(const CtlTarget& target, uint32_t count, const std::atomic<bool>& stop);

}  // namespace strandcast
