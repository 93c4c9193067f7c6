// mass_spring, backward Euler, without altitude springs.
#define HAS_ALTITUDE 0
#include "sim/mass_spring_implicit.glsl"
