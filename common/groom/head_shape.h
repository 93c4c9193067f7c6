// HeadShape: the built-in head, fitted under a groom. It is stretched to an ellipsoid through the roots, then
// pulled to the roots and away from other hair, direction by direction. Shoulders sink instead, and shoulders
// and neck become narrower. Immutable; any thread. The same groom gives the same shape.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/groom/groom.h"
#include "common/groom/mesh.h"
#include "common/strands/head/head_form.h"

namespace strandcast {

enum class HeadFit {
  Whole,     // all of it, to a groom that comes with no head
  BustOnly,  // neck and shoulders: the head is as it is
};

class HeadShape {
 public:
  /// Fits the head to `groom`, which is upright in metres with its face at +Z. `about` is position and size
  /// of the head: for HeadFit::Whole a first guess (the sphere through the roots), otherwise the size passed
  /// to make_head().
  HeadShape(const Groom& groom, const FittedSphere& about, HeadFit fit);

  /// Returns the head's mesh, with normals and its form.
  Mesh mesh() const { return make_head(form_); }
  /// Returns the approximate signed distance of a point from the surface in metres; negative inside.
  double distance_m(const glm::dvec3& point_m) const;

 private:
  void stretch_to_roots(const Groom& groom);
  void pull_to_roots(const Groom& groom);
  std::vector<double> deepest_dents(const Groom& groom) const;
  void give_way_to_hair(const Groom& groom);
  void narrow_neck(const Groom& groom);
  double distance_in_radii(const glm::dvec3& u) const;
  glm::dvec3 in_skull_radii(const glm::vec3& point_m) const;
  void lower_shoulders(const Groom& groom);
  glm::dvec3 before_the_fit(const glm::dvec3& u) const;
  double before_the_drop(double y) const;

  HeadForm form_;
};

}  // namespace strandcast
