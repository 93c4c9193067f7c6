// LogBudget: how many lines the doings of others may put into the log, of one address and of all. Plain logic
// without a clock; one thread.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace strandcast {

struct LogLimits {
  uint32_t lines_per_address = 10;  // in a window
  uint32_t lines = 300;
  int64_t window_ns = 60'000'000'000;
};

class LogBudget {
 public:
  explicit LogBudget(const LogLimits& limits) : limits_(limits) {}

  struct Verdict {
    bool is_written = false;
    uint64_t left_out = 0;  // of the window before; told once
  };
  Verdict take(const std::string& address, int64_t time_ns);

  /// Addresses remembered; as many as there are lines in a window at most.
  size_t size() const { return lines_of_.size(); }

 private:
  const LogLimits limits_;
  int64_t window_end_ns_ = 0;
  uint32_t lines_ = 0;  // written in this window
  uint64_t left_out_ = 0;
  std::map<std::string, uint32_t> lines_of_;
};

}  // namespace strandcast
