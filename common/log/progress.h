// Progress: shows on the terminal which run is under way, of how many, and the remaining time. One thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace strandcast {

class Progress {
 public:
  /// `what` is the command's name; nothing is printed when `is_quiet`.
  struct Options {
    std::string what;
    bool is_quiet = false;
    std::string run_name = "run";  // what one is called
  };
  explicit Progress(Options options);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Adds future work: a number of runs and their total cost, in any unit that is used throughout.
  void expect(uint32_t runs, double cost);
  /// Marks the beginning of the next run; prints to standard error at most ten times a second.
  void begin_run(std::string_view name);
  /// Marks the end of the current run, which had this cost.
  void end_run(double cost);
  /// Estimates the seconds until all expected work is done from the pace so far; NaN before the first
  /// end_run().
  double seconds_left() const;

 private:
  void print(std::string_view name);

  Options options_;
  bool is_terminal_;
  int64_t begin_ns_;
  int64_t printed_ns_ = 0;
  uint32_t run_count_ = 0;
  uint32_t run_index_ = 0;
  double expected_cost_ = 0.0;
  double done_cost_ = 0.0;
  size_t width_ = 0;  // of the line on the terminal
};

}  // namespace strandcast
