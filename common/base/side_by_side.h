// Work in parts that know nothing of each other, on as many threads as there are processors.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace strandcast {

/// Whether work is worth more than the calling thread.
enum class Threads { One, All };

/// work(part) for all parts below `count`, each once, in any order.
template <class Work>
void for_each_part(uint32_t count, Threads threads, Work work) {
  const uint32_t most = threads == Threads::All ? std::max(1u, std::thread::hardware_concurrency()) : 1;
  std::atomic<uint32_t> next{0};
  const auto run = [&] {
    for (uint32_t part = next++; part < count; part = next++) work(part);
  };
  std::vector<std::jthread> helpers;
  for (uint32_t i = 1; i < std::min(count, most); ++i) helpers.emplace_back(run);
  run();
}

}  // namespace strandcast
