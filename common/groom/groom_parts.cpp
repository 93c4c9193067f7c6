#include "common/groom/groom_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "common/base/quantile.h"
#include "common/groom/head_fit.h"
#include "common/groom/placement.h"

namespace strandcast {
namespace {

/// Fewer strands say nothing of a head.
constexpr uint32_t kMinStrands = 64;

/// What the points at one end of all strands are like.
struct StrandEnd {
  double off = 1.0;  // how far most are from the sphere through them, in radii; 1 where they lie in a plane
  double outwards = 0.0;  // mean cosine between the way on along the strand and that out of the sphere
};

enum class End { First, Last };

/// The sphere through points. Through what lies in a plane there are many: in place of one far away that with
/// its middle in the plane.
FittedSphere sphere_through(const std::vector<glm::vec3>& points) {
  FittedSphere sphere = fit_sphere(points);
  if (sphere.radius_m < 2.0f * extent_of(points)) return sphere;
  glm::dvec3 middle(0.0);
  for (const glm::vec3& point : points) middle += glm::dvec3(point) / static_cast<double>(points.size());
  glm::dmat3 spread(0.0);
  for (const glm::vec3& point : points)
    spread += glm::outerProduct(glm::dvec3(point) - middle, glm::dvec3(point) - middle);
  // Its square, and that one's, tend to the plane's normal.
  glm::dmat3 power = glm::dmat3(spread[0][0] + spread[1][1] + spread[2][2]) - spread;
  for (int i = 0; i < 8; ++i) {
    const double scale = std::abs(power[0][0]) + std::abs(power[1][1]) + std::abs(power[2][2]);
    if (!(scale > 0.0)) return sphere;
    power = (power * (1.0 / scale)) * (power * (1.0 / scale));
  }
  glm::dvec3 normal = power[0];
  for (int column = 1; column < 3; ++column)
    if (glm::length(power[column]) > glm::length(normal)) normal = power[column];
  normal = glm::normalize(normal);
  const glm::dvec3 center(sphere.center_m);
  sphere.center_m = glm::vec3(center - glm::dot(center - middle, normal) * normal);
  return sphere;
}

StrandEnd look_at(const Groom& groom, End end) {
  constexpr double kMost = 0.8;
  const auto index = [&](uint32_t strand, uint32_t inwards) {
    return end == End::First ? groom.offset[strand] + inwards : groom.offset[strand + 1] - 1 - inwards;
  };
  std::vector<glm::vec3> points;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    points.push_back(groom.rest_position_m[index(strand, 0)]);
  const FittedSphere sphere = sphere_through(points);
  StrandEnd result;
  std::vector<double> off;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const glm::dvec3 point(points[strand]), out = point - glm::dvec3(sphere.center_m);
    const glm::dvec3 on = glm::dvec3(groom.rest_position_m[index(strand, 1)]) - point;
    const double own_off = std::abs(glm::length(out) / static_cast<double>(sphere.radius_m) - 1.0);
    if (!std::isfinite(own_off)) return {};
    off.push_back(own_off);
    const double lengths = glm::length(out) * glm::length(on);
    if (lengths > 0.0) result.outwards += glm::dot(out, on) / lengths / static_cast<double>(points.size());
  }
  if (!are_flat(points)) result.off = quantile(off, kMost);
  return result;
}

/// Whether the last points are the roots: hair leaves its skin outwards, and roots lie on a head more nearly
/// than tips. Of real heads roots have 0.1 to 0.7 more outwards than tips, and are 1.6 to 6 times nearer to
/// their sphere. Hair that falls straight down through its head has neither nearer, whatever its ends do.
bool are_tips_first(const StrandEnd& first, const StrandEnd& last) {
  constexpr double kMore = 0.05, kClearlyMore = 0.3, kNearer = 1.25, kClearlyNearer = 1.5;
  const double more = last.outwards - first.outwards;
  return (more > kClearlyMore && kNearer * last.off < first.off) ||
         (more > kMore && kClearlyNearer * last.off < first.off);
}

/// Share of a part's roots that lie on a head when the part is made so many times as large.
double share_on_head(const FittedSphere& head, const Groom& part, float scale) {
  constexpr float kNearest = 0.6f, kFurthest = 1.6f;  // radii: a beard, a bun
  const std::vector<glm::vec3> roots = roots_of(part);
  const auto count = std::count_if(roots.begin(), roots.end(), [&](const glm::vec3& root) {
    const float radii = glm::distance(scale * root, head.center_m) / head.radius_m;
    return radii > kNearest && radii < kFurthest;
  });
  return static_cast<double>(count) / static_cast<double>(std::max<size_t>(roots.size(), 1));
}

/// How many times larger a part has to be made for its roots to lie on a head; 0 where none will do.
float scale_onto(const FittedSphere& head, const Groom& part) {
  constexpr double kSome = 0.2, kMost = 0.8;
  constexpr float kLeastReach = 0.3f, kMostReach = 6.0f;  // radii from side to side of what grows on a head
  if (share_on_head(head, part, 1.0f) >= kSome) return 1.0f;
  float best = 0.0f;
  double most = kMost;
  const float reach = extent_of(roots_of(part)) / head.radius_m;
  for (const float scale : kUnitRatios) {
    if (!(scale * reach >= kLeastReach && scale * reach <= kMostReach)) continue;
    const double share = share_on_head(head, part, scale);
    if (share <= most) continue;
    best = scale;
    most = share;
  }
  return best;
}

void scale_part(StatedGroom& part, float scale) {
  for (glm::vec3& point : part.groom.rest_position_m) point *= scale;
  for (float& width : part.labels.width) width *= scale;
  part.material = part.material.scaled(static_cast<double>(scale));
}

}  // namespace

