// One particle as Woodhouse's first version kept it; strand after strand.
struct Particle {
  vec4 position;   // m; w = segment before it, m
  vec4 predicted;  // m; w = 1 when pinned
  vec4 velocity;   // m/s
  vec4 moved;      // by the constraints, m
};
layout(std430, binding = 0) buffer ParticleBlock { Particle particle[]; } b_particles;
layout(local_size_x = 1) in;
uniform float u_h;
uniform vec3 u_gravity;
uniform float u_drag;
uniform float u_s_damping;
uniform uint u_vertices;
