// Where the samples of each bin begin once they are sorted: running sums, by one group.
#include "shared/limits.h"
#include "shared/scatter_study.h"

layout(local_size_x = kRunningSumLocalSize) in;
layout(std430, binding = kBindingStudyBins) restrict buffer CountBlock { uint count[]; } b_bins;  // one more than there are bins

uniform uint u_bin_count;

shared uint s_sum[kRunningSumLocalSize];

void main() {
  const uint each = (u_bin_count + kRunningSumLocalSize - 1u) / kRunningSumLocalSize;
  const uint begin = min(gl_LocalInvocationID.x * each, u_bin_count);
  const uint end = min(begin + each, u_bin_count);
  uint sum = 0u;
  for (uint i = begin; i < end; ++i) sum += b_bins.count[i];
  s_sum[gl_LocalInvocationID.x] = sum;
  barrier();
  uint next = 0u;
  for (uint i = 0u; i < gl_LocalInvocationID.x; ++i) next += s_sum[i];
  for (uint i = begin; i < end; ++i) {
    const uint count = b_bins.count[i];
    b_bins.count[i] = next;
    next += count;
  }
  if (gl_LocalInvocationID.x == kRunningSumLocalSize - 1u) b_bins.count[u_bin_count] = next;
}
