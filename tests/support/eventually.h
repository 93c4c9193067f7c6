// Waits for something that another thread does. The limit only ends a hanging test; it decides nothing else.
#pragma once

#include <chrono>
#include <thread>

namespace strandcast {

template <class Condition>
bool eventually(Condition condition) {
  constexpr auto kLimit = std::chrono::seconds(60);
  const auto end = std::chrono::steady_clock::now() + kLimit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// Long enough for another thread to do what it should not; a slow machine can only hide a failure.
inline void give_time_to_misbehave() {
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
}

}  // namespace strandcast
