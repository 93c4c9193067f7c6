// Progress: tells a person at the terminal which run of how many is under way and how long the rest will
// take. One thread.
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

  /// Adds work to come, in any unit of cost in which all of it is measured.
  void expect(uint32_t runs, double cost);
  /// The next run begins; prints at most ten times a second, to standard error.
  void begin_run(std::string_view name);
  /// The run under way is over and had this cost.
  void end_run(double cost);
  /// Seconds until all that is expected is done, from the pace so far; NaN before the first end_run().
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
