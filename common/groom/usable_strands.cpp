#include "common/groom/usable_strands.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/base/quantile.h"
#include "common/math/point_tree.h"

namespace strandcast {
namespace {

bool is_finite_point(const glm::vec3& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && std::isfinite(point.z);
}

/// Gives the bad strands the coordinates of the nearest good ones.
void take_nearest_uv(Groom& groom, std::span<const uint32_t> good, std::span<const uint32_t> bad) {
  const auto root = [&](uint32_t strand) { return groom.rest_position_m[groom.offset[strand]]; };
  std::vector<glm::vec3> roots;
  for (const uint32_t strand : good) roots.push_back(root(strand));
  const PointTree tree(roots);
  for (const uint32_t strand : bad)
    groom.root_uv[strand] = groom.root_uv[good[tree.nearest(root(strand), 1).front().index]];
}

/// Gives strands without a usable coordinate that of the nearest root which has one; all go where more than a
/// tenth is bad. Returns what to say of it.
std::string bridge_root_uv(Groom& groom) {
  const auto is_good = [](const glm::vec2& uv) { return std::isfinite(uv.x) && std::isfinite(uv.y); };
  std::vector<uint32_t> good, bad;
  for (uint32_t strand = 0; strand < groom.root_uv.size(); ++strand)
    (is_good(groom.root_uv[strand]) ? good : bad).push_back(strand);
  if (bad.empty()) return {};
  const std::string count =
      fmt::format("{} of {} root coordinates cannot be used, the first that of strand {}:", bad.size(),
                  groom.root_uv.size(), bad.front());
  if (good.empty() || bad.size() * kMostBadShare > groom.root_uv.size()) {
    groom.root_uv.clear();
    return count + " all are left out";
  }
  take_nearest_uv(groom, good, bad);
  return count + " those are as of the nearest root";
}

/// The first point that a broken export left at the origin, far from its strand; the end where none is.
size_t lost_point(std::span<const glm::vec3> strand) {
  constexpr float kFarTimes = 10.0f;  // half of the strand's segments
  constexpr size_t kMinPoints = 4;    // fewer do not say how long a segment is
  if (strand.size() < kMinPoints) return strand.size();
  std::vector<float> lengths;
  for (size_t i = 1; i < strand.size(); ++i)
    if (const float length = glm::distance(strand[i - 1], strand[i]); length > 0.0f)
      lengths.push_back(length);
  if (lengths.empty()) return strand.size();
  const float far = kFarTimes * median(lengths);
  for (size_t i = 0; i < strand.size(); ++i) {
    if (strand[i] != glm::vec3(0.0f)) continue;
    if (i > 0 && glm::length(strand[i - 1]) > far) return i;
    if (i + 1 < strand.size() && glm::length(strand[i + 1]) > far) return i;
  }
  return strand.size();
}

std::optional<Error> what_is_wrong(uint32_t strand, std::span<const glm::vec3> points) {
  const auto bad = std::find_if_not(points.begin(), points.end(), is_finite_point);
  if (bad != points.end())
    return make_error(ErrorCode::BadInput, "strand {} vertex {} has the coordinates {}, {} and {}", strand,
                      bad - points.begin(), bad->x, bad->y, bad->z);
  const size_t lost = lost_point(points);
  if (lost == points.size()) return std::nullopt;
  return make_error(ErrorCode::BadInput, "strand {} vertex {} is at 0, 0, 0, far from its strand", strand,
                    lost);
}

/// Strands that go further from the middle of the roots than so many times what half of them reach: a point
/// of a broken export, and no hair.
constexpr float kStrayReaches = 25.0f;
constexpr size_t kMinJudgedStrands = 20;  // fewer do not say how hair goes

/// How far each strand's root is from the middle of the roots, and how far the strand goes; empty where that
/// says nothing. Strands that are not kept go nowhere.
struct Reaches {
  std::vector<float> root, all;
};

Reaches reaches_of(const Groom& groom, std::span<const uint8_t> is_kept) {
  std::array<std::vector<float>, 3> roots;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    for (int axis = 0; axis < 3 && is_kept[strand] != 0; ++axis)
      roots[static_cast<size_t>(axis)].push_back(groom.rest_position_m[groom.offset[strand]][axis]);
  if (roots[0].size() < kMinJudgedStrands) return {};
  glm::vec3 middle;
  for (int axis = 0; axis < 3; ++axis) middle[axis] = median(std::move(roots[static_cast<size_t>(axis)]));
  Reaches reaches{std::vector<float>(groom.strand_count()), std::vector<float>(groom.strand_count())};
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    for (uint32_t i = groom.offset[strand]; i < groom.offset[strand + 1] && is_kept[strand] != 0; ++i) {
      const float reach = glm::distance(groom.rest_position_m[i], middle);
      if (i == groom.offset[strand]) reaches.root[strand] = reach;
      reaches.all[strand] = std::max(reaches.all[strand], reach);
    }
  return reaches;
}

/// What half of the strands that are kept have at most.
float usual_of(const std::vector<float>& reaches, std::span<const uint8_t> is_kept) {
  std::vector<float> kept;
  for (size_t strand = 0; strand < reaches.size(); ++strand)
    if (is_kept[strand] != 0) kept.push_back(reaches[strand]);
  return kept.empty() ? 0.0f : median(std::move(kept));
}

/// Takes out strands that reach further, if they are few: else the hair is like that.
void leave_out_further(float furthest, const std::vector<float>& reaches, std::vector<uint8_t>& is_kept,
                       BadItems& broken, const std::function<Error(size_t strand)>& why) {
  const auto is_stray = [&](float reach) { return furthest > 0.0f && reach > furthest; };
  const auto count = static_cast<uint64_t>(std::count_if(reaches.begin(), reaches.end(), is_stray));
  if (count * kMostBadShare > is_kept.size()) return;
  for (size_t strand = 0; strand < reaches.size(); ++strand) {
    if (!is_stray(reaches[strand]) || is_kept[strand] == 0) continue;
    is_kept[strand] = 0;
    broken.add(why(strand));
  }
}

/// Of reaches beyond `furthest` those of roots that stand alone, none being nearer than so; else 0.
std::vector<float> lone(const Groom& groom, const std::vector<float>& reaches, float furthest,
                        std::span<const uint8_t> is_kept) {
  std::vector<float> lone(reaches.size());
  if (std::none_of(reaches.begin(), reaches.end(), [&](float reach) { return reach > furthest; }))
    return lone;
  std::vector<glm::vec3> roots;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand)
    if (is_kept[strand] != 0) roots.push_back(groom.rest_position_m[groom.offset[strand]]);
  const PointTree tree(roots);
  const float apart = 0.5f * furthest;
  for (uint32_t strand = 0; strand < groom.strand_count(); ++strand) {
    if (!(reaches[strand] > furthest) || is_kept[strand] == 0) continue;
    const auto nearest = tree.nearest(groom.rest_position_m[groom.offset[strand]], 2);
    if (nearest.back().distance_squared > apart * apart) lone[strand] = reaches[strand];
  }
  return lone;
}

/// Takes out strands with a point where no hair is, and those whose root stands apart.
void find_strays(const Groom& groom, std::vector<uint8_t>& is_kept, BadItems& broken) {
  // Times what half of the roots are off, or half of what hair reaches; of one that stands alone.
  constexpr float kStrayRoots = 10.0f, kLoneRoots = 4.0f;
  const Reaches reaches = reaches_of(groom, is_kept);
  const float usual = usual_of(reaches.all, is_kept), usual_root = usual_of(reaches.root, is_kept);
  leave_out_further(kStrayReaches * usual, reaches.all, is_kept, broken, [&](size_t strand) {
    return make_error(ErrorCode::BadInput,
                      "strand {} goes {:.4g} units from the middle of the roots, half of all at most {:.4g}",
                      strand, reaches.all[strand], usual);
  });
  const auto grows_apart = [&](size_t strand) {
    return make_error(ErrorCode::BadInput,
                      "strand {} grows {:.4g} units from the middle of the roots, half of all at most {:.4g}",
                      strand, reaches.root[strand], usual_root);
  };
  const float usual_way = std::max(usual_root, 0.5f * usual);
  leave_out_further(kStrayRoots * usual_way, reaches.root, is_kept, broken, grows_apart);
  const float furthest_lone = kLoneRoots * usual_way;
  leave_out_further(furthest_lone, lone(groom, reaches.root, furthest_lone, is_kept), is_kept, broken,
                    grows_apart);
}

/// With what is said of coordinates of roots, which come last: roots are finite by then.
StatedGroom with_usable_uv(StatedGroom stated) {
  if (std::string note = bridge_root_uv(stated.groom); !note.empty()) stated.notes.push_back(std::move(note));
  return stated;
}

/// Whether a strand ends or begins with a segment that leads to another.
bool runs_on(std::span<const glm::vec3> strand) {
  constexpr size_t kMinPoints = 5;  // fewer do not say how long a segment is
  constexpr float kTimes = 3.0f;    // of the mean of the others
  if (strand.size() < kMinPoints) return false;
  float all = 0.0f;
  for (size_t i = 1; i < strand.size(); ++i) all += glm::distance(strand[i - 1], strand[i]);
  const float end =
      std::max(glm::distance(strand[0], strand[1]), glm::distance(strand[strand.size() - 2], strand.back()));
  return end * static_cast<float>(strand.size() - 2) > kTimes * (all - end);
}

/// How many strands run on to others, where they would not if all that follow one began so many points later
/// or earlier as there are too many or too few.
uint64_t strands_run_on(std::span<const glm::vec3> points, std::span<const uint32_t> counts,
                        uint64_t needed) {
  constexpr uint64_t kTimesBetter = 4;
  if (counts.size() < kMinJudgedStrands) return 0;
  const auto is_wrong = [&](uint64_t begin, uint32_t count) {
    return begin <= points.size() && count <= points.size() - begin && runs_on(points.subspan(begin, count));
  };
  std::vector<int64_t> gain;  // by beginning elsewhere
  int64_t wrong = 0, best = 0, after = 0;
  uint64_t begin = 0;
  for (const uint32_t count : counts) {
    const bool is_wrong_here = is_wrong(begin, count);
    wrong += is_wrong_here ? 1 : 0;
    gain.push_back((is_wrong_here ? 1 : 0) - (is_wrong(begin + points.size() - needed, count) ? 1 : 0));
    begin += count;
  }
  for (auto strand = gain.rbegin(); strand != gain.rend(); ++strand) best = std::max(best, after += *strand);
  return static_cast<uint64_t>(wrong - best) * kTimesBetter <= static_cast<uint64_t>(wrong)
             ? static_cast<uint64_t>(wrong)
             : 0;
}

}  // namespace

