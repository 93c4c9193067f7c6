#include "client/app/step_command.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/client/attempts.h"

namespace strandcast {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kPortionTime{500};
constexpr milliseconds kStopPoll{50};
constexpr uint32_t kMostGrowth = 4;

/// The answer to one portion; what the server says meanwhile about other things is let go by.
Result<Notice> await_steps(ViewerClient& client, const StepOptions& options, const std::atomic<bool>& stop) {
  const int64_t begin_ns = now_ns();
  while (!stop) {
    for (ClientEvent& event : client.wait(kStopPoll)) {
      if (const auto* closed = std::get_if<ClosedEvent>(&event)) return closed->error;
      auto* notice = std::get_if<Notice>(&event);
      if (notice == nullptr) continue;
      if (notice->is_error) return make_error(ErrorCode::BadInput, "{}", notice->text);
      if (notice->tick > 0) return std::move(*notice);
    }
    if (options.answer_limit && nanoseconds(now_ns() - begin_ns) > *options.answer_limit)
      return make_error(ErrorCode::Timeout, "the server did not answer within {} ms",
                        options.answer_limit->count());
  }
  return make_error(ErrorCode::Unavailable, "stopped");
}

}  // namespace

uint32_t next_portion(uint32_t portion, nanoseconds took) {
  const double step_ns = static_cast<double>(std::max<int64_t>(took.count(), 1)) / portion;
  const double wanted = static_cast<double>(nanoseconds(kPortionTime).count()) / step_ns;
  const double most = std::min<double>(kMostGrowth * static_cast<double>(portion), kMaxStepCount);
  return static_cast<uint32_t>(std::clamp(std::floor(wanted), 1.0, most));
}

Result<Notice> take_steps(ViewerClient& client, const StepOptions& options, const std::atomic<bool>& stop,
                          const StepListener& listener) {
  uint32_t done = 0;
  uint32_t portion = 1;
  const auto ended = [&](Error error, uint32_t under_way) {
    error.message += fmt::format(" ({} of {} steps are done{})", done, options.count,
                                 under_way > 0 ? fmt::format(", {} under way", under_way) : "");
    return error;
  };
  while (true) {
    portion = std::min(portion, options.count - done);
    const int64_t begin_ns = now_ns();
    if (const Status sent = client.send(ControlCommand{Command::StepOnce, portion}); !sent)
      return ended(sent.error(), 0);
    Result<Notice> answer = await_steps(client, options, stop);
    if (!answer) return ended(answer.error(), answer.error().code == ErrorCode::BadInput ? 0 : portion);
    done += portion;
    if (done == options.count) return answer;
    if (listener) listener(done);
    portion = next_portion(portion, nanoseconds(now_ns() - begin_ns));
  }
}

int run_step(const CtlTarget& target, uint32_t count, const std::atomic<bool>& stop) {
  auto config = client_config_for(target, Role::Controller);
  if (!config) return ctl_failure(config.error());
  config->hello.gets_no_stream = true;
  auto client = connect_patiently(*config);
  if (!client) return ctl_failure(client.error());
  bool has_shown = false;
  int64_t next_ns = now_ns() + nanoseconds(kPortionTime).count();
  const auto show = [&](uint32_t done) {
    if (now_ns() < next_ns) return;
    next_ns = now_ns() + nanoseconds(kPortionTime).count();
    has_shown = true;
    std::cerr << fmt::format("\r  {} of {} steps, {} %", done, count, uint64_t{100} * done / count)
              << std::flush;
  };
  const auto answer =
      take_steps(**client, {count}, stop, isatty(STDERR_FILENO) != 0 ? StepListener(show) : StepListener());
  if (has_shown) std::cerr << '\n';
  if (!answer) return ctl_failure(answer.error(), kRefusedExit);
  std::cout << fmt::format("{} steps done: at step {}.\n", count, answer->tick);
  return kDoneExit;
}

}  // namespace strandcast
