// SphereCollider: a sphere that strands do not penetrate. Plain data, any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace strandcast {

struct SphereCollider {
  glm::vec3 center_m{0.0f};  // head space: colliders follow the head
  float radius_m = 0.1f;

  bool operator==(const SphereCollider&) const = default;
};
inline constexpr uint32_t kMaxSphereColliders = 16;

}  // namespace strandcast