StrandNames::StrandNames(const std::vector<std::string>& texts, size_t strand_count,
                         const std::string& fallback) {
  of_strand.assign(strand_count, 0);
  if (texts.size() != strand_count) {
    name = {texts.size() == 1 ? texts.front() : fallback};
    return;
  }
  std::unordered_map<std::string, uint32_t> known;
  for (size_t strand = 0; strand < strand_count; ++strand) {
    const auto [found, is_new] = known.try_emplace(texts[strand], static_cast<uint32_t>(name.size()));
    if (is_new) name.push_back(texts[strand]);
    of_strand[strand] = found->second;
  }
}

Status fit_points(std::vector<glm::vec3>& points, uint64_t needed, const char* source,
                  std::vector<std::string>& notes) {
  const uint64_t there = points.size();
  if (there == needed) return {};
  BadItems wrong;
  wrong.add(make_error(ErrorCode::BadInput, "{} need {} points, there are {}", source, needed, there),
            std::max(there, needed) - std::min(there, needed));
  RETURN_IF_ERROR(wrong.settle(std::max(there, needed), "points",
                               there < needed ? "since they are not there" : "and are left out", notes));
  points.resize(needed, glm::vec3(std::numeric_limits<float>::quiet_NaN()));
  return {};
}

Status fit_points(std::vector<glm::vec3>& points, std::span<const uint32_t> counts, const char* source,
                  std::vector<std::string>& notes) {
  const uint64_t there = points.size(), needed = std::accumulate(counts.begin(), counts.end(), uint64_t{0});
  if (there == needed) return {};
  const uint64_t wrong = strands_run_on(points, counts, needed);
  if (wrong * kMostBadShare > counts.size())
    return make_error(ErrorCode::BadInput,
                      "{} need {} points, there are {}, and {} of {} strands lead on to the next: a count is "
                      "wrong, export it anew",
                      source, needed, there, wrong, counts.size());
  return fit_points(points, needed, source, notes);
}

