#include "common/strands/head/head_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

// Four fill a register that every processor has.
#define STRANDCAST_LANE_COUNT 4
#include "common/simd/lanes.h"

namespace strandcast {
namespace {

enum class Shape { Ellipsoid, Capsule };
enum class Blend { Add, Cut, Within };

/// One part of the head. Parts off the middle are given once and mirrored.
struct Part {
  Shape shape;
  Blend blend;
  float softness;     // width of the blend with what is there already
  glm::vec3 from;     // centre of the ellipsoid, or one end of the capsule
  glm::vec3 to;       // radii of the ellipsoid, or the other end of the capsule
  float from_radius;  // of the capsule
  float to_radius;
};

Part ellipsoid(Blend blend, float softness, const glm::vec3& center, const glm::vec3& radii) {
  return {Shape::Ellipsoid, blend, softness, center, radii, 0.0f, 0.0f};
}
Part capsule(Blend blend, float softness, const glm::vec3& from, float from_radius, const glm::vec3& to,
             float to_radius) {
  return {Shape::Capsule, blend, softness, from, to, from_radius, to_radius};
}

// Proportions of an adult: eyes at half of the head's height, nose down to half of the rest, mouth at a third
// of that; the sternum a third of a head's height below the chin, shoulders twice as wide as the head. The
// face is a mannequin's, without eyes: nobody misses brows and lashes there.
const std::array kBust = {
    capsule(Blend::Add, 0.00f, {0.20f, -1.75f, -0.50f}, 0.30f, {1.25f, -2.55f, -0.48f},
            0.30f),                                                                // nape to shoulder
    ellipsoid(Blend::Add, 0.30f, {1.48f, -2.78f, -0.42f}, {0.46f, 0.46f, 0.46f}),  // shoulder
    ellipsoid(Blend::Add, 0.45f, {0.00f, -3.20f, -0.36f}, {1.45f, 0.95f, 0.82f}),  // chest and back
    capsule(Blend::Add, 0.20f, {0.14f, -2.47f, 0.06f}, 0.06f, {1.25f, -2.44f, -0.22f}, 0.06f),  // collarbone
    ellipsoid(Blend::Within, 0.20f, {0.00f, -2.10f, -0.40f}, {2.05f, 1.75f, 1.45f}),  // down to where it ends
    capsule(Blend::Add, 0.30f, {0.00f, -0.70f, -0.14f}, 0.51f, {0.00f, -2.10f, -0.38f}, 0.50f),  // neck
    capsule(Blend::Add, 0.14f, {0.52f, -0.95f, -0.12f}, 0.09f, {0.13f, -2.20f, 0.10f},
            0.07f),  // throat's side
};
const std::array kHead = {
    ellipsoid(Blend::Add, 0.16f, {0.00f, 0.00f, 0.00f}, {0.985f, 0.985f, 0.985f}),             // cranium
    ellipsoid(Blend::Add, 0.20f, {0.00f, -0.52f, 0.30f}, {0.76f, 0.82f, 0.63f}),               // face
    capsule(Blend::Add, 0.34f, {0.46f, -0.82f, 0.04f}, 0.15f, {0.12f, -1.21f, 0.70f}, 0.14f),  // jaw
    ellipsoid(Blend::Add, 0.20f, {0.00f, -0.90f, 0.36f}, {0.44f, 0.38f, 0.48f}),               // its floor
    ellipsoid(Blend::Add, 0.20f, {0.00f, -1.23f, 0.76f}, {0.17f, 0.15f, 0.17f}),               // chin
    ellipsoid(Blend::Add, 0.24f, {0.50f, -0.38f, 0.60f}, {0.20f, 0.13f, 0.22f}),               // cheekbone
    ellipsoid(Blend::Add, 0.18f, {0.00f, -0.84f, 0.70f}, {0.37f, 0.27f, 0.26f}),  // round the mouth
    ellipsoid(Blend::Cut, 0.26f, {0.36f, -0.20f, 1.06f}, {0.26f, 0.15f, 0.22f}),  // eye socket
    capsule(Blend::Add, 0.22f, {0.08f, 0.02f, 0.88f}, 0.05f, {0.46f, 0.04f, 0.74f}, 0.04f),      // brow
    capsule(Blend::Add, 0.14f, {0.00f, -0.12f, 0.86f}, 0.055f, {0.00f, -0.52f, 1.06f}, 0.080f),  // nose
    ellipsoid(Blend::Add, 0.10f, {0.00f, -0.565f, 1.06f}, {0.105f, 0.080f, 0.11f}),              // its tip
    ellipsoid(Blend::Add, 0.10f, {0.10f, -0.585f, 0.98f}, {0.065f, 0.060f, 0.10f}),              // its wing
    capsule(Blend::Add, 0.14f, {0.050f, -0.835f, 0.935f}, 0.045f, {0.22f, -0.880f, 0.850f},
            0.025f),  // upper lip
    capsule(Blend::Add, 0.14f, {0.050f, -0.955f, 0.920f}, 0.055f, {0.20f, -0.915f, 0.850f},
            0.025f),  // lower lip
    capsule(Blend::Cut, 0.10f, {0.00f, -0.892f, 1.020f}, 0.018f, {0.20f, -0.896f, 0.955f}, 0.008f),  // mouth
    ellipsoid(Blend::Cut, 0.12f, {0.00f, -1.07f, 0.97f}, {0.15f, 0.04f, 0.07f}),      // below the lips
    ellipsoid(Blend::Add, 0.05f, {0.970f, -0.24f, 0.00f}, {0.075f, 0.27f, 0.155f}),   // ear
    ellipsoid(Blend::Cut, 0.05f, {1.060f, -0.21f, 0.02f}, {0.050f, 0.18f, 0.090f}),   // its shell
    ellipsoid(Blend::Add, 0.04f, {0.985f, -0.30f, 0.115f}, {0.045f, 0.06f, 0.045f}),  // its flap
};

/// How much distances from two parts change at most, beside the way of a point.
constexpr float kSpread = 2.0f;

/// Mirrored parts meet round, not in a crease, over this width.
constexpr float kSeam = 0.04f;

/// Points side by side.
struct LanePoints {
  simd::Float x, y, z;
};

simd::Float length_of(const LanePoints& v) {
  return simd::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

LanePoints from_point(const LanePoints& points, const glm::vec3& point) {
  return {points.x - point.x, points.y - point.y, points.z - point.z};
}

LanePoints over(const LanePoints& v, const glm::vec3& divisor) {
  return {v.x / divisor.x, v.y / divisor.y, v.z / divisor.z};
}

simd::Float ellipsoid_distance(const LanePoints& offset, const glm::vec3& radii) {
  const simd::Float scaled = length_of(over(offset, radii));
  const simd::Float slope = length_of(over(offset, radii * radii));
  return simd::select(slope > 0.0f, scaled * (scaled - 1.0f) / slope,
                      simd::Float(-std::min({radii.x, radii.y, radii.z})));
}

simd::Float capsule_distance(const LanePoints& offset, const Part& part) {
  const glm::vec3 axis = part.to - part.from;
  const simd::Float way = offset.x * axis.x + offset.y * axis.y + offset.z * axis.z;
  const simd::Float along = simd::clamp(way / glm::dot(axis, axis), 0.0f, 1.0f);
  const LanePoints across = {offset.x - along * axis.x, offset.y - along * axis.y, offset.z - along * axis.z};
  return length_of(across) - (part.from_radius * (1.0f - along) + part.to_radius * along);
}

bool is_in_the_middle(const Part& part) {
  return part.from.x == 0.0f && (part.shape == Shape::Ellipsoid || part.to.x == 0.0f);
}

/// Smaller of two distances with a rounded seam (polynomial smooth minimum).
simd::Float smooth_min(simd::Float a, simd::Float b, float softness) {
  if (softness <= 0.0f) return simd::min(a, b);
  const simd::Float near = simd::max(softness - simd::abs(a - b), 0.0f) / softness;
  return simd::min(a, b) - near * near * softness * 0.25f;
}

/// Which parts are looked at; all others must change nothing.
using Wanted = uint32_t;
constexpr Wanted kAllParts = ~Wanted{0};
static_assert(kBust.size() + kHead.size() <= 32);
constexpr Wanted kHeadParts = kAllParts << kBust.size();

/// Takes parts to the distance of what there is already; beside(i, own, distance) sees each before that.
template <class Beside>
simd::Float with_parts(simd::Float distance, std::span<const Part> parts, Wanted wanted,
                       const LanePoints& points, const Beside& beside) {
  LanePoints mirrored = points;
  for (uint32_t lane = 0; lane < simd::kLanes; ++lane) {
    const double x = double{points.x.v[lane]};
    mirrored.x.v[lane] = static_cast<float>(std::sqrt(x * x + double{kSeam} * double{kSeam}));
  }
  for (uint32_t i = 0; wanted >> i != 0 && i < parts.size(); ++i) {
    if ((wanted >> i & 1u) == 0) continue;
    const Part& part = parts[i];
    const LanePoints offset = from_point(is_in_the_middle(part) ? points : mirrored, part.from);
    const simd::Float own =
        part.shape == Shape::Ellipsoid ? ellipsoid_distance(offset, part.to) : capsule_distance(offset, part);
    beside(i, own, distance);
    switch (part.blend) {
      case Blend::Add:
        distance = smooth_min(distance, own, part.softness);
        break;
      case Blend::Cut:
        distance = -smooth_min(-distance, own, part.softness);
        break;
      case Blend::Within:
        distance = -smooth_min(-distance, -own, part.softness);
        break;
    }
  }
  return distance;
}

simd::Float distance_of(const LanePoints& points, Wanted wanted) {
  const auto nothing = [](uint32_t, const simd::Float&, const simd::Float&) {};
  const simd::Float bust =
      with_parts(std::numeric_limits<float>::max(), kBust, wanted & ~kHeadParts, points, nothing);
  return with_parts(bust, kHead, wanted >> kBust.size(), points, nothing);
}

/// Parts that come close enough to change a distance near a point, if distances change by `margin`.
Wanted parts_near(const glm::vec3& about, float margin) {
  Wanted wanted = 0;
  const auto look_at = [&](std::span<const Part> parts, uint32_t first) {
    return [&wanted, parts, first, margin](uint32_t i, const simd::Float& own, const simd::Float& distance) {
      const float is = own.v[0], was = distance.v[0];
      const Blend blend = parts[i].blend;
      const float apart = blend == Blend::Add ? is - was : blend == Blend::Cut ? is + was : was - is;
      if (apart < parts[i].softness + margin) wanted |= Wanted{1} << (first + i);
    };
  };
  const LanePoints points{about.x, about.y, about.z};
  const simd::Float bust =
      with_parts(std::numeric_limits<float>::max(), kBust, kAllParts, points, look_at(kBust, 0));
  with_parts(bust, kHead, kAllParts, points, look_at(kHead, kBust.size()));
  return wanted;
}

/// As many as there are points.
std::vector<float> distances_of(Wanted wanted, std::span<const glm::vec3> points) {
  std::vector<float> distances(points.size());
  for (size_t begin = 0; begin < points.size(); begin += simd::kLanes) {
    const size_t count = std::min<size_t>(simd::kLanes, points.size() - begin);
    LanePoints lanes{0.0f, 0.0f, 0.0f};
    for (size_t i = 0; i < count; ++i) {
      const glm::vec3& point = points[begin + i];
      lanes.x.v[i] = point.x, lanes.y.v[i] = point.y, lanes.z.v[i] = point.z;
    }
    const simd::Float found = distance_of(lanes, wanted);
    for (size_t i = 0; i < count; ++i) distances[begin + i] = found.v[i];
  }
  return distances;
}

std::vector<glm::vec3> normals_of(Wanted wanted, std::span<const glm::vec3> points) {
  constexpr float kStep = 2e-3f;
  std::vector<glm::vec3> slopes(points.size()), moved(points.begin(), points.end());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < points.size(); ++i) moved[i][axis] = points[i][axis] + kStep;
    const std::vector<float> above = distances_of(wanted, moved);
    for (size_t i = 0; i < points.size(); ++i) moved[i][axis] = points[i][axis] - kStep;
    const std::vector<float> below = distances_of(wanted, moved);
    for (size_t i = 0; i < points.size(); ++i) {
      slopes[i][axis] = above[i] - below[i];
      moved[i][axis] = points[i][axis];
    }
  }
  for (glm::vec3& slope : slopes) {
    const float length = glm::length(slope);
    slope = length > 0.0f ? slope / length : glm::vec3(0.0f, 1.0f, 0.0f);
  }
  return slopes;
}

}  // namespace

NearHead::NearHead(const glm::vec3& about, float reach) : parts_(parts_near(about, kSpread * reach)) {}

std::vector<float> NearHead::distances(std::span<const glm::vec3> points) const {
  return distances_of(parts_, points);
}

std::vector<glm::vec3> NearHead::normals(std::span<const glm::vec3> points) const {
  return normals_of(parts_, points);
}

float bust_distance(const glm::vec3& point) {
  return distances_of(~kHeadParts, {&point, 1}).front();
}

glm::vec3 bust_normal(const glm::vec3& point) {
  return normals_of(~kHeadParts, {&point, 1}).front();
}

float head_distance(const glm::vec3& point) {
  return distance_of({point.x, point.y, point.z}, kAllParts).v[0];
}

std::vector<float> head_distances(std::span<const glm::vec3> points) {
  return distances_of(kAllParts, points);
}

std::vector<glm::vec3> head_normals(std::span<const glm::vec3> points) {
  return normals_of(kAllParts, points);
}

}  // namespace strandcast
