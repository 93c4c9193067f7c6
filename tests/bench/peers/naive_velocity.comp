// Velocities from the way made and from what the follower was moved (Woodhouse 2017, 2.1.4).
#include "naive.glsl"

void main() {
  const uint i = gl_WorkGroupID.x;
  const vec3 placed = b_particles.particle[i].predicted.xyz + b_particles.particle[i].moved.xyz;
  const bool has_follower = (i + 1u) % u_vertices != 0u;
  const vec3 follower = has_follower ? b_particles.particle[i + 1u].moved.xyz : vec3(0.0);
  b_particles.particle[i].velocity.xyz =
      (placed - b_particles.particle[i].position.xyz - u_s_damping * follower) / u_h;
  b_particles.particle[i].position.xyz = placed;
}
