#include "client/app/stop_signal.h"

#include <csignal>

namespace strandcast {
namespace {

std::atomic<bool> is_stop_wanted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

void on_signal(int number) {
  if (is_stop_wanted.exchange(true)) {
    std::signal(number, SIG_DFL);
    std::raise(number);
  }
}

}  // namespace

const std::atomic<bool>& catch_stop_signals() {
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  return is_stop_wanted;
}

}  // namespace strandcast
