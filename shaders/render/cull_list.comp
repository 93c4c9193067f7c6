// Culling: the segments that can be seen one after the other, in their order, and the draws of them.
#include "shared/bindings.h"
#include "shared/limits.h"

layout(local_size_x = kStrandLocalSize) in;

layout(std430, binding = kBindingCullMask) restrict readonly buffer CullMask {
  uint bits[];   // of 32 segments
} mask;
layout(std430, binding = kBindingRunningSum) restrict readonly buffer RunningSum {
  uint sum[];    // of the segments seen before these 32; behind the last: of all
} running;
layout(std430, binding = kBindingChosen) restrict writeonly buffer Chosen {
  uint segment[];
} chosen;
struct DrawCommand {   // as glDrawElementsIndirect reads it
  uint count;
  uint instance_count;
  uint first_index;
  int base_vertex;
  uint base_instance;
};
layout(std430, binding = kBindingDrawCommand) restrict writeonly buffer DrawCommands {
  DrawCommand command[];
} draws;

uniform uint u_segments;
uniform uint u_draws;              // as many as all segments would take
uniform uint u_segments_per_draw;

void main() {
  uint block = gl_GlobalInvocationID.x;
  uint blocks = (u_segments + 31u) / 32u;
  if (block < u_draws) {
    uint all = running.sum[blocks];
    uint first = block * u_segments_per_draw;
    uint count = all > first ? min(all - first, u_segments_per_draw) : 0u;
    draws.command[block] = DrawCommand(6u * count, 1u, 0u, int(4u * first), 0u);
  }
  if (block >= blocks) return;
  uint at = running.sum[block];
  for (uint bits = mask.bits[block]; bits != 0u; bits &= bits - 1u) {
    chosen.segment[at] = 32u * block + uint(findLSB(bits));
    ++at;
  }
}
