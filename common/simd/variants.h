// Compiles one kernel for several instruction sets and chooses one at run time. After an always-inline
// function `name_lanes(const Arguments&)`, STRANDCAST_KERNEL(name, Arguments) defines `name(InstructionSet,
// const Arguments&)`. All variants give the same bits (common/simd/lanes.h). Mark lambdas in kernels with
// STRANDCAST_LANES_LAMBDA, or they are not compiled for the instruction set.
#pragma once

#include <span>

#include "common/simd/lanes.h"

namespace strandcast::simd {

/// Instruction sets from the narrowest to the widest. Plain is the baseline of the architecture (SSE2, NEON).
enum class InstructionSet { Plain, Sse4, Avx2, Avx512 };

const char* to_string(InstructionSet set);
/// Returns the sets that this processor supports, the widest last.
std::span<const InstructionSet> instruction_sets();
inline InstructionSet widest_set() {
  return instruction_sets().back();
}

// Under sanitizers one is enough: each takes minutes to compile there.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(_GLIBCXX_TSAN)
#define STRANDCAST_HAS_SETS 1
#else
#define STRANDCAST_HAS_SETS 0
#endif

#if STRANDCAST_HAS_SETS
#define STRANDCAST_KERNEL(name, Arguments)                                                          \
  __attribute__((flatten)) static void name##_plain(const Arguments& arguments) {                   \
    name##_lanes(arguments);                                                                        \
  }                                                                                                 \
  __attribute__((flatten, target("sse4.2"))) static void name##_sse4(const Arguments& arguments) {  \
    name##_lanes(arguments);                                                                        \
  }                                                                                                 \
  __attribute__((flatten, target("avx2"))) static void name##_avx2(const Arguments& arguments) {    \
    name##_lanes(arguments);                                                                        \
  }                                                                                                 \
  __attribute__((flatten, target("avx512f,avx512vl,avx512dq,avx512bw"))) static void name##_avx512( \
      const Arguments& arguments) {                                                                 \
    name##_lanes(arguments);                                                                        \
  }                                                                                                 \
  void name(::strandcast::simd::InstructionSet set, const Arguments& arguments) {                   \
    switch (set) {                                                                                  \
      case ::strandcast::simd::InstructionSet::Plain:                                               \
        return name##_plain(arguments);                                                             \
      case ::strandcast::simd::InstructionSet::Sse4:                                                \
        return name##_sse4(arguments);                                                              \
      case ::strandcast::simd::InstructionSet::Avx2:                                                \
        return name##_avx2(arguments);                                                              \
      case ::strandcast::simd::InstructionSet::Avx512:                                              \
        return name##_avx512(arguments);                                                            \
    }                                                                                               \
  }                                                                                                 \
  static_assert(true)
#else
#define STRANDCAST_KERNEL(name, Arguments)                                    \
  void name(::strandcast::simd::InstructionSet, const Arguments& arguments) { \
    name##_lanes(arguments);                                                  \
  }                                                                           \
  static_assert(true)
#endif

}  // namespace strandcast::simd
