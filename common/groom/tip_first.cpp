#include "common/groom/tip_first.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
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

/// Both ends of a strand.
struct Ends {
  glm::vec3 first, last;
};

/// Two strands side by side, and how clearly they run alike or against each other: the way between their ends
/// as they are in shares of that with one turned round, or the other way round. Below 1; 0 is clearest.
struct Beside {
  uint32_t strand = 0, other = 0;
  float share = 1.0f;
  float way = 0.0f;  // between their ends, the shorter one
  bool is_against = false;
};

Beside beside(const std::vector<Ends>& ends, uint32_t strand, uint32_t other) {
  const Ends &a = ends[strand], &b = ends[other];
  const float alike = glm::distance(a.first, b.first) + glm::distance(a.last, b.last);
  const float against = glm::distance(a.first, b.last) + glm::distance(a.last, b.first);
  const float less = std::min(alike, against), more = std::max(alike, against);
  return {strand, other, more > 0.0f ? less / more : 1.0f, less, against < alike};
}

/// Strands drawn from all of them, evenly, whatever order they have; along the x axis.
struct DrawnStrands {
  std::vector<uint32_t> strand;
  std::vector<float> middle_x;  // of each, twice the middle of its ends
};

DrawnStrands draw_strands(const std::vector<Ends>& ends) {
  constexpr size_t kMost = 1'000;
  DrawnStrands drawn;
  std::minstd_rand random;
  const size_t count = std::min(ends.size(), kMost);
  for (size_t i = 0; i < count; ++i) {
    const size_t begin = ends.size() * i / count, end = ends.size() * (i + 1) / count;
    drawn.strand.push_back(static_cast<uint32_t>(begin + random() % (end - begin)));
  }
  const auto middle_x = [&](uint32_t strand) { return ends[strand].first.x + ends[strand].last.x; };
  std::sort(drawn.strand.begin(), drawn.strand.end(),
            [&](uint32_t a, uint32_t b) { return middle_x(a) < middle_x(b); });
  for (const uint32_t strand : drawn.strand) drawn.middle_x.push_back(middle_x(strand));
  return drawn;
}

/// The clear ones of the drawn strands that lie nearest beside a strand.
std::vector<Beside> nearest_beside(const std::vector<Ends>& ends, uint32_t strand,
                                   const DrawnStrands& drawn) {
  constexpr size_t kNearest = 6;
  constexpr float kClearly = 0.4f;
  const float own_x = ends[strand].first.x + ends[strand].last.x;
  auto right = static_cast<size_t>(std::lower_bound(drawn.middle_x.begin(), drawn.middle_x.end(), own_x) -
                                   drawn.middle_x.begin());
  size_t left = right;  // as many are not looked at yet
  std::vector<Beside> nearest;
  while (left > 0 || right < drawn.strand.size()) {
    const bool is_left = right == drawn.strand.size() ||
                         (left > 0 && own_x - drawn.middle_x[left - 1] < drawn.middle_x[right] - own_x);
    const size_t at = is_left ? --left : right++;
    // No way between the ends is shorter than that between their middles, twice.
    if (nearest.size() == kNearest && std::abs(drawn.middle_x[at] - own_x) >= nearest.back().way) break;
    if (drawn.strand[at] == strand) continue;
    const Beside found = beside(ends, strand, drawn.strand[at]);
    if (nearest.size() == kNearest && found.way >= nearest.back().way) continue;
    if (nearest.size() == kNearest) nearest.pop_back();
    nearest.insert(std::upper_bound(nearest.begin(), nearest.end(), found,
                                    [](const Beside& a, const Beside& b) { return a.way < b.way; }),
                   found);
  }
  std::erase_if(nearest, [](const Beside& pair) { return !(pair.share < kClearly); });
  return nearest;
}

/// Groups of strands that run like each other or against each other.
class RunningAlike {
 public:
  explicit RunningAlike(size_t count) : above_(count), is_against_(count, false), size_(count, 1) {
    std::iota(above_.begin(), above_.end(), 0u);
  }
  struct Found {
    uint32_t group = 0;
    bool is_against = false;  // the strand that stands for the group
  };
  Found find(uint32_t strand) const {
    Found found{strand};
    while (above_[found.group] != found.group) {
      found.is_against = found.is_against != is_against_[found.group];
      found.group = above_[found.group];
    }
    return found;
  }
  size_t size(uint32_t group) const { return size_[group]; }
  /// Joins the groups of two strands. Returns false where they are in one already that says otherwise of
  /// them.
  bool join(const Beside& pair) {
    Found a = find(pair.strand), b = find(pair.other);
    const bool is_turned = (a.is_against != b.is_against) != pair.is_against;
    if (a.group == b.group) return !is_turned;
    if (size_[a.group] < size_[b.group]) std::swap(a, b);
    above_[b.group] = a.group;
    is_against_[b.group] = is_turned;
    size_[a.group] += size_[b.group];
    return true;
  }

