// Limits of each address: connections, requests and wrong tokens (AddressGuard), and lines in the log
// (LogBudget), in tables of bounded size; and lines of each kind (RepeatBudget). Plain logic without a clock;
// one thread.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/net/access.h"

namespace strandcast {

struct GuardLimits {
  double connections_per_s = 10.0;  // and as many at once
  double requests_per_s = 50.0;     // on all of its connections, and as many at once
  uint32_t wrong_tokens = 5;        // in a window; one more blocks
  int64_t window_ns = 60'000'000'000;
  int64_t block_ns = 60'000'000'000;
  uint32_t addresses = 1'024;  // remembered at once
};

class AddressGuard {
 public:
  explicit AddressGuard(const GuardLimits& limits) : limits_(limits) {}

  /// Counts a connection; returns false if it exceeds the limit.
  bool take_connection(const std::string& address, int64_t time_ns);
  /// Counts an HTTP request; returns false if it exceeds the limit.
  bool take_request(const std::string& address, int64_t time_ns);
  /// Returns true while tokens of this address are not checked.
  bool is_blocked(const std::string& address, int64_t time_ns) const;
  void on_wrong_token(const std::string& address, int64_t time_ns);
  /// Bans an address until a time, at an admin's request.
  void ban(const std::string& address, int64_t time_ns, int64_t until_ns);
  bool is_banned(const std::string& address, int64_t time_ns) const;

  size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    explicit Entry(const GuardLimits& limits)
        : connections(limits.connections_per_s), requests(limits.requests_per_s) {}
    RateLimit connections;
    RateLimit requests;
    std::vector<int64_t> wrong_ns;  // times of wrong tokens, oldest first; limits_.wrong_tokens at most
    int64_t blocked_until_ns = 0;
    int64_t banned_until_ns = 0;
    int64_t seen_ns = 0;
  };
  Entry& entry(const std::string& address, int64_t time_ns);
  void make_room(int64_t time_ns);

  const GuardLimits limits_;
  std::map<std::string, Entry> entries_;
};

struct LogLimits {
  uint32_t lines_per_address = 10;  // in a window
  uint32_t lines = 300;
  int64_t window_ns = 60'000'000'000;
};

/// How many lines the doings of others may put into the log, of one address and of all.
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

struct RepeatLimits {
  uint32_t lines_per_kind = 4;  // in a window
  uint32_t lines = 20;
  int64_t window_ns = 10'000'000'000;
};

/// How many lines that come again and again go into the log: a few of each kind, then sums of them. The
/// caller's kinds are few.
class RepeatBudget {
 public:
  explicit RepeatBudget(const RepeatLimits& limits) : limits_(limits) {}

  /// The lines of a kind that were not written.
  struct Sum {
    std::string newest;
    uint64_t count = 0;
  };
  /// Returns whether a line is written; else it is counted.
  bool take(const std::string& kind, const std::string& line);
  /// Returns at the end of each window what was counted; call it now and then.
  std::vector<Sum> take_sums(int64_t time_ns);

 private:
  struct Kind {
    uint32_t lines = 0;  // written in this window
    Sum sum;
  };
  const RepeatLimits limits_;
  int64_t window_end_ns_ = 0;
  uint32_t lines_ = 0;  // written in this window
  std::map<std::string, Kind> kinds_;
};

}  // namespace strandcast
