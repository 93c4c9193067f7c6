#include "common/groom/groom_parts.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/groom/head_fit.h"
#include "common/groom/placement.h"

namespace strandcast {
namespace {

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
