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
constexpr double kSmallestShare = 0.06;  // of the mesh's size: smaller balls are not worth a test per vertex
constexpr double kHiddenShare =
    0.25;  // of the mesh's size: a surface that faces another one so near is inside
constexpr uint64_t kMaxRayTests = 200'000'000;
// A sample further away than this share of the mesh's size counts as if it were so far: noses and ears do not
// draw the spheres away from where hair lies.
constexpr double kFarShare = 0.10;
/// Nearer than this is as good as there, m: below it the next sphere is worth more elsewhere.
constexpr double kNearEnoughM = 0.002;
constexpr int kChoiceRounds = 2;
/// Spheres that fill a mesh from within lie below it between where they touch it, and hair that lies there
/// would be covered by the skin: where no hair as loaded forbids it they come out of it by so much.
constexpr float kPlumpM = 0.006f;
// Surface so far from all hair, m, counts e times less, and no less than the least weight.
constexpr double kHairReachM = 0.04, kLeastWeight = 0.05;
constexpr size_t kHairPoints = 10'000;  // more of them say nothing new
constexpr double kReachSpareM = 0.02;   // samples stand that far apart, and strands stretch a little

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

/// By height.
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
  std::ranges::sort(targets, {}, [](const RayTarget& target) { return target.middle.y; });
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
  if (samples.empty() || uint64_t{samples.size()} * mesh.triangle.size() > kMaxRayTests) return samples;
  const std::vector<RayTarget> targets = ray_targets(mesh);
  double largest = 0.0;
  for (const RayTarget& target : targets) largest = std::max(largest, target.radius);
  const auto height_of = [](const RayTarget& target) { return target.middle.y; };
  std::vector<Sample> outer;
  for (const Sample& sample : samples) {
    const glm::dvec3 from = sample.point + kLift * reach * sample.normal;
    // What a ray hits has its middle within sqrt(2) radii of the ray's height.
    const auto [low, high] = std::minmax({from.y, from.y + reach * sample.normal.y});
    const auto begin = std::ranges::lower_bound(targets, low - 1.5 * largest, {}, height_of);
    const auto end = std::ranges::upper_bound(targets, high + 1.5 * largest, {}, height_of);
    const bool is_hidden = std::any_of(begin, std::max(begin, end), [&](const RayTarget& target) {
      return is_hit(target, from, sample.normal, reach);
    });
    if (!is_hidden) outer.push_back(sample);
  }
  return outer;
}

/// The largest ball that touches the surface at the sample from inside and holds no other of `points`, of
/// which the first `sample_count` are samples and the others free vertices of the hair.
Ball ball_at(const Sample& sample, const std::vector<glm::vec3>& points, size_t sample_count,
             const PointTree& tree, double largest_radius) {
  Ball ball{sample.point - largest_radius * sample.normal, largest_radius};
  for (int round = 0; round < kBallRounds; ++round) {
    const uint32_t nearest = tree.nearest(glm::vec3(ball.center), 1).front().index;
    const glm::dvec3 other(points[nearest]);
    const glm::dvec3 offset = sample.point - other;
    const double beside = glm::dot(sample.normal, offset);
    if (glm::length(other - ball.center) >= ball.radius * (1.0 - kTouching) || !(beside > 0.0)) break;
    const double radius = glm::dot(offset, offset) / (2.0 * beside);
    const glm::dvec3 center = sample.point - radius * sample.normal;
    if (radius >= ball.radius) break;
    const glm::dvec3 to_other = other - center;
    const bool is_noise = glm::dot(to_other, sample.normal) > kMinSeparation * glm::length(to_other);
    if (is_noise && nearest < sample_count) break;
    ball = {center, radius};
  }
  return ball;
}

/// Balls inside of the surface that hold no free vertex of the hair: those that touch the surface, and, where
/// hair cuts these short, those about the middle that they would have without it.
std::vector<Ball> candidates_of(const std::vector<Sample>& samples, const Groom& groom, double size) {
  std::vector<glm::vec3> surface;
  for (const Sample& sample : samples) surface.emplace_back(sample.point);
  std::vector<glm::vec3> all = surface;
  for (size_t i = 0; i < groom.rest_position_m.size(); ++i)
    if (groom.pinned[i] == 0) all.push_back(groom.rest_position_m[i]);
  const PointTree surface_tree(surface), all_tree(all);
  std::vector<Ball> balls;
  const auto add = [&](const Ball& ball) {
    if (ball.radius >= kSmallestShare * size) balls.push_back(ball);
  };
  for (size_t i = 0; i < samples.size(); i += kCandidateStep) {
    const Ball bald = ball_at(samples[i], surface, surface.size(), surface_tree, 0.5 * size);
    const auto nearest = all_tree.nearest(glm::vec3(bald.center), 1).front();
    const double clear =
        nearest.index < surface.size() ? bald.radius : std::sqrt(double{nearest.distance_squared});
    add({bald.center, std::min(bald.radius, clear)});
    if (clear < bald.radius) add(ball_at(samples[i], all, surface.size(), all_tree, 0.5 * size));
  }
  return balls;
}

