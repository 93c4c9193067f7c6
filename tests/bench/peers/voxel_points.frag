// What a particle adds to one voxel; blending sums it.
flat in vec3 g_at;
flat in vec3 g_velocity;
flat in int g_layer;
layout(location = 0) out vec4 out_sum;

void main() {
  const vec3 tent = max(vec3(0.0), 1.0 - abs(g_at - vec3(gl_FragCoord.xy, float(g_layer) + 0.5)) / 1.5);
  const float weight = tent.x * tent.y * tent.z;
  out_sum = vec4(weight * g_velocity, weight);
}
