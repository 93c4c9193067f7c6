// Functions compiled once for the plain processor and once for wider registers, chosen at run time. For code
// whose results are the same on every path: integers, or floats without contraction.
#pragma once

// Sanitizers start too late for the resolver that chooses; of the thread sanitizer only libstdc++'s macro is
// left (cmake/strandcast.cmake).
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(_GLIBCXX_TSAN) && \
    !defined(__SANITIZE_ADDRESS__)
#define STRANDCAST_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define STRANDCAST_WIDE
#endif
