// Each particle onto the sphere about the one before it, from root to tip (Woodhouse 2017, 2.1.4).
#include "naive.glsl"

void main() {
  const uint begin = gl_WorkGroupID.x * u_vertices;
  b_particles.particle[begin].moved = vec4(0.0);
  vec3 leader = b_particles.particle[begin].predicted.xyz;
  for (uint i = begin + 1u; i < begin + u_vertices; ++i) {
    const vec3 free = b_particles.particle[i].predicted.xyz;
    const bool is_pinned = b_particles.particle[i].predicted.w > 0.0;
    const vec3 placed =
        is_pinned ? free : leader + b_particles.particle[i].position.w * normalize(free - leader);
    b_particles.particle[i].moved.xyz = placed - free;
    leader = placed;
  }
}
