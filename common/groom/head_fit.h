// Where the head is under a groom that does not say it. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

/// First vertex of every strand, in the groom's units.
std::vector<glm::vec3> roots_of(const Groom& groom);

/// The sphere under the hair of the head. A mane that goes on down the neck and the back does not wrap its
/// fitted sphere; then only its upper roots count. Falls back to all roots. +Y is up.
FittedSphere fit_head_sphere(const Groom& groom);

/// The head of a groom in metres, whatever the groom: the sphere under the hair where that has the size of a
/// person's, else one of the usual size, which the roots stand on the way they grow.
FittedSphere fit_head(const Groom& groom);

}  // namespace strandcast
