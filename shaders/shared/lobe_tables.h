// Shape of the lookup tables of light scattered by a fibre, shared by C++
// (common/render/scatter/lobe_tables.h) and GLSL (render/lobe_tables.glsl). Values lie at the middle of
// texels; the first and the last are the ends of their range.
#ifndef STRANDCAST_SHADERS_SHARED_LOBE_TABLES_H
#define STRANDCAST_SHADERS_SHARED_LOBE_TABLES_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Absorption per radius enters by its root, to which the logarithm of the hair's colour is proportional.
const float kMaxRootAbsorption = 1.25;

// Longitudinal: half angle -pi/2 .. pi/2. Holds M of R, TT and TRT.
const uint kHalfAngleTexels = 2048u;

// Azimuthal: azimuth 0 .. pi, cosine of the difference angle 0 .. 1, root of the absorption. Holds N of R,
// TT, TRT.
const uint kAzimuthTexels = 128u;
const uint kDifferenceTexels = 128u;
const uint kAbsorptionTexels = 24u;

// Averages of a fibre: cosine of the inclination 0 .. 1, root of the absorption, and one of three layers:
// (a_f, a_b, N_R forward, N_TT forward), (N_TRT forward, shift forward, shift back, -) and (width forward,
// width back, -, -), where shifts and widths are relative to those of R.
const uint kInclinationTexels = 32u;
const uint kAverageAbsorptionTexels = 32u;
const uint kAverageLayers = 3u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
