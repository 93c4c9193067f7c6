// Cells of the grid under way.
#include "volume/facts.glsl"

// From the grid's first.
ivec3 cell_of(vec3 cells) { return ivec3(floor(cells)) - volume_first(); }
bool is_in_grid(ivec3 cell, uvec3 nodes) {
  return all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, ivec3(nodes) - 1));
}
uint index_of(ivec3 cell, uvec3 nodes) {
  return (uint(cell.z) * nodes.y + uint(cell.y)) * nodes.x + uint(cell.x);
}