Error empty_strand(size_t strand) {
  return make_error(ErrorCode::BadInput, "strand {} has fewer than {} points, or no length", strand,
                    kMinVertexCount);
}

Status settle_empty(const BadItems& empty, uint64_t strand_count, std::vector<std::string>& notes) {
  // One is no habit of a program, however few strands there are.
  if (empty.count() > 1) RETURN_IF_ERROR(empty.judge(strand_count, "strands"));
  if (empty.count() > 0) notes.push_back(empty.sentence(strand_count, "strands", "and are left out"));
  return {};
}

std::string part_guides(Groom& groom, StrandLabels& labels, std::vector<uint8_t> is_guide, GuideUse use,
                        const char* by) {
  const auto guides = static_cast<uint64_t>(std::count(is_guide.begin(), is_guide.end(), uint8_t{1}));
  if (guides == 0) return {};
  if (guides == is_guide.size()) return fmt::format("all strands are guides{}: they are taken as hair", by);
  if (use == GuideUse::LeaveOut)
    for (uint8_t& flag : is_guide) flag = 1 - flag;
  keep_strands(groom, labels, is_guide);
  const std::string count = counted(guides, "guide", "guides") + by + (guides == 1 ? " is" : " are");
  return use == GuideUse::Alone ? count + " the hair, other strands are left out"
                                : count + " left out (groom.file.guides takes guides alone)";
}

