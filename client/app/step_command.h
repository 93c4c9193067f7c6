// strandcast-ctl step N: simulation steps of a paused server, or of one in lockstep, however long they take.
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
  /// How long the server may take to answer; none: as long as the connection lasts.
  std::optional<std::chrono::milliseconds> answer_limit = {};
};

/// Told how many steps are done, after each portion but the last.
using StepListener = std::function<void(uint32_t done)>;

/// How many steps to ask for after `portion` steps that took this long: about a half second's worth, so that
/// progress is seen and a stop is obeyed; at most four times as many.
uint32_t next_portion(uint32_t portion, std::chrono::nanoseconds took);

/// Has the server take `options.count` steps, portion by portion; what it said at last. Refused when it says
/// no, Unavailable when `stop` was set or the connection ended, Timeout beyond the limit: each with how many
/// were done. Steps of the portion under way are taken nevertheless.
Result<Notice> take_steps(ViewerClient& client, const StepOptions& options, const std::atomic<bool>& stop,
                          const StepListener& listener);

/// The same for the command line; says on standard error how far it is, where that is a terminal.
int run_step(const CtlTarget& target, uint32_t count, const std::atomic<bool>& stop);

}  // namespace strandcast
