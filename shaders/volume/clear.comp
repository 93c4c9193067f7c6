// The nodes that the last volume had, of both buffers. An invocation per node of a segment.
#include "volume/nodes.glsl"

layout(std430, binding = kBindingVolumeRecords) writeonly restrict buffer OtherBlock { vec4 node[]; } b_other;

void main() {
  const VolumeNode node = volume_node(volume_nodes());
  if (!node.is_there) return;
  b_nodes.node[kVolumeHeader + node.index] = vec4(0.0);
  b_other.node[kVolumeHeader + node.index] = vec4(0.0);
}
