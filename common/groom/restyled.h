// Changes length and curls of loaded hair. Each strand is cut or stretched, and its waves about its smooth
// path become narrower or wider. Pure functions; any thread.
#pragma once

#include "common/groom/groom.h"

namespace strandcast {

/// Half width (m of arc length) of the smoothing that gives a strand's smooth path. The path is a local
/// parabola with tricube weights (Cleveland 1979); waves are offsets from it. Wavelengths up to half this
/// value are waves; those several times longer belong to the path.
inline constexpr double kSmoothReachM = 0.09;

/// Returns the same strands with new length and curls; vertex count, root and pins stay. Factors of 1 change
/// nothing. `length` (> 0) multiplies the arc length: shorter strands end earlier on the same path, longer
/// ones are scaled. Strands pinned at both ends keep their length. `curl` (>= 0) multiplies the offset from
/// the smooth path, whose length stays; less curl means less arc length.
Groom restyled(Groom groom, double length, double curl);

/// Returns the points of one strand's smooth path.
std::vector<glm::dvec3> smooth_path_of(const Groom& groom, uint32_t strand_index);

}  // namespace strandcast
