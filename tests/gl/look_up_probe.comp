// For executor_test.cpp: every vertex takes the elements of both tables that its own numbers name.
#include "sim/step.glsl"

layout(local_size_x = kStrandLocalSize) in;
layout(binding = kUnitField) uniform lookup_table u_field;
layout(binding = kUnitVolume) uniform lookup_table u_volume;

void main() {
  const uint stride = u_step.shape.x;
  const uint strand = gl_GlobalInvocationID.x;
  if (strand >= stride) return;
  for (uint i = 0u; i < u_step.shape.y; ++i) {
    const uint at = i * stride + strand;
    const vec4 position = texelFetch(u_position, int(at));
    const lane_uint index = lane_uint(position.x);
    const lane_uint other = min(index + lane_uint(3u), lane_uint(position.y));
    b_position.position[at] = look_up(u_field, index) - look_up(u_volume, other);
  }
}
