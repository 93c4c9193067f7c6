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

/// Stands for an id or a group that a strand lacks, until all strands are known.
inline constexpr int32_t kNoLabel = std::numeric_limits<int32_t>::min();

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

/// Makes lists as long as strands and vertices are many; what is added is lacking.
inline void pad_labels(StrandLabels& labels, size_t strand_count, size_t vertex_count) {
  labels.id.resize(strand_count, kNoLabel);
  labels.group.resize(strand_count, kNoLabel);
  labels.width.resize(vertex_count, std::numeric_limits<float>::quiet_NaN());
}

/// Adds the labels of further strands; lists of both are as long as strands and vertices are many.
inline void join_labels(StrandLabels& whole, const StrandLabels& part) {
  const auto join = [](auto& list, const auto& more) { list.insert(list.end(), more.begin(), more.end()); };
  join(whole.id, part.id);
  join(whole.group, part.group);
  join(whole.width, part.width);
  const auto first = static_cast<uint32_t>(whole.object_name.size());
  for (const uint32_t object : part.object) whole.object.push_back(first + object);
  join(whole.object_name, part.object_name);
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
