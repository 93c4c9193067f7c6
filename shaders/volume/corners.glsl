// What a sample adds to the eight nodes around it, as integers: sums of them are the same in any order. They are
// in s0 to s7, (momentum, length), x the fastest. `dither`, 0 to 1 and of the sample alone: rounded alike, equal
// samples of a crowd would all be off the same way; corners take different parts of it. `share`: where in its cell
// it lies; `value`: its momentum and length.
#define ADD_TO_CORNERS(share, value, dither)                                  \
  {                                                                           \
    const vec4 dither0 = fract(dither + vec4(0.0, 0.125, 0.25, 0.375));       \
    const vec4 dither1 = fract(dither0 + 0.5);                                \
    const vec3 far = share;                                                   \
    const vec3 near = 1.0 - far;                                              \
    const vec4 x0 = (value)*near.x, x1 = (value)*far.x;                       \
    const vec4 x0y0 = x0 * near.y, x1y0 = x1 * near.y;                        \
    const vec4 x0y1 = x0 * far.y, x1y1 = x1 * far.y;                          \
    s0 += ivec4(floor(dither0.x + x0y0 * near.z));                            \
    s1 += ivec4(floor(dither0.y + x1y0 * near.z));                            \
    s2 += ivec4(floor(dither0.z + x0y1 * near.z));                            \
    s3 += ivec4(floor(dither0.w + x1y1 * near.z));                            \
    s4 += ivec4(floor(dither1.x + x0y0 * far.z));                             \
    s5 += ivec4(floor(dither1.y + x1y0 * far.z));                             \
    s6 += ivec4(floor(dither1.z + x0y1 * far.z));                             \
    s7 += ivec4(floor(dither1.w + x1y1 * far.z));                             \
  }
