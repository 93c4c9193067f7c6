#include "common/simd/variants.h"

#include <vector>

namespace strandcast::simd {
namespace {

std::vector<InstructionSet> find_sets() {
  std::vector<InstructionSet> sets{InstructionSet::Plain};
#if STRANDCAST_HAS_SETS
  __builtin_cpu_init();
  if (__builtin_cpu_supports("sse4.2")) sets.push_back(InstructionSet::Sse4);
  if (__builtin_cpu_supports("avx2")) sets.push_back(InstructionSet::Avx2);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
    sets.push_back(InstructionSet::Avx512);
#endif
  return sets;
}

}  // namespace

const char* to_string(InstructionSet set) {
  switch (set) {
    case InstructionSet::Plain:
      return "plain";
    case InstructionSet::Sse4:
      return "SSE4";
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
