#include "common/simd/variants.h"

#include <cstdio>
#include <cstdlib>
#include <vector>

namespace strandcast::simd {
namespace {

std::vector<InstructionSet> supported_sets() {
#if STRANDCAST_HAS_SETS
  std::vector<InstructionSet> sets;
  __builtin_cpu_init();
  if (__builtin_cpu_supports("sse4.2")) sets.push_back(InstructionSet::Plain);
  if (__builtin_cpu_supports("avx2")) sets.push_back(InstructionSet::Avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
    sets.push_back(InstructionSet::Avx512);
  return sets;
#else
  return {InstructionSet::Plain};
#endif
}

std::vector<InstructionSet> find_sets() {
  std::vector<InstructionSet> sets = supported_sets();
#if defined(STRANDCAST_ONLY_SET) && STRANDCAST_HAS_SETS
  constexpr auto kNeeded = static_cast<InstructionSet>(STRANDCAST_ONLY_SET);
  std::erase_if(sets, [](InstructionSet set) { return set != kNeeded; });
#else
  constexpr auto kNeeded = InstructionSet::Plain;
#endif
  if (!sets.empty()) return sets;
  std::fprintf(stderr,
               "This build is for processors with %s, which this one lacks: build it here, or with "
               "-DSTRANDCAST_INSTRUCTION_SETS=all\n",
               to_string(kNeeded));
  std::exit(2);
}

}  // namespace

const char* to_string(InstructionSet set) {
  switch (set) {
    case InstructionSet::Plain:
      return STRANDCAST_HAS_SETS ? "SSE4.2" : "plain";
    case InstructionSet::Avx2:
      return "AVX2";
    case InstructionSet::Avx512:
      return "AVX-512";
  }
  return "?";
}

std::span<const InstructionSet> instruction_sets() {
  static const std::vector<InstructionSet> kSets = find_sets();
  return kSets;
}

}  // namespace strandcast::simd
