// What lies behind a picture instead of a background, for C++ and GLSL.
#ifndef STRANDCAST_SHADERS_SHARED_BACKDROP_H
#define STRANDCAST_SHADERS_SHARED_BACKDROP_H

#ifdef __cplusplus
#include <cstdint>
namespace strandcast::shader {
using uint = uint32_t;
#endif

// Its texture unit, beside those of bindings.h that who draws a picture uses.
const uint kUnitBackdrop = 13u;

#ifdef __cplusplus
}  // namespace strandcast::shader
#endif

#endif
