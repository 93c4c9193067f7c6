// Friction among hair as Woodhouse's first version has it (4.2.6): a particle's velocity is drawn towards the mean of
// its voxel. One invocation per particle and group.
layout(local_size_x = 1) in;
struct Particle {
  vec4 position;
  vec4 velocity;
};
layout(std430, binding = 0) buffer ParticleBlock { Particle particle[]; } b_particles;
layout(std430, binding = 1) readonly buffer VoxelBlock { uint sum[]; } b_voxels;
uniform int u_voxels;
uniform vec3 u_origin;
uniform float u_voxel;
uniform float u_friction;

void main() {
  const uint i = gl_WorkGroupID.x;
  const vec3 at = (b_particles.particle[i].position.xyz - u_origin) / u_voxel;
  const ivec3 voxel = clamp(ivec3(floor(at)), ivec3(0), ivec3(u_voxels - 1));
  const int base = 4 * ((voxel.z * u_voxels + voxel.y) * u_voxels + voxel.x);
  const vec3 sum = vec3(int(b_voxels.sum[base]), int(b_voxels.sum[base + 1]), int(b_voxels.sum[base + 2]));
  const float density = float(int(b_voxels.sum[base + 3]));
  if (density > 0.0)
    b_particles.particle[i].velocity.xyz = mix(b_particles.particle[i].velocity.xyz, sum / density, u_friction);
}
