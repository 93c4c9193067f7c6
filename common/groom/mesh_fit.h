// Judges whether a head's mesh belongs to the hair beside it. Pure function, any thread.
#pragma once

#include <glm/glm.hpp>
#include <string>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

/// Says why a head's mesh does not fit this hair: half of the roots are far from it, or nearly all would be
/// much nearer if it were turned. Names the size or turn that fits, where one does. Empty where the mesh may
/// be right. `file_origin_m`: where the files of both have their origin; metres, +Y up.
std::string unfit_mesh(const Mesh& head, const Groom& groom, const glm::vec3& file_origin_m);

}  // namespace strandcast
