// HeadField: the built-in head as an implicit surface: rounded shapes, blended smoothly. Lengths are in skull
// radii about the skull's centre; +Y up, +Z out of the face. Any thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <vector>

namespace strandcast {

/// Returns the approximate signed distance to the surface of head and bust, negative inside. The surface is
/// closed.
float head_distance(const glm::vec3& point);

/// Returns head_distance() of each point, four at a time: a quarter of the time.
std::vector<float> head_distances(std::span<const glm::vec3> points);

/// Returns the outward unit normals of the surfaces through `points`.
std::vector<glm::vec3> head_normals(std::span<const glm::vec3> points);

/// The head near a point: as head_distances() and head_normals(), of the parts alone that matter there.
class NearHead {
 public:
  /// For points within `reach` of `about`, on the surface or a few reaches away.
  NearHead(const glm::vec3& about, float reach);

  std::vector<float> distances(std::span<const glm::vec3> points) const;
  std::vector<glm::vec3> normals(std::span<const glm::vec3> points) const;

 private:
  uint32_t parts_;
};

/// Distance and normal of neck and bust alone.
float bust_distance(const glm::vec3& point);
glm::vec3 bust_normal(const glm::vec3& point);

// Box that holds the whole surface.
inline constexpr glm::vec3 kHeadLow{-2.15f, -4.0f, -1.95f};
inline constexpr glm::vec3 kHeadHigh{2.15f, 1.1f, 1.4f};

}  // namespace strandcast
