// World: threads, clocks and waiting of a simulated run. Whoever includes nothing of this still lives in it:
// the program's own pthread_*, clock_gettime, socket and so on (world_calls.cpp, net_calls.cpp) lead here.
// One thread runs at a time, the seed says which; time goes on only when nobody can run. Whoever runs owns
// all of it.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace strandcast::vopr {

/// A machine with clocks and an address of its own; threads are on that of whoever started them.
using NodeId = uint32_t;
inline constexpr NodeId kFate = 0;  // where faults are decided, and where main() runs

inline constexpr int64_t kNever = std::numeric_limits<int64_t>::max();
inline constexpr int64_t kUs = 1'000;
inline constexpr int64_t kMs = 1'000'000;
inline constexpr int64_t kS = 1'000'000'000;

/// PCG32 (O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms",
/// XSH-RR).
class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed * 2 + 1) { next(), next(); }
  uint32_t next();
  /// Below `end`.
  uint32_t below(uint32_t end) { return static_cast<uint32_t>((uint64_t{next()} * end) >> 32); }
  /// From `low` to `high`.
  int64_t between(int64_t low, int64_t high);
  bool one_in(uint32_t count) { return below(count) == 0; }

 private:
  uint64_t state_;
};

namespace world {

/// Before any thread is started.
void begin(uint64_t seed);
/// Nanoseconds of no machine's clock, and how often threads took turns.
int64_t time_ns();
uint64_t switch_count();
Random& random();

NodeId node();
/// The calling thread, and those that it starts, are on this machine from here on.
void set_node(NodeId node);
/// Threads of a machine that stands still do not run.
void stand_still(NodeId node);
void go_on(NodeId node);
/// A machine's clocks: they begin elsewhere, and run faster by so many parts in a million.
void set_clock(NodeId node, int64_t begin_ns, int64_t drift_ppm);
/// The time of day of a machine jumps.
void jump(NodeId node, int64_t by_ns);
int64_t monotonic_ns(NodeId node);
int64_t time_of_day_ns(NodeId node);
/// When a machine's monotonic clock, or its time of day, says so.
int64_t when_monotonic(NodeId node, int64_t clock_ns);
int64_t when_time_of_day(NodeId node, int64_t clock_ns);

/// Calls it at that time, while no thread runs.
void at(int64_t time_ns, std::function<void()> work);
/// Lets others run until somebody wakes `object`, or until that time. False: nobody has.
bool wait(const void* object, int64_t until_ns);
void wake_one(const void* object);
void wake_all(const void* object);
/// Others have their turn, now and then.
void maybe_yield();
void sleep_until(int64_t time_ns);

/// Keeps a line for who looks for the reason of a failure, with the time; it counts for digest().
void note(const std::string& line);
/// The newest lines, oldest first.
std::string newest_notes();
/// Of all lines so far: equal for the same seed.
uint64_t digest();
/// Ends the process: prints why, and the newest lines.
[[noreturn]] void fail(const std::string& why);
void set_failure_title(std::string title);

}  // namespace world
}  // namespace strandcast::vopr
