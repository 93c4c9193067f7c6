#include "common/log/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "common/base/profile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

// On a terminal the line is rewritten; in a log one line in a few seconds is enough.
constexpr int64_t kTerminalIntervalNs = 100'000'000;
constexpr int64_t kLogIntervalNs = 5'000'000'000;

}  // namespace

Progress::Progress(Options options)
    : options_(std::move(options)), is_terminal_(isatty(STDERR_FILENO) == 1), begin_ns_(now_ns()) {}

Progress::~Progress() {
  if (is_terminal_ && width_ > 0) fmt::print(stderr, "\r{:{}}\r", "", width_);
}

void Progress::expect(uint32_t runs, double cost) {
  run_count_ += runs;
  expected_cost_ += cost;
}

void Progress::begin_run(std::string_view name) {
  ++run_index_;
  const int64_t interval_ns = is_terminal_ ? kTerminalIntervalNs : kLogIntervalNs;
  if (options_.is_quiet || now_ns() - printed_ns_ < interval_ns) return;
  printed_ns_ = now_ns();
  print(name);
}

void Progress::end_run(double cost) {
  done_cost_ += cost;
}

double Progress::seconds_left() const {
  if (done_cost_ <= 0.0) return std::numeric_limits<double>::quiet_NaN();
  const double passed_s = static_cast<double>(now_ns() - begin_ns_) / kNsPerS;
  return passed_s / done_cost_ * std::max(0.0, expected_cost_ - done_cost_);
}

void Progress::print(std::string_view name) {
  const double left_s = seconds_left();
  const std::string left = std::isnan(left_s) ? "" : fmt::format(", about {:.0f} s left", left_s);
  const std::string of = run_count_ > 0 ? fmt::format(" of {}", run_count_) : "";
  const std::string line =
      fmt::format("{}: {} {}{}{}: {}", options_.what, options_.run_name, run_index_, of, left, name);
  if (is_terminal_) {
    fmt::print(stderr, "\r{:{}}", line, width_);
  } else {
    fmt::print(stderr, "{}\n", line);
  }
  std::fflush(stderr);
  width_ = std::max(is_terminal_ ? width_ : 0, line.size());
}

}  // namespace strandcast
