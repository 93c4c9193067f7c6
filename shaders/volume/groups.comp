// Groups of the indirect dispatches over what was counted. One invocation.
#include "shared/bindings.h"
#include "shared/hair_volume.h"

layout(local_size_x = 1) in;
layout(std430, binding = kBindingVolumeFacts) restrict buffer FactBlock { uint fact[]; } b_facts;

void store_groups(uint to, uint groups) {
  b_facts.fact[to] = min(groups, kVolumeGroupsAcross);
  b_facts.fact[to + 1u] = (groups + kVolumeGroupsAcross - 1u) / kVolumeGroupsAcross;
  b_facts.fact[to + 2u] = 1u;
}

void main() {
  const uint per_group = kVolumeLocalSize / kVolumeSegment;
  store_groups(kFactCellGroups, (b_facts.fact[kFactCells] + kVolumeLocalSize - 1u) / kVolumeLocalSize);
  store_groups(kFactCrowdGroups, b_facts.fact[kFactCrowds]);
  store_groups(kFactSegmentGroups, (b_facts.fact[kFactSegments] + per_group - 1u) / per_group);
}
