// CHECK(condition): stops the process on a broken invariant of our own code, never on bad input.
#pragma once

namespace strandcast {

/// Prints the failed condition with its file and line, then aborts the process.
[[noreturn]] void check_failed(const char* condition, const char* file, int line);

}  // namespace strandcast

#define CHECK(condition) \
  ((condition) ? static_cast<void>(0) : ::strandcast::check_failed(#condition, __FILE__, __LINE__))
