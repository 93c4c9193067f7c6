#include "client/app/stop_signal.h"

#include <time.h>
#include <unistd.h>

#include <csignal>

namespace strandcast {
namespace {

std::atomic<bool> is_stop_wanted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

volatile std::sig_atomic_t first_signal = 0;

static_assert(kStopGrace < std::chrono::seconds(1), "nanoseconds of one second");
timer_t grace_timer;
bool has_grace_timer = false;

// Async-signal-safe calls only.
void end_by(int number) {
  std::signal(number, SIG_DFL);
  std::raise(number);
}

void on_signal(int number) {
  if (is_stop_wanted.exchange(true)) return end_by(number);
  first_signal = number;
  itimerspec end{};
  end.it_value.tv_nsec = std::chrono::nanoseconds(kStopGrace).count();
  if (has_grace_timer) timer_settime(grace_timer, 0, &end, nullptr);
}

void on_alarm(int) {
  constexpr char kSentence[] = "stopped in the middle of something that takes long\n";
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, kSentence, sizeof kSentence - 1);
  end_by(first_signal);
}

}  // namespace

const std::atomic<bool>& catch_stop_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  std::signal(SIGALRM, on_alarm);
  // Its default is SIGALRM. Without one there is the second signal still.
  has_grace_timer = has_grace_timer || timer_create(CLOCK_MONOTONIC, nullptr, &grace_timer) == 0;
  return is_stop_wanted;
}

int stopped_exit_code() {
  constexpr int kBySignal = 128;
  return kBySignal + (first_signal != 0 ? first_signal : SIGINT);
}

}  // namespace strandcast
