// Points of drawn strands on the GPU, two texels each: x, y, z, then halves. In head
// space and metres until they are shaded, then pixels and metres along the view; two in a row of one strand are a segment.
layout(binding = kUnitTilePoints) uniform usamplerBuffer u_points;
layout(binding = kUnitTileStrands) uniform usamplerBuffer u_strands;  // points, number among all, lock

struct StrandNumbers {
  uint point_count;
  uint index;   // among all that could be drawn: randomness hangs on it
  uint lock;
};

StrandNumbers strand_numbers(uint strand) {
  uvec4 texel = texelFetch(u_strands, int(strand));
  return StrandNumbers(texel.x, texel.y, texel.z);
}

// Of a strand's first point.
uint first_point(uint strand) { return strand * u_frame.followers.z; }

vec3 point_place(uint point) { return uintBitsToFloat(texelFetch(u_points, int(2u * point)).xyz); }
