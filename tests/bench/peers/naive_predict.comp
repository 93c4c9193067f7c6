// Where gravity and drag alone take a particle.
#include "naive.glsl"

void main() {
  const uint i = gl_WorkGroupID.x;
  const vec3 velocity =
      (b_particles.particle[i].velocity.xyz + u_h * u_gravity) / (1.0 + u_h * u_drag);
  const vec3 step = b_particles.particle[i].predicted.w > 0.0 ? vec3(0.0) : u_h * velocity;
  b_particles.particle[i].predicted.xyz = b_particles.particle[i].position.xyz + step;
}
