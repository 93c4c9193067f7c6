// Optical depth between a point and the lights, from the lattices that the tile_light kernels fill.
layout(binding = kUnitTileKeyDepth) uniform sampler3D u_key_depth;
layout(binding = kUnitTileRimDepth) uniform sampler3D u_rim_depth;   // cells twice as large
layout(binding = kUnitTileSkyDepth) uniform sampler3D u_sky_depth;

LightDepth light_depth_at(vec3 point_m) {
  vec3 cell = lattice_cell(point_m);
  vec3 fine = (cell + 0.5) / vec3(u_frame.lattice_size.xyz);
  // Middles of the halved cells lie half a cell further.
  vec3 coarse = (0.5 * (cell - 0.5) + 0.5) / vec3(u_frame.half_size.xyz);
  return LightDepth(texture(u_key_depth, fine).r, texture(u_rim_depth, coarse).r, texture(u_sky_depth, coarse).r);
}
