// HeadSpheres: approximates a drawn head by a few spheres, with which strands collide. Pure functions, any
// thread.
#pragma once

#include <cstddef>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

/// Number of spheres of a head: the most that strands can be tested against.
inline constexpr size_t kHeadSpheres = 16;
/// Greatest depth (m) at which a pinned vertex of the loaded groom may lie inside the fitted spheres. Free
/// vertices must lie outside, because spheres would push them out of their style.
inline constexpr float kSwallowedM = 0.002f;

/// Fits at most `count` spheres inside a mesh so that they approximate its surface. Candidates are balls that
/// touch the surface at two points (Ma, Bae and Choi 2012, "3D medial axis point approximation using nearest
/// neighbors and the normal field"); the choice is greedy. Surface that faces another part nearby, as inside
/// a mouth, is ignored. So is surface that no strand is long enough to reach; surface far from all hair
/// counts little. Empty for a mesh without area; deterministic.
std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count, const Groom& groom);
/// Fits spheres without hair; the whole surface counts equally.
std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count);

/// Adjusts spheres to a groom. Each sphere first grows to make up for the gaps between spheres. It then
/// shrinks until it contains no free vertex and no pinned one deeper than kSwallowedM. Vanished spheres are
/// removed.
std::vector<FittedSphere> shrink_under(std::vector<FittedSphere> spheres, const Groom& groom);

/// Returns the distance of a point from the nearest sphere in metres; negative inside one, huge without
/// spheres.
double distance_to_spheres_m(const std::vector<FittedSphere>& spheres, const glm::dvec3& point_m);

}  // namespace strandcast
