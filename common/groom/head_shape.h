// HeadShape: the built-in head made to fit under a groom: stretched to an ellipsoid through the roots, then
// pulled to them and away from the hair, direction by direction; the shoulders sink and, like the neck, get
// narrower instead. Immutable; any thread; the same groom gives the same shape.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"

namespace strandcast {

enum class HeadFit {
  Whole,     // all of it, to a groom that comes with no head
  BustOnly,  // neck and shoulders: the head is as it is
};

class HeadShape {
 public:
  /// `about`: where the head is and how large; for HeadFit::Whole a start, which is the sphere through the
  /// roots, else the size that make_head() takes. `groom` upright, face at +Z, in metres.
  HeadShape(const Groom& groom, const FittedSphere& about, HeadFit fit);

  /// The head as it is drawn, with normals.
  Mesh mesh() const;
  /// About how far a point is outside of the surface, m; negative inside.
  double distance_m(const glm::dvec3& point_m) const;

 private:
  void stretch_to_roots(const Groom& groom);
  void pull_to_roots(const Groom& groom);
  std::vector<double> deepest_dents(const Groom& groom) const;
  void give_way_to_hair(const Groom& groom);
  void narrow_neck(const Groom& groom);
  double distance_in_radii(const glm::dvec3& u) const;
  glm::dvec3 in_skull_radii(const glm::vec3& point_m) const;
  double pull_at(const glm::dvec3& u) const;
  void lower_shoulders(const Groom& groom);
  glm::dvec3 before_the_fit(const glm::dvec3& u) const;
  double before_the_drop(double y) const;
  double after_the_drop(double y) const;
  double neck_width_at(const glm::dvec3& u) const;

  glm::dvec3 center_m_;
  glm::dvec3 radius_m_;             // of the skull, by axis
  std::vector<double> pull_;        // (direction) factor on the built-in head's radius
  double drop_ = 0.0;               // of the shoulders, in skull radii
  std::vector<double> neck_width_;  // (height x azimuth) factor on the width of neck and bust
};

}  // namespace strandcast
