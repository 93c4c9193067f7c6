// The samples of a hair volume: vertices, or places on segments that are longer than a cell.
#pragma variant HAS_SPLIT 0 1
#include "lib/hash.glsl"
#include "volume/sample.glsl"

// As volume/bounds.comp left them.
layout(binding = kUnitVolumePlace) uniform samplerBuffer u_place;
layout(binding = kUnitVolumeMotion) uniform samplerBuffer u_motion;

uniform uint u_strand_count;
uniform uint u_sample_count;  // of a segment that is split

// The vertex, or with split segments the one behind the sample, and which of the segment's samples it is.
struct SampleIndex {
  uint vertex;  // element
  uint part;
};

SampleIndex sample_index(uint strand, uint row) {
#if HAS_SPLIT
  return SampleIndex((row / u_sample_count + 1u) * u_strand_count + strand, row % u_sample_count);
#else
  return SampleIndex(row * u_strand_count + strand, 0u);
#endif
}

// In a word.
uint packed_index(SampleIndex which) { return which.vertex << kVolumePartBits | which.part; }
SampleIndex unpacked_index(uint word) {
  return SampleIndex(word >> kVolumePartBits, word & ((1u << kVolumePartBits) - 1u));
}

float sample_dither(SampleIndex which) { return float(mix_u32(packed_index(which)) >> 8) * (1.0 / 16777216.0); }

// In cells of the lattice; w = length of hair, m.
vec4 sample_place(SampleIndex which) {
  const vec4 place = texelFetch(u_place, int(which.vertex));
#if HAS_SPLIT
  const vec3 before = texelFetch(u_place, int(which.vertex - u_strand_count)).xyz;
  return vec4(between(before, place.xyz, sample_share(which.part, u_sample_count)), place.w);
#else
  return place;
#endif
}

// World, relative to the head joint.
vec3 sample_velocity(SampleIndex which) {
  const vec3 velocity = texelFetch(u_motion, int(which.vertex)).xyz;
#if HAS_SPLIT
  const vec3 before = texelFetch(u_motion, int(which.vertex - u_strand_count)).xyz;
  return between(before, velocity, sample_share(which.part, u_sample_count));
#else
  return velocity;
#endif
}