std::string fill_lacking(Groom& groom, StrandLabels& labels) {
  std::vector<uint8_t> is_filled(groom.strand_count());
  const auto fill = [&](auto& list, const auto& lacks, const auto& strand_of, const auto& value_of) {
    if (std::all_of(list.begin(), list.end(), lacks)) list.clear();
    for (size_t i = 0; i < list.size(); ++i) {
      if (!lacks(list[i])) continue;
      list[i] = value_of(i);
      is_filled[strand_of(i)] = 1;
    }
  };
  const auto itself = [](size_t i) { return i; };
  const auto has_none = [](int32_t label) { return label == kNoLabel; };
  const auto most = [](const std::vector<int32_t>& list) {
    return list.empty() ? 0 : *std::max_element(list.begin(), list.end());
  };
  int32_t last_id = most(labels.id);
  fill(labels.id, has_none, itself,
       [&](size_t) { return last_id < std::numeric_limits<int32_t>::max() ? ++last_id : last_id; });
  const int32_t last_group = most(labels.group);
  fill(labels.group, has_none, itself,
       [&](size_t) { return last_group < std::numeric_limits<int32_t>::max() ? last_group + 1 : 0; });
  std::vector<float> widths;
  for (const float width : labels.width)
    if (!std::isnan(width)) widths.push_back(width);
  const float usual_width = widths.empty() ? 0.0f : median(std::move(widths));
  const auto strand_of_vertex = [&](size_t vertex) {
    return static_cast<size_t>(std::upper_bound(groom.offset.begin(), groom.offset.end(), vertex) -
                               groom.offset.begin()) -
           1;
  };
  fill(
      labels.width, [](float width) { return std::isnan(width); }, strand_of_vertex,
      [&](size_t) { return usual_width; });
  std::vector<uint32_t> known, lacking;
  for (uint32_t strand = 0; strand < groom.root_uv.size(); ++strand)
    (std::isnan(groom.root_uv[strand].x) ? lacking : known).push_back(strand);
  if (known.empty()) groom.root_uv.clear();
  if (!known.empty() && !lacking.empty()) take_nearest_uv(groom, known, lacking);
  for (const uint32_t strand : known.empty() ? std::vector<uint32_t>() : lacking) is_filled[strand] = 1;
  const auto count = std::count(is_filled.begin(), is_filled.end(), uint8_t{1});
  if (count == 0) return {};
  return fmt::format(
      "{} of {} strands lack an id, a group, widths or root coordinates that others have: they get further "
      "ids, a "
      "group of their own, the usual width and the nearest root's coordinates",
      count, is_filled.size());
}

