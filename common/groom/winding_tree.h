// WindingTree: computes the winding number of triangles about a point. Immutable; any thread.
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

namespace strandcast {

using Triangle = std::array<glm::dvec3, 3>;  // counter-clockwise seen from outside

class WindingTree {
 public:
  /// Builds the tree; needs at least one triangle, and every triangle must have an area.
  explicit WindingTree(const std::vector<Triangle>& triangles);

  /// Returns the generalised winding number: 1 inside a closed mesh, 0 outside, in between near holes.
  /// Distant triangles count as one dipole (Barill and others 2018, "Fast winding numbers for soups and
  /// clouds", section 4, first order). The error is some hundredths.
  double winding_number(const glm::dvec3& point) const;

 private:
  struct Node {
    glm::dvec3 center{0.0};       // of the area
    glm::dvec3 area{0.0};         // vector
    double far_squared = 0.0;     // beyond which it counts as one
    uint32_t begin = 0, end = 0;  // triangles
    uint32_t right = 0;           // the left child comes next; 0 = a leaf
  };
  uint32_t build(uint32_t begin, uint32_t end);

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
};

}  // namespace strandcast
