// Compliant position-based dynamics with tractrix sweeps: Zappe 2020 chapter 6.
#define IS_COMPLIANT 1
#define HAS_TRACTRIX_SWEEPS 1
#include "sim/tractrix.glsl"
#include "sim/position_based.glsl"
