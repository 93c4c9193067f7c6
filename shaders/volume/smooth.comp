// [1 2 1] / 4 along x and y, or along z, of sums or of mean velocities. Beyond the grid is nothing. An invocation
// per node of a segment.
#pragma variant ALONG_Z 0 1
#pragma variant OF_VELOCITY 0 1
#include "volume/nodes.glsl"

layout(binding = kUnitVolumeNode) uniform samplerBuffer u_node;

vec4 node_at(int index) { return texelFetch(u_node, index + int(kVolumeHeader)); }

// Of three, the outer ones of which may be beyond the grid.
vec4 smoothed(vec4 before, vec4 center, vec4 after, vec2 weight) {
  return (weight.x * before + weight.y * after) + 0.5 * center;
}

void main() {
  const uvec3 nodes = volume_nodes();
  const VolumeNode node = volume_node(nodes);
  if (!node.is_there) return;
  const int at = int(node.index);
  const vec3 below = 0.25 * vec3(min(node.at, uvec3(1u)));
  const vec3 above = 0.25 * vec3(min(nodes - 1u - node.at, uvec3(1u)));
  const vec4 center = node_at(at);
#if ALONG_Z
  const int layer = int(nodes.x * nodes.y);
  vec4 value = smoothed(node_at(below.z > 0.0 ? at - layer : at), center, node_at(above.z > 0.0 ? at + layer : at),
                        vec2(below.z, above.z));
#else
  const int row = int(nodes.x);
  const int rows[3] = int[3](below.y > 0.0 ? at - row : at, at, above.y > 0.0 ? at + row : at);
  const int left = below.x > 0.0 ? -1 : 0;
  const int right = above.x > 0.0 ? 1 : 0;
  vec4 along_x[3];
  for (int i = 0; i < 3; ++i)
    along_x[i] = smoothed(node_at(rows[i] + left), i == 1 ? center : node_at(rows[i]), node_at(rows[i] + right),
                          vec2(below.x, above.x));
  vec4 value = smoothed(along_x[0], along_x[1], along_x[2], vec2(below.y, above.y));
#endif
#if OF_VELOCITY
  value.w = center.w;
#endif
  store_node(node.index, value);
}
