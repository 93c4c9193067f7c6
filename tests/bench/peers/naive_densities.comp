// Density and velocity of the hair per voxel as Woodhouse's first version sums them (4.2.4): one invocation per
// particle and group, 27 voxels in turn, four atomic sums each in 16.16 fixed point.
layout(local_size_x = 1) in;
struct Particle {
  vec4 position;
  vec4 velocity;
};
layout(std430, binding = 0) readonly buffer ParticleBlock { Particle particle[]; } b_particles;
layout(std430, binding = 1) buffer VoxelBlock { uint sum[]; } b_voxels;   // (voxels^3 x 4) velocity, density
uniform int u_voxels;
uniform vec3 u_origin;
uniform float u_voxel;

void main() {
  const Particle particle = b_particles.particle[gl_WorkGroupID.x];
  const vec3 at = (particle.position.xyz - u_origin) / u_voxel;
  const ivec3 middle = ivec3(floor(at));
  for (int z = -1; z <= 1; ++z)
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) {
        const ivec3 voxel = middle + ivec3(x, y, z);
        if (any(lessThan(voxel, ivec3(0))) || any(greaterThanEqual(voxel, ivec3(u_voxels)))) continue;
        const vec3 tent = max(vec3(0.0), 1.0 - abs(at - (vec3(voxel) + 0.5)) / 1.5);
        const float weight = tent.x * tent.y * tent.z;
        const int base = 4 * ((voxel.z * u_voxels + voxel.y) * u_voxels + voxel.x);
        for (int i = 0; i < 3; ++i)
          atomicAdd(b_voxels.sum[base + i], uint(int(round(65536.0 * weight * particle.velocity[i]))));
        atomicAdd(b_voxels.sum[base + 3], uint(int(round(65536.0 * weight))));
      }
}
