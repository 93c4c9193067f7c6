// Compliant position-based dynamics: Macklin, Mueller, Chentanez 2016, equation 18.
#define IS_COMPLIANT 1
#define HAS_TRACTRIX_SWEEPS 0
#include "sim/position_based.glsl"