void keep_strands(Groom& groom, StrandLabels& labels, std::span<const uint8_t> is_kept) {
  const auto keep = [&](auto& list, const auto& begin_of) {
    if (list.empty()) return;
    size_t to = 0;
    for (size_t strand = 0; strand < is_kept.size(); ++strand)
      for (size_t i = begin_of(strand); is_kept[strand] != 0 && i < begin_of(strand + 1); ++i)
        list[to++] = list[i];
    list.resize(to);
  };
  const auto vertices = [&](size_t strand) { return size_t{groom.offset[strand]}; };
  const auto strands = [](size_t strand) { return strand; };
  keep(groom.rest_position_m, vertices);
  keep(groom.pinned, vertices);
  keep(labels.width, vertices);
  keep(groom.root_uv, strands);
  keep(labels.id, strands);
  keep(labels.group, strands);
  keep(labels.object, strands);
  size_t to = 0;
  uint32_t begin = 0;
  for (size_t strand = 0; strand < is_kept.size(); ++strand) {
    const uint32_t end = groom.offset[strand + 1], count = end - std::exchange(begin, end);
    if (is_kept[strand] == 0) continue;
    groom.offset[to + 1] = groom.offset[to] + count;
    ++to;
  }
  groom.offset.resize(to + 1);
}

Result<StatedGroom> with_usable_strands(StatedGroom stated) {
  Groom& groom = stated.groom;
  const uint32_t strand_count = groom.strand_count();
  std::vector<uint8_t> is_kept(strand_count, 1);
  BadItems broken, empty;
  for (uint32_t strand = 0; strand < strand_count; ++strand) {
    const auto points =
        std::span(groom.rest_position_m).subspan(groom.offset[strand], groom.vertex_count(strand));
    std::optional<Error> wrong = what_is_wrong(strand, points);
    const bool is_empty = !wrong && (points.size() < kMinVertexCount || !(groom.length_m(strand) > 0.0f));
    if (wrong || is_empty) is_kept[strand] = 0;
    if (wrong) broken.add(std::move(*wrong));
    if (is_empty) empty.add(empty_strand(strand));
  }
  find_strays(groom, is_kept, broken);
  RETURN_IF_ERROR(broken.settle(strand_count, "strands", "and are left out", stated.notes));
  if (broken.count() + empty.count() == strand_count)
    return make_error(ErrorCode::BadInput, "no strand has {} points and a length", kMinVertexCount);
  RETURN_IF_ERROR(settle_empty(empty, strand_count, stated.notes));
  if (broken.count() + empty.count() == 0) return with_usable_uv(std::move(stated));
  keep_strands(groom, stated.labels, is_kept);
  return with_usable_uv(std::move(stated));
}

}  // namespace strandcast
