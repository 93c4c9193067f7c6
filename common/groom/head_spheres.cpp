#include "common/groom/head_spheres.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/hash.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

constexpr uint32_t kSamples = 1'500;     // of the surface, spread by area
constexpr uint32_t kCandidateStep = 3;   // every third of them gives a ball
constexpr int kBallRounds = 32;          // of a ball that shrinks until it is inside
constexpr double kTouching = 1e-3;       // of its radius: no longer shrunk
constexpr double kMinSeparation = 0.87;  // cosine between its two touching points: nearer ones are noise
constexpr double kSmallestShare = 0.02;  // of the mesh's size: smaller balls are not worth a test per vertex
constexpr double kHiddenShare =
    0.25;  // of the mesh's size: a surface that faces another one so near is inside
constexpr uint64_t kMaxRayTests = 200'000'000;
// A sample further away than this share of the mesh's size counts as if it were so far: noses and ears do not
// draw the spheres away from where hair lies.
constexpr double kFarShare = 0.03;
// Surface so far from all hair, m, counts e times less, and no less than the least weight.
constexpr double kHairReachM = 0.04, kLeastWeight = 0.05;
constexpr size_t kHairPoints = 10'000;  // more of them say nothing new

struct Sample {
  glm::dvec3 point;
  glm::dvec3 normal;  // outwards
};

struct Ball {
  glm::dvec3 center;
  double radius = 0.0;
};

double volume_of(const Mesh& mesh) {
  double volume = 0.0;
  for (const glm::uvec3& corner : mesh.triangle)
    volume +=
        glm::dot(glm::dvec3(mesh.position_m[corner.x]),
                 glm::cross(glm::dvec3(mesh.position_m[corner.y]), glm::dvec3(mesh.position_m[corner.z])));
  return volume / 6.0;
}

/// Smallest side of the bounding box: no ball inside is wider.
double size_of(const Mesh& mesh) {
  glm::vec3 low = mesh.position_m.front(), high = low;
  for (const glm::vec3& point : mesh.position_m) {
    low = glm::min(low, point);
    high = glm::max(high, point);
  }
  const glm::dvec3 size = glm::dvec3(high) - glm::dvec3(low);
  return std::min({size.x, size.y, size.z});
}

/// Points spread evenly by area, with the normals of their triangles.
std::vector<Sample> sample_surface(const Mesh& mesh) {
  std::vector<double> area_up_to;
  double total = 0.0;
  for (const glm::uvec3& corner : mesh.triangle) {
    const glm::dvec3 a = mesh.position_m[corner.x], b = mesh.position_m[corner.y],
                     c = mesh.position_m[corner.z];
    total += 0.5 * glm::length(glm::cross(b - a, c - a));
    area_up_to.push_back(total);
  }
  std::vector<Sample> samples;
  if (!std::isfinite(total) || !(total > 0.0)) return samples;
  const double side = volume_of(mesh) < 0.0 ? -1.0 : 1.0;  // some files turn their triangles inwards
  size_t triangle = 0;
  for (uint32_t i = 0; i < kSamples; ++i) {
    const uint32_t hash = mix_u32(i);
    const double target = (i + 0.5) / kSamples * total;
    while (triangle + 1 < area_up_to.size() && area_up_to[triangle] < target) ++triangle;
    const glm::uvec3& corner = mesh.triangle[triangle];
    double u = unit_float(mix_u32(hash + 1)), v = unit_float(mix_u32(hash + 2));
    if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
    const glm::dvec3 a = mesh.position_m[corner.x], b = mesh.position_m[corner.y],
                     c = mesh.position_m[corner.z];
    const glm::dvec3 across = glm::cross(b - a, c - a);
    const double length = glm::length(across);
    if (length > 0.0) samples.push_back({a + u * (b - a) + v * (c - a), side / length * across});
  }
  return samples;
}

