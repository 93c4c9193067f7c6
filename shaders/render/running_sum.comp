// Running sums of counts, alone in one group: in place of every count the sum of those before it, and behind the last
// count the sum of all. The same for any number of threads.
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kRunningSumLocalSize) in;

layout(std430, binding = kBindingRunningSum) restrict buffer RunningSum {
  uint sum[];  // (u_count + 1)
} running;

uniform uint u_count;

shared uint parts[kRunningSumLocalSize];

void main() {
  uint mine = gl_LocalInvocationID.x;
  uint share = (u_count + kRunningSumLocalSize - 1u) / kRunningSumLocalSize;
  uint begin = min(mine * share, u_count);
  uint end = min(begin + share, u_count);
  uint own = 0u;
  for (uint i = begin; i < end; ++i) own += running.sum[i];
  parts[mine] = own;
  barrier();
  uint before = 0u;
  for (uint i = 0u; i < mine; ++i) before += parts[i];
  for (uint i = begin; i < end; ++i) {
    uint count = running.sum[i];
    running.sum[i] = before;
    before += count;
  }
  if (mine == kRunningSumLocalSize - 1u) running.sum[u_count] = before;
}
