// FollowedSkin: what strands that follow others do not enter: the spheres or the field that simulated ones
// collide with, and the bust's pose. Head space throughout. Plain data and pure functions, any thread; no
// friction, which only a step can know.
#pragma once

#include <glm/glm.hpp>
#include <memory>
#include <vector>

#include "common/groom/distance_field.h"
#include "common/kernels/step_input.h"
#include "common/math/sphere_collider.h"

namespace strandcast {

struct FollowedSkin {
  std::vector<SphereCollider> spheres;         // where the bust has them
  std::shared_ptr<const DistanceField> field;  // of the skin at rest; null: none
  BustInput bust;

  /// A segment, m, and where the groom has both ends.
  struct Segment {
    glm::vec3 start{0.0f}, end{0.0f};
    glm::vec3 groomed_start{0.0f}, groomed_end{0.0f};
  };

  bool exists() const { return !spheres.empty() || field != nullptr; }
  /// False where a segment of this length that ends there touches nothing. `room_m`: that its start had to
  /// the field, at least; becomes that of its end.
  bool may_touch(const glm::vec3& end_m, float length_m, float& room_m) const;
  /// The end of the segment turned about its start, at its length, until it lies outside. What the groom has
  /// inside may stay as deep.
  glm::vec3 turned_out(const Segment& segment) const;

 private:
  glm::vec3 out_of_spheres(const Segment& segment) const;
  glm::vec3 out_of_field(const Segment& segment) const;
};

}  // namespace strandcast