/// Where a ray meets a triangle (Moeller and Trumbore 1997), or infinity.
double hit_distance(const glm::dvec3& from, const glm::dvec3& along, const glm::dvec3& a, const glm::dvec3& b,
                    const glm::dvec3& c) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  const glm::dvec3 ab = b - a, ac = c - a, p = glm::cross(along, ac);
  const double determinant = glm::dot(ab, p);
  if (determinant == 0.0) return kNever;
  const glm::dvec3 offset = from - a, q = glm::cross(offset, ab);
  const double u = glm::dot(offset, p) / determinant, v = glm::dot(along, q) / determinant;
  const double distance = glm::dot(ac, q) / determinant;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 ? distance : kNever;
}

/// A triangle with the ball about its middle, which tells quickly that a ray misses it.
struct RayTarget {
  glm::dvec3 a, b, c;
  glm::dvec3 middle;
  double radius;
};

std::vector<RayTarget> ray_targets(const Mesh& mesh) {
  std::vector<RayTarget> targets;
  for (const glm::uvec3& corner : mesh.triangle) {
    RayTarget target{
        mesh.position_m[corner.x], mesh.position_m[corner.y], mesh.position_m[corner.z], {}, 0.0};
    target.middle = (target.a + target.b + target.c) / 3.0;
    target.radius = std::max({glm::length(target.a - target.middle), glm::length(target.b - target.middle),
                              glm::length(target.c - target.middle)});
    targets.push_back(target);
  }
  return targets;
}

bool is_hit(const RayTarget& target, const glm::dvec3& from, const glm::dvec3& along, double reach) {
  const glm::dvec3 offset = target.middle - from;
  const double ahead = glm::dot(offset, along);
  if (ahead < -target.radius || ahead > reach + target.radius) return false;
  if (glm::dot(offset, offset) - ahead * ahead > target.radius * target.radius) return false;
  return hit_distance(from, along, target.a, target.b, target.c) < reach;
}

/// Those that face no other part of the mesh within `reach`.
std::vector<Sample> keep_outer(const std::vector<Sample>& samples, const Mesh& mesh, double reach) {
  constexpr double kLift = 1e-3;  // of the reach: past the sample's own triangle
  if (uint64_t{samples.size()} * mesh.triangle.size() > kMaxRayTests) return samples;
  const std::vector<RayTarget> targets = ray_targets(mesh);
  std::vector<Sample> outer;
  for (const Sample& sample : samples) {
    const glm::dvec3 from = sample.point + kLift * reach * sample.normal;
    const bool is_hidden = std::any_of(targets.begin(), targets.end(), [&](const RayTarget& target) {
      return is_hit(target, from, sample.normal, reach);
    });
    if (!is_hidden) outer.push_back(sample);
  }
  return outer;
}

/// The largest ball that touches the surface at the sample from inside and holds no other sample.
Ball ball_at(const Sample& sample, const std::vector<Sample>& samples, const PointTree& tree,
             double largest_radius) {
  Ball ball{sample.point - largest_radius * sample.normal, largest_radius};
  for (int round = 0; round < kBallRounds; ++round) {
    const auto nearest = tree.nearest(glm::vec3(ball.center), 1);
    const glm::dvec3 other = samples[nearest.front().index].point;
    const glm::dvec3 offset = sample.point - other;
    const double beside = glm::dot(sample.normal, offset);
    if (glm::length(other - ball.center) >= ball.radius * (1.0 - kTouching) || !(beside > 0.0)) break;
    const double radius = glm::dot(offset, offset) / (2.0 * beside);
    const glm::dvec3 center = sample.point - radius * sample.normal;
    if (radius >= ball.radius) break;
    const glm::dvec3 to_other = other - center;
    if (glm::dot(to_other, sample.normal) > kMinSeparation * glm::length(to_other)) break;
    ball = {center, radius};
  }
  return ball;
}

/// How much each sample counts.
std::vector<double> weights_of(const std::vector<Sample>& samples, std::span<const glm::vec3> hair_m) {
  std::vector<double> weights(samples.size(), 1.0);
  if (hair_m.empty()) return weights;
  std::vector<glm::vec3> points;
  for (size_t i = 0; i < hair_m.size(); i += hair_m.size() / kHairPoints + 1) points.push_back(hair_m[i]);
  const PointTree tree(points);
  for (size_t i = 0; i < samples.size(); ++i) {
    const double distance_m =
        std::sqrt(static_cast<double>(tree.nearest(glm::vec3(samples[i].point), 1).front().distance_squared));
    weights[i] = std::max(std::exp(-distance_m / kHairReachM), kLeastWeight);
  }
  return weights;
}

}  // namespace

