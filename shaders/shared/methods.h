// Values of the shader variants that stand for methods, numbered like the enumerators of common/scene/render_methods.h
// (common/render/passes/strand_pass.cpp compares them). Macros, because variants are chosen by the preprocessor.
#ifndef STRANDCAST_SHADERS_SHARED_METHODS_H
#define STRANDCAST_SHADERS_SHARED_METHODS_H

#define SHADING_SADEGHI 0
#define SHADING_KAJIYA_KAY 1
#define SHADING_KARIS 2
#define SHADING_CHIANG 3
#define SHADING_MARSCHNER 4

#define SCATTERING_VOLUME 0
#define SCATTERING_NONE 1
#define SCATTERING_ISOSURFACE 2
#define SCATTERING_DUAL 3

#endif
