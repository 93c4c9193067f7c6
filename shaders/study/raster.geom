// A sample as a point of two by two nodes in the two layers that it lies between (003, 4.2.4, which draws three by
// three into three: what is farther than a cell gets nothing).
layout(points) in;
layout(points, max_vertices = 2) out;

layout(location = 0) in vec4 v_place[];
layout(location = 1) in vec4 v_value[];
layout(location = 0) flat out vec2 g_at;  // nodes
layout(location = 1) flat out vec4 g_value;

uniform vec3 u_node_count;

void main() {
  const vec3 at = v_place[0].xyz;
  const vec3 first = floor(at);
  for (int side = 0; side < 2; ++side) {
    gl_Position = vec4(2.0 * (first.xy + 1.0) / u_node_count.xy - 1.0, 0.0, 1.0);
    gl_PointSize = 2.0;
    gl_Layer = int(first.z) + side;
    g_at = at.xy;
    g_value = v_value[0] * (side == 0 ? first.z + 1.0 - at.z : at.z - first.z);
    EmitVertex();
    EndPrimitive();
  }
}
