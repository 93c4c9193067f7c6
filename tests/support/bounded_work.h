// Work in a process of its own, which has only so much memory and processor time: how tests see that no file
// costs more. What else runs on the machine makes no difference.
#pragma once

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

namespace strandcast::test {

struct WorkBounds {
  uint64_t bytes =
      1'000'000'000;  // beyond what this process has; sanitizers, which map terabytes, check none
  uint64_t processor_s = 5;
};

namespace bounded_work {

inline void limit(int resource, uint64_t most) {
  const rlimit both{most, most};
  if (setrlimit(static_cast<__rlimit_resource>(resource), &both) != 0) _exit(EXIT_FAILURE);
}

inline uint64_t mapped_bytes() {
  uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace bounded_work

/// Returns how the work broke its bounds; empty when it returned. It must not wait for other threads.
template <class Work>
std::string beyond_bounds(const Work& work, const WorkBounds& bounds = {}) {
  const pid_t child = fork();
  if (child < 0) return "no process can be made";
  if (child == 0) {
    bounded_work::limit(RLIMIT_CORE, 0);
    bounded_work::limit(RLIMIT_CPU, bounds.processor_s);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    bounded_work::limit(RLIMIT_AS, bounded_work::mapped_bytes() + bounds.bytes);
#endif
    [&]() noexcept { work(); }();  // nothing leaves this process, as an exception would for the next test
    _exit(EXIT_SUCCESS);
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return "its process is lost";
  if (WIFEXITED(status) && WEXITSTATUS(status) == EXIT_SUCCESS) return {};
  if (WIFEXITED(status)) return fmt::format("it ended with {}", WEXITSTATUS(status));
  if (WTERMSIG(status) == SIGKILL || WTERMSIG(status) == SIGXCPU)
    return fmt::format("it took more than {} s of processor time", bounds.processor_s);
  return fmt::format("it was ended by signal {}, as for more than {} bytes", WTERMSIG(status), bounds.bytes);
}

}  // namespace strandcast::test
