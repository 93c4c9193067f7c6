// HeadSpheres: a drawn head as few spheres, which is what strands collide with. Pure functions, any thread.
#pragma once

#include <cstddef>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

/// Spheres of a head: as many as strands can be tested against.
inline constexpr size_t kHeadSpheres = 16;
/// No pinned vertex of a groom as loaded lies deeper inside of the spheres that are fitted under it. Free
/// ones do not lie inside at all: they would be pushed out of their style.
inline constexpr float kSwallowedM = 0.002f;

/// At most `count` spheres inside of a mesh that together come as near to its surface as greedy choice finds:
/// balls that touch the surface at two points (Ma, Bae and Choi 2012, "3D medial axis point approximation
/// using nearest neighbors and the normal field"). Parts of the surface that face another part nearby, such
/// as the inside of a mouth or the back of an eye, do not count, nor does what no strand of the groom is long
/// enough to reach; what is far from all of its hair counts little. Empty for a mesh without area;
/// deterministic.
std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count, const Groom& groom);
/// The same without hair: all of the surface counts alike.
std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count);

/// The spheres, each as much larger as makes up for what lies between them, and smaller until no free vertex
/// of the groom lies inside of it and no pinned one deeper than kSwallowedM; those of which nothing is left
/// are gone.
std::vector<FittedSphere> shrink_under(std::vector<FittedSphere> spheres, const Groom& groom);

/// How far a point lies outside of all spheres, m; negative inside of one. Huge without spheres.
double distance_to_spheres_m(const std::vector<FittedSphere>& spheres, const glm::dvec3& point_m);

}  // namespace strandcast
