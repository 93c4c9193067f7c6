// Position-based dynamics: Woodhouse 2017, equation 2.1.
#define IS_COMPLIANT 0
#define HAS_TRACTRIX_SWEEPS 0
#include "sim/position_based.glsl"
