// mass_spring, backward Euler, with altitude springs: one more block on either side of the diagonal.
#define HAS_ALTITUDE 1
#include "sim/mass_spring_implicit.glsl"