/// Whether any strand is long enough to come within kReachSpareM of a point.
bool is_reached(const glm::dvec3& point, const std::vector<FittedSphere>& reach) {
  return std::any_of(reach.begin(), reach.end(), [&](const FittedSphere& strand) {
    const glm::dvec3 offset = point - glm::dvec3(strand.center_m);
    const double radius = static_cast<double>(strand.radius_m) + kReachSpareM;
    return glm::dot(offset, offset) <= radius * radius;
  });
}

/// How much each sample counts.
std::vector<double> weights_of(const std::vector<Sample>& samples, const Groom& groom) {
  std::vector<double> weights(samples.size(), 0.0);
  std::vector<FittedSphere> reach;  // about each root, as far as its strand
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    reach.push_back({groom.rest_position_m[groom.offset[strand]], groom.length_m(strand)});
  std::vector<glm::vec3> points;
  const std::vector<glm::vec3>& hair_m = groom.rest_position_m;
  for (size_t i = 0; i < hair_m.size(); i += hair_m.size() / kHairPoints + 1) points.push_back(hair_m[i]);
  const PointTree tree(points);
  for (size_t i = 0; i < samples.size(); ++i) {
    if (!is_reached(samples[i].point, reach)) continue;
    const double distance_m =
        std::sqrt(static_cast<double>(tree.nearest(glm::vec3(samples[i].point), 1).front().distance_squared));
    weights[i] = std::max(std::exp(-distance_m / kHairReachM), kLeastWeight);
  }
  return weights;
}

/// Which balls together come nearest to the samples, by the sum of squared distances.
class BallChoice {
 public:
  BallChoice(const std::vector<Ball>& balls, const std::vector<Sample>& samples, std::vector<double> weights,
             double far_off)
      : ball_count_(balls.size()), weights_(std::move(weights)), far_off_(static_cast<float>(far_off)) {
    distance_.reserve(samples.size() * balls.size());
    for (const Sample& sample : samples)
      for (const Ball& ball : balls)
        distance_.push_back(static_cast<float>(
            std::clamp(glm::length(sample.point - ball.center) - ball.radius - kNearEnoughM, 0.0, far_off)));
  }

  /// Each in turn takes most off what is left; then each is looked for once more, among the others.
  std::vector<size_t> choose(size_t count) const {
    std::vector<size_t> chosen;
    while (chosen.size() < count) {
      const size_t best = best_beside(chosen, chosen.size());
      if (best == ball_count_) break;
      chosen.push_back(best);
    }
    for (int round = 0; round < kChoiceRounds; ++round)
      for (size_t i = 0; i < chosen.size(); ++i) {
        const size_t best = best_beside(chosen, i);
        if (best != ball_count_) chosen[i] = best;
      }
    return chosen;
  }

 private:
  /// Returns the ball that covers most of what the chosen ones, except number `open`, leave; the number of
  /// balls where none covers anything.
  size_t best_beside(const std::vector<size_t>& chosen, size_t open) const {
    // Sample by sample for all balls at once, in vectors.
    std::vector<double> gain(ball_count_, 0.0);
    for (size_t k = 0; k < weights_.size(); ++k) {
      const float* const distance = distance_.data() + k * ball_count_;
      float left = far_off_;
      for (size_t i = 0; i < chosen.size(); ++i)
        if (i != open) left = std::min(left, distance[chosen[i]]);
      const auto before = static_cast<double>(left);
      for (size_t ball = 0; ball < ball_count_; ++ball) {
        const double after = std::min(before, static_cast<double>(distance[ball]));
        gain[ball] += weights_[k] * (before * before - after * after);
      }
    }
    double best_gain = 0.0;
    size_t best = ball_count_;
    for (size_t ball = 0; ball < ball_count_; ++ball)
      if (gain[ball] > best_gain) best_gain = gain[ball], best = ball;
    return best;
  }

  size_t ball_count_;
  std::vector<double> weights_;  // of the samples
  float far_off_;
  std::vector<float> distance_;  // (sample x ball) held to what counts
};

/// The spheres for samples that count as much as `weigh` says of them.
template <class Weigh>
std::vector<FittedSphere> fit_weighed(const Mesh& mesh, size_t count, const Groom& groom,
                                      const Weigh& weigh) {
  std::vector<FittedSphere> spheres;
  if (mesh.triangle.empty()) return spheres;
  const double size = size_of(mesh);
  const std::vector<Sample> samples = keep_outer(sample_surface(mesh), mesh, kHiddenShare * size);
  if (samples.empty() || !(size > 0.0)) return spheres;
  const std::vector<Ball> candidates = candidates_of(samples, groom, size);
  const BallChoice choice(candidates, samples, weigh(samples), kFarShare * size);
  for (const size_t index : choice.choose(count)) {
    const Ball& ball = candidates[index];
    spheres.push_back({glm::vec3(ball.center), static_cast<float>(ball.radius)});
  }
  return spheres;
}

}  // namespace

std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count, const Groom& groom) {
  return fit_weighed(mesh, count, groom,
                     [&](const std::vector<Sample>& samples) { return weights_of(samples, groom); });
}

std::vector<FittedSphere> fit_spheres(const Mesh& mesh, size_t count) {
  return fit_weighed(mesh, count, {}, [](const std::vector<Sample>& samples) {
    return std::vector<double>(samples.size(), 1.0);
  });
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
    sphere.radius_m = std::min(sphere.radius_m + kPlumpM, static_cast<float>(largest));
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
