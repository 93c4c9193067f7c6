// What a sample adds to the eight nodes around it, as integers: sums of them are the same in any order. They
// are in s0 to s7, (momentum, length), x the fastest.
// `share`: where in its cell it lies; `value`: its momentum and length.
#define ADD_TO_CORNERS(share, value)                                        \
  {                                                                         \
    const vec3 far = share;                                                 \
    const vec3 near = 1.0 - far;                                            \
    const vec4 x0 = (value)*near.x, x1 = (value)*far.x;                     \
    const vec4 x0y0 = x0 * near.y, x1y0 = x1 * near.y;                      \
    const vec4 x0y1 = x0 * far.y, x1y1 = x1 * far.y;                        \
    s0 += ivec4(roundEven(x0y0 * near.z));                                  \
    s1 += ivec4(roundEven(x1y0 * near.z));                                  \
    s2 += ivec4(roundEven(x0y1 * near.z));                                  \
    s3 += ivec4(roundEven(x1y1 * near.z));                                  \
    s4 += ivec4(roundEven(x0y0 * far.z));                                   \
    s5 += ivec4(roundEven(x1y0 * far.z));                                   \
    s6 += ivec4(roundEven(x0y1 * far.z));                                   \
    s7 += ivec4(roundEven(x1y1 * far.z));                                   \
  }