std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count, std::span<const glm::vec3> hair_m) {
  std::vector<FittedSphere> spheres;
  if (mesh.triangle.empty()) return spheres;
  const double size = size_of(mesh);
  const std::vector<Sample> samples = keep_outer(sample_surface(mesh), mesh, kHiddenShare * size);
  if (samples.empty() || !(size > 0.0)) return spheres;
  std::vector<glm::vec3> points;
  for (const Sample& sample : samples) points.emplace_back(sample.point);
  const PointTree tree(points);
  std::vector<Ball> candidates;
  for (size_t i = 0; i < samples.size(); i += kCandidateStep) {
    const Ball ball = ball_at(samples[i], samples, tree, 0.5 * size);
    if (ball.radius >= kSmallestShare * size) candidates.push_back(ball);
  }
  const std::vector<double> weights = weights_of(samples, hair_m);
  // Each choice takes most off the squared distances that are left.
  const double far_off = kFarShare * size;
  std::vector<double> left(samples.size(), far_off);
  while (spheres.size() < count) {
    double best_gain = 0.0;
    const Ball* best = nullptr;
    for (const Ball& ball : candidates) {
      double gain = 0.0;
      for (size_t i = 0; i < samples.size(); ++i) {
        const double distance = std::max(glm::length(samples[i].point - ball.center) - ball.radius, 0.0);
        if (distance < left[i]) gain += weights[i] * (left[i] * left[i] - distance * distance);
      }
      if (gain > best_gain) best_gain = gain, best = &ball;
    }
    if (best == nullptr) break;
    for (size_t i = 0; i < samples.size(); ++i)
      left[i] = std::min(left[i], std::max(glm::length(samples[i].point - best->center) - best->radius, 0.0));
    spheres.push_back({glm::vec3(best->center), static_cast<float>(best->radius)});
  }
  return spheres;
}

std::vector<FittedSphere> built_in_head_spheres(float radius_m) {
  static const std::vector<FittedSphere> kOfUnitHead = fit_spheres(make_head(1.0f), kHeadSpheres);
  std::vector<FittedSphere> spheres = kOfUnitHead;
  for (FittedSphere& sphere : spheres) {
    sphere.center_m *= radius_m;
    sphere.radius_m *= radius_m;
  }
  return spheres;
}

std::vector<FittedSphere> shrink_under(std::vector<FittedSphere> spheres, const Groom& groom) {
  for (FittedSphere& sphere : spheres) {
    constexpr double kFar = std::numeric_limits<double>::max();
    double nearest_squared[2] = {kFar, kFar};  // of free and of pinned vertices
    for (size_t i = 0; i < groom.rest_position_m.size(); ++i) {
      const glm::dvec3 offset = glm::dvec3(groom.rest_position_m[i]) - glm::dvec3(sphere.center_m);
      double& nearest = nearest_squared[groom.pinned[i] != 0 ? 1 : 0];
      nearest = std::min(nearest, glm::dot(offset, offset));
    }
    const double largest = std::min(std::sqrt(nearest_squared[0]),
                                    std::sqrt(nearest_squared[1]) + static_cast<double>(kSwallowedM));
    sphere.radius_m = std::min(sphere.radius_m, static_cast<float>(largest));
  }
  std::erase_if(spheres, [](const FittedSphere& sphere) { return sphere.radius_m <= 2.0f * kSwallowedM; });
  return spheres;
}

double distance_to_spheres_m(const std::vector<FittedSphere>& spheres, const glm::dvec3& point_m) {
  double distance = std::numeric_limits<double>::max();
  for (const FittedSphere& sphere : spheres)
    distance = std::min(
        distance, glm::length(point_m - glm::dvec3(sphere.center_m)) - static_cast<double>(sphere.radius_m));
  return distance;
}

}  // namespace strandcast