std::string turn_tips_first(Groom& groom, StrandLabels& labels) {
  if (groom.strand_count() < kMinStrands) return {};
  const StrandEnd first = look_at(groom, End::First), last = look_at(groom, End::Last);
  if (!are_tips_first(first, last)) return {};
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    const size_t count = groom.vertex_count(strand);
    const auto points = std::span(groom.rest_position_m).subspan(groom.offset[strand], count);
    std::reverse(points.begin(), points.end());
    if (labels.width.empty()) continue;
    const auto widths = std::span(labels.width).subspan(groom.offset[strand], count);
    std::reverse(widths.begin(), widths.end());
  }
  return "its strands run from tip to root and are turned round: they leave a head at their last points";
}

std::string unify_units(std::vector<GroomPart>& parts) {
  // Those that state a unit get the first one's.
  const auto first = std::find_if(parts.begin(), parts.end(),
                                  [](const GroomPart& part) { return part.stated.unit_m.has_value(); });
  for (GroomPart& part : parts) {
    if (!part.stated.unit_m || *part.stated.unit_m == *first->stated.unit_m) continue;
    const float scale = *part.stated.unit_m / *first->stated.unit_m;
    scale_part(part.stated, scale);
    part.stated.unit_m = first->stated.unit_m;
    part.stated.notes.push_back(fmt::format("{} states another unit than {}, and is scaled by {:.4g}",
                                            part.path.string(), first->path.string(), scale));
  }
  // The part with the most strands of those that show a head by themselves.
  const GroomPart* on_head = nullptr;
  for (const GroomPart& part : parts)
    if (covered_head_radius(part.stated.groom) > 0.0f &&
        (on_head == nullptr || part.stated.groom.strand_count() > on_head->stated.groom.strand_count()))
      on_head = &part;
  if (on_head == nullptr) return {};
  const FittedSphere head = fit_sphere(roots_of(on_head->stated.groom));
  std::string apart;
  std::vector<float> scales;
  for (const GroomPart& part : parts) {
    scales.push_back(scale_onto(head, part.stated.groom));
    const bool is_known = scales.back() > 0.0f;
    if (!is_known) scales.back() = 1.0f;
    if (!is_known && apart.empty())
      apart =
          fmt::format("the roots of {} are not on the head of {}, in no usual unit: are they of other hair?",
                      part.path.string(), on_head->path.string());
  }
  // Where a part states the unit, the others get that part's.
  const float kept = first == parts.end() || on_head->stated.unit_m
                         ? 1.0f
                         : scales[static_cast<size_t>(first - parts.begin())];
  for (size_t i = 0; i < parts.size(); ++i) {
    const float scale = scales[i] / kept;
    if (parts[i].stated.unit_m || scale == 1.0f) continue;
    scale_part(parts[i].stated, scale);
    const GroomPart& other = kept == 1.0f ? *on_head : *first;
    parts[i].stated.notes.push_back(
        fmt::format("{} is scaled by {:.4g}: then its roots lie on the head of {}, which has another unit",
                    parts[i].path.string(), scale, other.path.string()));
  }
  return apart;
}

}  // namespace strandcast
