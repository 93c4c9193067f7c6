// Density and velocity of the hair as Woodhouse's faster version draws them (4.2.4): a point per particle. Position
// and velocity component by component.
layout(std430, binding = 0) readonly buffer StateBlock { float value[]; } b_state;   // (6 x particles)
uniform uint u_particles;
uniform vec3 u_origin;
uniform float u_voxel;
out vec3 v_at;         // voxels
out vec3 v_velocity;

float state(uint component) { return b_state.value[component * u_particles + uint(gl_VertexID)]; }

void main() {
  v_at = (vec3(state(0u), state(1u), state(2u)) - u_origin) / u_voxel;
  v_velocity = vec3(state(3u), state(4u), state(5u));
  gl_Position = vec4(0.0);
}
