#include "common/groom/mesh_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <utility>
#include <vector>

#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/groom/head_fit.h"
#include "common/groom/placement.h"
#include "common/math/point_tree.h"
#include "common/math/rigid_fit.h"

namespace strandcast {
namespace {

constexpr size_t kSurfacePoints = 20'000, kMostRoots = 300;
/// Roots of which half, or some, are further than this from the skin are not on it: loose caps of hair stand
/// off by 10 mm.
constexpr float kFarM = 0.02f, kFarthestM = 0.03f;
/// A turn is told when it brings nearly all roots this near, and at least twice as near as they are. Nearer
/// ones are where they belong.
constexpr float kNearM = 0.008f, kCloseM = 0.005f;
constexpr double kNearlyAll = 0.95;
/// Likewise a movement, of half of the roots so far: less is what hair stands off.
constexpr float kMovedM = 0.015f;

/// Points all over a surface, by area.
std::vector<glm::vec3> spread_over(const Mesh& mesh) {
  std::vector<double> area_up_to;
  double total = 0.0;
  for (const glm::uvec3& corner : mesh.triangle) {
    const glm::dvec3 a = mesh.position_m[corner.x], b = mesh.position_m[corner.y],
                     c = mesh.position_m[corner.z];
    area_up_to.push_back(total += 0.5 * glm::length(glm::cross(b - a, c - a)));
  }
  std::vector<glm::vec3> points = mesh.position_m;
  for (size_t i = 0; i < kSurfacePoints && total > 0.0; ++i) {
    const double at = total * (static_cast<double>(i) + 0.5) / kSurfacePoints;
    const auto found = std::lower_bound(area_up_to.begin(), area_up_to.end(), at) - area_up_to.begin();
    const glm::uvec3& corner = mesh.triangle[std::min(static_cast<size_t>(found), mesh.triangle.size() - 1)];
    // Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018: R2, folded into a triangle.
    double u = std::fmod(0.7548776662466927 * static_cast<double>(i + 1), 1.0);
    double v = std::fmod(0.5698402909980532 * static_cast<double>(i + 1), 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const glm::dvec3 a = mesh.position_m[corner.x], b = mesh.position_m[corner.y],
                     c = mesh.position_m[corner.z];
    points.emplace_back(a + u * (b - a) + v * (c - a));
  }
  return points;
}

/// What a mesh may have been: as large, and turned so about the files' origin.
struct Change {
  float scale = 1.0f;
  glm::mat3 turn{1.0f};
};

/// What a mesh may have been moved by: a skull is nearly round, so that turns are only asked for where no
/// shift will do.
enum class Freedom { Shift, ShiftAndTurn };

class MeshFit {
 public:
  MeshFit(const Mesh& head, const Groom& groom, const glm::vec3& origin_m)
      : surface_m_(spread_over(head)), tree_(surface_m_), origin_m_(origin_m) {
    const std::vector<glm::vec3> roots = roots_of(groom);
    for (size_t i = 0; i < roots.size(); i += roots.size() / kMostRoots + 1) roots_m_.push_back(roots[i]);
  }

  /// How far this share of the roots are at most from the changed mesh.
  float distance_m(const Change& change, double share) const {
    std::vector<float> distances;
    for (const glm::vec3& root : roots_m_) {
      const glm::vec3 before = glm::transpose(change.turn) * (root - origin_m_) / change.scale + origin_m_;
      distances.push_back(change.scale * std::sqrt(tree_.nearest(before, 1).front().distance_squared));
    }
    return quantile(distances, share);
  }

  /// A movement that takes roots onto the mesh, from a first shift on: Besl, McKay, "A Method for
  /// Registration of 3-D Shapes", 1992.
  Pose onto_mesh(const glm::dvec3& first_shift_m, Freedom freedom) const {
    constexpr int kMostFits = 60;
    constexpr double kStillM = 1e-4;
    const std::vector<glm::dvec3> from(roots_m_.begin(), roots_m_.end());
    std::vector<glm::dvec3> to(from.size());
    Pose pose{first_shift_m, {1, 0, 0, 0}};
    for (int i = 0; i < kMostFits; ++i) {
      for (size_t root = 0; root < from.size(); ++root)
        to[root] = surface_m_[tree_.nearest(glm::vec3(pose * from[root]), 1).front().index];
      const Pose shifted{middle_of(to) - middle_of(from), {1, 0, 0, 0}};
      const Pose before =
          std::exchange(pose, freedom == Freedom::Shift ? shifted : rigid_fit(from, to, pose.rotation));
      double moved_m = 0.0;
      for (const glm::dvec3& root : from)
        moved_m = std::max(moved_m, glm::distance(before * root, pose * root));
      if (moved_m < kStillM) break;
    }
    return pose;
  }
  /// How far nearly all roots are from the mesh then.
  float distance_m(const Pose& pose) const {
    std::vector<float> distances;
    for (const glm::vec3& root : roots_m_)
      distances.push_back(
          std::sqrt(tree_.nearest(glm::vec3(pose * glm::dvec3(root)), 1).front().distance_squared));
    return quantile(distances, kNearlyAll);
  }
  /// How far half of the roots go.
  float moved_m(const Pose& pose) const {
    std::vector<float> distances;
    for (const glm::vec3& root : roots_m_)
      distances.push_back(glm::distance(root, glm::vec3(pose * glm::dvec3(root))));
    return median(std::move(distances));
  }
  glm::dvec3 middle_of_roots_m() const { return middle_of(roots_m_); }
  glm::dvec3 middle_of_mesh_m() const { return middle_of(surface_m_); }

 private:
  template <class Point>
  static glm::dvec3 middle_of(const std::vector<Point>& points) {
    glm::dvec3 sum(0.0);
    for (const Point& point : points) sum += glm::dvec3(point) / static_cast<double>(points.size());
    return sum;
  }
  const std::vector<glm::vec3> surface_m_;
  const PointTree tree_;
  const glm::vec3 origin_m_;
  std::vector<glm::vec3> roots_m_;
};

struct Named {
  Change change;
  std::string text;
};

/// Turns by quarters, and finer ones about Y.
std::vector<Named> usual_turns() {
  constexpr std::array<std::pair<float, char>, 6> kTilts = {
      {{0.0f, 'X'}, {90.0f, 'X'}, {-90.0f, 'X'}, {180.0f, 'X'}, {90.0f, 'Z'}, {-90.0f, 'Z'}}};
  std::vector<Named> turns;
  for (const auto& [tilt_deg, axis] : kTilts)
    for (float yaw_deg = -165.0f; yaw_deg <= 180.0f; yaw_deg += tilt_deg == 0.0f ? 15.0f : 90.0f) {
      if (tilt_deg != 0.0f && yaw_deg == -165.0f) yaw_deg = -90.0f;
      if (tilt_deg == 0.0f && yaw_deg == 0.0f) continue;
      const glm::vec3 about(axis == 'X' ? 1.0f : 0.0f, 0.0f, axis == 'Z' ? 1.0f : 0.0f);
      const glm::quat turn = glm::angleAxis(glm::radians(yaw_deg), glm::vec3(0, 1, 0)) *
                             glm::angleAxis(glm::radians(tilt_deg), about);
      std::string text;
      if (tilt_deg != 0.0f) text += fmt::format(" by {:g} degrees about {}", tilt_deg, axis);
      if (yaw_deg != 0.0f)
        text += fmt::format("{} by {:g} degrees about Y", text.empty() ? "" : " and then", yaw_deg);
      turns.push_back({{1.0f, glm::mat3_cast(turn)}, "turned" + text});
    }
  return turns;
}

/// "1600 mm", "3.2 mm".
std::string text_mm(float distance_m) {
  const double mm = static_cast<double>(distance_m) * kMmPerM;
  return mm < 10.0 ? fmt::format("{:.2g} mm", mm) : fmt::format("{:.0f} mm", mm);
}

/// The movement of the mesh that brings nearly all roots nearer to it than `least_m`, in words; empty where
/// there is none that is one.
std::string likely_movement(const MeshFit& fit, float least_m) {
  const glm::dvec3 middle_m = fit.middle_of_roots_m();
  for (const Freedom freedom : {Freedom::Shift, Freedom::ShiftAndTurn})
    for (const glm::dvec3& first_m : {glm::dvec3(0.0), fit.middle_of_mesh_m() - middle_m}) {
      const Pose pose = fit.onto_mesh(first_m, freedom);
      const float distance_m = fit.distance_m(pose);
      if (!(distance_m < least_m) || fit.moved_m(pose) < kMovedM) continue;
      const glm::dvec3 off_mm = kMmPerM * (middle_m - pose * middle_m);
      const double turned_deg = glm::degrees(angle_between_rad(pose.rotation, {1, 0, 0, 0}));
      return fmt::format("{} if it is moved by about ({:.0f}, {:.0f}, {:.0f}) mm{}", text_mm(distance_m),
                         off_mm.x, off_mm.y, off_mm.z,
                         freedom == Freedom::Shift
                             ? std::string()
                             : fmt::format(" and turned by {:.0f} degrees", turned_deg));
    }
  return {};
}

}  // namespace

std::string unfit_mesh(const Mesh& head, const Groom& groom, const glm::vec3& file_origin_m) {
  if (head.triangle.empty() || groom.strand_count() == 0) return {};
  const MeshFit fit(head, groom, file_origin_m);
  const float half_m = fit.distance_m({}, 0.5), most_m = fit.distance_m({}, kNearlyAll);
  if (most_m < kCloseM) return {};
  const bool is_far = half_m > kFarM || most_m > kFarthestM;
  std::vector<Named> others = usual_turns();
  if (is_far)
    for (const float scale : kUnitRatios)
      others.push_back({{scale, glm::mat3(1.0f)}, fmt::format("made {:.4g} times as large", scale)});
  const Named* best = nullptr;
  float least_m = is_far ? kFarM : std::min(kNearM, 0.5f * most_m);
  for (const Named& other : others) {
    const float distance_m = fit.distance_m(other.change, kNearlyAll);
    if (distance_m >= least_m) continue;
    best = &other;
    least_m = distance_m;
  }
  const std::string apart =
      fmt::format("the head's mesh does not fit: roots are up to {} from it", text_mm(most_m));
  if (best != nullptr) return fmt::format("{}, and {} if it is {}", apart, text_mm(least_m), best->text);
  if (const std::string moved = likely_movement(fit, least_m); !moved.empty())
    return apart + ", and " + moved;
  return is_far ? apart + ", and no usual turn, size or movement brings it there" : std::string();
}

}  // namespace strandcast
