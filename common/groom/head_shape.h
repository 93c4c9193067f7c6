// HeadShape: the built-in head made to fit under a groom: stretched to an ellipsoid through the roots, then
// pulled to them and away from the hair, direction by direction; the neck gets thinner instead. Immutable;
// any thread; the same groom gives the same shape.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

class HeadShape {
 public:
  /// `about`: where the head is and how large, for a start. `groom` upright, face at +Z, in metres.
  HeadShape(const Groom& groom, const FittedSphere& about);

  /// The head as it is drawn, with normals.
  Mesh mesh() const;
  /// About how far a point is outside of the surface, m; negative inside.
  double distance_m(const glm::dvec3& point_m) const;

 private:
  void stretch_to_roots(const Groom& groom);
  void pull_to_roots(const Groom& groom);
  void give_way_to_hair(const Groom& groom);
  void narrow_neck(const Groom& groom);
  double distance_in_radii(const glm::dvec3& u) const;
  glm::dvec3 in_skull_radii(const glm::vec3& point_m) const;
  double pull_at(const glm::dvec3& direction) const;
  double neck_width_at(const glm::dvec3& u) const;

  glm::dvec3 center_m_;
  glm::dvec3 radius_m_;             // of the skull, by axis
  std::vector<double> pull_;        // (direction) factor on the built-in head's radius
  std::vector<double> neck_width_;  // (height x azimuth) factor on the width of the neck
};

}  // namespace strandcast
