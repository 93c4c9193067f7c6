// The layer that a particle lies in, and the ones before and behind it; points of three texels reach the neighbours.
layout(points) in;
layout(points, max_vertices = 3) out;
in vec3 v_at[];
in vec3 v_velocity[];
uniform int u_voxels;
flat out vec3 g_at;
flat out vec3 g_velocity;
flat out int g_layer;

void main() {
  const int middle = int(floor(v_at[0].z));
  for (int layer = max(middle - 1, 0); layer <= min(middle + 1, u_voxels - 1); ++layer) {
    gl_Layer = layer;
    g_layer = layer;
    g_at = v_at[0];
    g_velocity = v_velocity[0];
    // The middle of its voxel, so that a point covers whole texels.
    gl_Position = vec4(2.0 * (floor(v_at[0].xy) + 0.5) / float(u_voxels) - 1.0, 0.0, 1.0);
    gl_PointSize = 3.0;
    EmitVertex();
    EndPrimitive();
  }
}
