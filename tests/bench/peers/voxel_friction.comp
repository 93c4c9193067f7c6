// Friction among hair as Woodhouse's faster version has it: one texture read per particle.
layout(local_size_x = 64) in;
layout(std430, binding = 0) buffer StateBlock { float value[]; } b_state;   // (6 x particles)
uniform sampler3D u_sums;
uniform uint u_particles;
uniform int u_voxels;
uniform vec3 u_origin;
uniform float u_voxel;
uniform float u_friction;

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= u_particles) return;
  const vec3 at = (vec3(b_state.value[i], b_state.value[u_particles + i], b_state.value[2u * u_particles + i]) -
                   u_origin) / u_voxel;
  // The voxel's own value, as in the first version.
  const vec3 middle = (floor(at) + 0.5) / float(u_voxels);
  const vec4 sum = texture(u_sums, middle);
  if (!(sum.a > 0.0)) return;
  for (uint component = 0u; component < 3u; ++component) {
    const uint index = (3u + component) * u_particles + i;
    b_state.value[index] = mix(b_state.value[index], sum[component] / sum.a, u_friction);
  }
}
