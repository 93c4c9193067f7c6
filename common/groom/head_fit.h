// Finds the head under a groom that does not state it. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

/// Returns the first vertex of every strand, in the groom's units.
std::vector<glm::vec3> roots_of(const Groom& groom);

/// Fits a sphere to the roots; +Y is up. If hair continues down neck and back, so that it does not wrap the
/// sphere, only the upper roots count. Falls back to all roots.
FittedSphere fit_head_sphere(const Groom& groom);

/// Returns the size of the box around points, and its diagonal.
glm::vec3 box_size_of(const std::vector<glm::vec3>& points);
float extent_of(const std::vector<glm::vec3>& points);

/// Returns whether points lie in or near a plane or a line, on a sphere or not.
bool are_flat(const std::vector<glm::vec3>& points);

/// Returns whether roots fill a part of a plane, so that the sphere through them says nothing. A line over a
/// head lies on its sphere.
bool are_on_a_disc(const std::vector<glm::vec3>& roots);

/// Where hair grows: roots of a body lie far from the sphere that fits them best, and those of a ball leave
/// no room for a face and a neck. A beard lies below the middle of its face; +Y is up.
enum class HairPlace { Head, Jaw, Body };
HairPlace hair_place(const Groom& groom);
/// Returns whether hair is neither fur nor a beard.
bool is_hair_of_head(const Groom& groom);

/// Returns whether roots lie on one side of a head and none on its top, as brows, lashes, a moustache and
/// parts of hair do: they say little of which side is up and where the face is. +Y is up.
bool is_piece(const Groom& groom);

/// Returns the radius of the head under the roots, in the groom's units; 0 where these are few, on a disc,
/// fur, or on too little of a head to say it.
float covered_head_radius(const Groom& groom);

/// Finds the head of a groom in metres. Uses the sphere through the roots if it has the size of a person's
/// head. Otherwise it places a head of usual size so that the roots stand on it in the direction of growth.
FittedSphere fit_head(const Groom& groom);

}  // namespace strandcast
