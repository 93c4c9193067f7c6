// Compiles one kernel for several instruction sets and chooses one at run time. After an always-inline
// function `name_lanes(const Arguments&)`, STRANDCAST_KERNEL(name, Arguments) defines `name(InstructionSet,
// const Arguments&)`. All variants give the same bits (common/simd/lanes.h). Mark lambdas in kernels with
// STRANDCAST_LANES_LAMBDA, or they are not compiled for the instruction set.
#pragma once

#include <span>

#include "common/simd/lanes.h"

namespace strandcast::simd {

/// Instruction sets from the narrowest to the widest. Plain is the least that a build needs: SSE4.2 or NEON.
enum class InstructionSet { Plain, Avx2, Avx512 };

const char* to_string(InstructionSet set);
/// Returns the sets that this build has and this processor supports, the widest last. Where there is none it
/// ends the program, with a sentence on the standard error stream.
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

#define STRANDCAST_TARGET_PLAIN target("sse4.2")
#define STRANDCAST_TARGET_AVX2 target("avx2")
#define STRANDCAST_TARGET_AVX512 target("avx512f,avx512vl,avx512dq,avx512bw")

#if STRANDCAST_HAS_SETS && !defined(STRANDCAST_ONLY_SET)
#define STRANDCAST_KERNEL(name, Arguments)                                                                   \
  __attribute__((flatten, STRANDCAST_TARGET_PLAIN)) static void name##_plain(const Arguments& arguments) {   \
    name##_lanes(arguments);                                                                                 \
  }                                                                                                          \
  __attribute__((flatten, STRANDCAST_TARGET_AVX2)) static void name##_avx2(const Arguments& arguments) {     \
    name##_lanes(arguments);                                                                                 \
  }                                                                                                          \
  __attribute__((flatten, STRANDCAST_TARGET_AVX512)) static void name##_avx512(const Arguments& arguments) { \
    name##_lanes(arguments);                                                                                 \
  }                                                                                                          \
  void name(::strandcast::simd::InstructionSet set, const Arguments& arguments) {                            \
    switch (set) {                                                                                           \
      case ::strandcast::simd::InstructionSet::Plain:                                                        \
        return name##_plain(arguments);                                                                      \
      case ::strandcast::simd::InstructionSet::Avx2:                                                         \
        return name##_avx2(arguments);                                                                       \
      case ::strandcast::simd::InstructionSet::Avx512:                                                       \
        return name##_avx512(arguments);                                                                     \
    }                                                                                                        \
  }                                                                                                          \
  static_assert(true)
#else
// One set: the only one that was asked for (STRANDCAST_INSTRUCTION_SETS=native), or the compiler's own.
#if !STRANDCAST_HAS_SETS
#define STRANDCAST_KERNEL_ATTRIBUTES
#elif STRANDCAST_ONLY_SET == 2
#define STRANDCAST_KERNEL_ATTRIBUTES __attribute__((flatten, STRANDCAST_TARGET_AVX512))
#elif STRANDCAST_ONLY_SET == 1
#define STRANDCAST_KERNEL_ATTRIBUTES __attribute__((flatten, STRANDCAST_TARGET_AVX2))
#else
#define STRANDCAST_KERNEL_ATTRIBUTES __attribute__((flatten, STRANDCAST_TARGET_PLAIN))
#endif
#define STRANDCAST_KERNEL(name, Arguments)                                                                 \
  STRANDCAST_KERNEL_ATTRIBUTES void name(::strandcast::simd::InstructionSet, const Arguments& arguments) { \
    name##_lanes(arguments);                                                                               \
  }                                                                                                        \
  static_assert(true)
#endif

}  // namespace strandcast::simd
