// StatedGroom: strands of a groom file with what the file states: units, axes, names and widths. Plain data.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/groom/groom.h"

namespace strandcast {

/// What becomes of guides beside other strands. Where there is nothing but guides, they are the hair.
enum class GuideUse { LeaveOut, Alone };

/// What hair is made of, as far as somebody says it. Lengths are of the file's unit, metres once placed.
struct HairMaterial {
  std::optional<double> diameter, young_modulus, density, poisson_ratio;  // kg, s

  bool is_known() const { return diameter || young_modulus || density || poisson_ratio; }
  /// Returns the same where a length counts `factor` times as many units.
  HairMaterial scaled(double factor) const {
    const auto times = [](std::optional<double> value, double by) {
      return value ? std::optional(*value * by) : value;
    };
    return {times(diameter, factor), times(young_modulus, 1.0 / factor),
            times(density, 1.0 / (factor * factor * factor)), poisson_ratio};
  }
};

inline constexpr size_t kMaxGroupNameChars = 80;  // that are kept of what a file says

/// What files say of strands besides their shape, in their order; a list is empty where they do not say it.
struct StrandLabels {
  std::vector<int32_t> id;               // (strand_count)
  std::vector<int32_t> group;            // (strand_count)
  std::vector<uint32_t> object;          // (strand_count) the curves that it belongs to, in object_name
  std::vector<std::string> object_name;  // of them
  std::vector<float> width;              // (vertex total) diameter; file units, metres once placed
};

/// Names of strands, each name once.
struct StrandNames {
  /// `texts`: one for all strands or one each; with another number of them all strands have the `fallback`.
  StrandNames(const std::vector<std::string>& texts, size_t strand_count, const std::string& fallback);

  std::vector<std::string> name;
  std::vector<uint32_t> of_strand;  // in `name`
};

/// The label of a strand that states none where others do. A width or coordinate that is not stated is NaN.
inline constexpr int32_t kNoLabel = std::numeric_limits<int32_t>::min();

/// Adds a list of `part_count` further strands or vertices to that of the `count` before. Where one of both
/// states nothing, all of its are `lacking`.
template <class T>
void join_list(std::vector<T>& whole, size_t count, const std::vector<T>& part, size_t part_count,
               const T& lacking) {
  if (whole.empty() && part.empty()) return;
  whole.resize(count, lacking);
  whole.insert(whole.end(), part.begin(), part.end());
  whole.resize(count + part_count, lacking);
}

/// Adds strands and their labels behind those of `whole`.
inline void append_strands(Groom& whole, StrandLabels& labels, const Groom& part, const StrandLabels& own) {
  const size_t strands = whole.strand_count(), vertices = whole.rest_position_m.size();
  const size_t more = part.strand_count(), more_vertices = part.rest_position_m.size();
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  join_list(labels.id, strands, own.id, more, kNoLabel);
  join_list(labels.group, strands, own.group, more, kNoLabel);
  join_list(labels.width, vertices, own.width, more_vertices, kNone);
  join_list(whole.root_uv, strands, part.root_uv, more, glm::vec2(kNone));
  const auto first = static_cast<uint32_t>(labels.object_name.size());
  for (const uint32_t object : own.object) labels.object.push_back(first + object);
  labels.object_name.insert(labels.object_name.end(), own.object_name.begin(), own.object_name.end());
  for (size_t strand = 1; strand < part.offset.size(); ++strand)
    whole.offset.push_back(static_cast<uint32_t>(vertices) + part.offset[strand]);
  whole.rest_position_m.insert(whole.rest_position_m.end(), part.rest_position_m.begin(),
                               part.rest_position_m.end());
  whole.pinned.insert(whole.pinned.end(), part.pinned.begin(), part.pinned.end());
}

/// Returns labels in which all strands belong to objects: to this one, if they belong to none.
inline StrandLabels named(StrandLabels labels, size_t strand_count, const std::string& object_name) {
  if (!labels.object_name.empty()) return labels;
  labels.object.assign(strand_count, 0);
  labels.object_name = {object_name};
  return labels;
}

struct StatedGroom {
  Groom groom = {};  // in file units
  StrandLabels labels = {};
  HairMaterial material = {};
  std::optional<float> unit_m = {};  // metres per file unit; empty: the file does not say
  std::optional<bool> is_z_up = {};  // as GroomPlacement; empty: the file does not say
  std::string unit_reason = {};      // where the file says it: "its metersPerUnit says so"
  std::string up_axis_reason = {};
  std::vector<std::string> notes = {};  // a sentence for each thing about the file that a person should know
};

}  // namespace strandcast
