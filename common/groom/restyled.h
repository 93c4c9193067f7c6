// Another length and other curls for hair from a file: each strand is cut or stretched, and its waves about
// its smooth path are made narrower or wider. Any thread; values in, values out.
#pragma once

#include "common/groom/groom.h"

namespace strandcast {

/// Waves of a strand are what is left of it beside its smooth path: a parabola through the strand's vertices
/// within this arc length, weighted by the tricube of their distance (Cleveland 1979). Waves of half this
/// length and less are waves, what is several times longer belongs to the path.
inline constexpr double kSmoothReachM = 0.09;

/// The same strands with the same number of vertices, root and pinned vertices as before. `length` (above 0)
/// times the arc length: shorter strands end earlier on the same way, longer ones are the same shape, larger;
/// strands that are pinned at both ends keep theirs. `curl` (0 or more) times the offset from the smooth
/// path, whose length stays: a strand whose waves are gone has less arc length. 1 and 1 change nothing.
Groom restyled(Groom groom, double length, double curl);

/// The smooth path of one strand, point by point.
std::vector<glm::dvec3> smooth_path_of(const Groom& groom, uint32_t strand_index);

}  // namespace strandcast