 private:
  std::vector<uint32_t> above_;
  std::vector<bool> is_against_;
  std::vector<uint32_t> size_;
};

/// Strands that run against most of those beside which they lie. Says nothing where neighbours do not agree,
/// or most have none that tell.
std::vector<uint32_t> strands_against_most(const Groom& groom) {
  constexpr double kMostAtOdds = 0.01, kLeastGroup = 0.5;  // of the pairs; of the strands
  constexpr int kLeastAgainst = 3;
  std::vector<Ends> ends;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    ends.push_back(
        {groom.rest_position_m[groom.offset[strand]], groom.rest_position_m[groom.offset[strand + 1] - 1]});
    if (!std::isfinite(ends.back().first.x + ends.back().last.x)) return {};
  }
  const DrawnStrands drawn = draw_strands(ends);
  std::vector<Beside> pairs;
  for (const uint32_t strand : drawn.strand)
    for (const Beside& pair : nearest_beside(ends, strand, drawn)) pairs.push_back(pair);
  std::sort(pairs.begin(), pairs.end(), [](const Beside& a, const Beside& b) { return a.share < b.share; });
  RunningAlike alike(ends.size());
  const auto at_odds =
      std::count_if(pairs.begin(), pairs.end(), [&](const Beside& pair) { return !alike.join(pair); });
  if (static_cast<double>(at_odds) > kMostAtOdds * static_cast<double>(pairs.size())) return {};
  uint32_t group = 0;
  for (const uint32_t strand : drawn.strand) {
    const uint32_t own = alike.find(strand).group;
    if (alike.size(own) > alike.size(group)) group = own;
  }
  // 1 = like the one that stands for the largest group, -1 = against it, 0 = not known.
  const auto way_of = [&](uint32_t strand) {
    const RunningAlike::Found found = alike.find(strand);
    return found.group != group ? 0 : found.is_against ? -1 : 1;
  };
  const int members = static_cast<int>(alike.size(group));
  int sum = 0;
  for (const uint32_t strand : drawn.strand) sum += way_of(strand);
  const int most = sum < 0 ? -1 : 1, against = (members - std::abs(sum)) / 2;
  if (against < kLeastAgainst ||
      static_cast<double>(members) < kLeastGroup * static_cast<double>(drawn.strand.size()))
    return {};
  std::vector<uint32_t> result;
  for (uint32_t strand = 0; strand < ends.size(); ++strand) {
    int votes = 0;
    for (const Beside& pair : nearest_beside(ends, strand, drawn))
      votes += pair.is_against ? -way_of(pair.other) : way_of(pair.other);
    if (votes * most < 0) result.push_back(strand);
  }
  return result;
}

void turn_round(Groom& groom, StrandLabels& labels, uint32_t strand) {
  const size_t count = groom.vertex_count(strand);
  const auto points = std::span(groom.rest_position_m).subspan(groom.offset[strand], count);
  std::reverse(points.begin(), points.end());
  if (labels.width.empty()) return;
  const auto widths = std::span(labels.width).subspan(groom.offset[strand], count);
  std::reverse(widths.begin(), widths.end());
}

}  // namespace

std::string turn_tips_first(Groom& groom, StrandLabels& labels) {
  if (groom.strand_count() < kMinStrands) return {};
  constexpr double kFew = 0.15;  // the others are right then, also where no end says it
  const std::vector<uint32_t> against = strands_against_most(groom);
  for (const uint32_t strand : against) turn_round(groom, labels, strand);
  const StrandEnd first = look_at(groom, End::First), last = look_at(groom, End::Last);
  const bool are_most = are_tips_first(first, last);
  const bool is_unclear = static_cast<double>(against.size()) > kFew * groom.strand_count() && !are_most &&
                          !are_tips_first(last, first);
  if (is_unclear)
    for (const uint32_t strand : against) turn_round(groom, labels, strand);
  if (are_most)
    for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) turn_round(groom, labels, strand);
  if (!against.empty() && !is_unclear)
    return fmt::format(
        "{} of its {} strands run from tip to root, against those beside them, and are turned round",
        are_most ? groom.strand_count() - against.size() : against.size(), groom.strand_count());
  return are_most
             ? "its strands run from tip to root and are turned round: they leave a head at their last points"
             : "";
}

}  // namespace strandcast
