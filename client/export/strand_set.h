// StrandSet: which strands an export holds and how they lie in the file: order, unit, axes, space and widths.
// The same for all frames. Pure; one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "client/export/export_options.h"
#include "client/export/export_source.h"
#include "common/strands/posed_strands.h"

namespace strandcast {

/// A strand that is shorter than this at rest or in the first frame is none: one curve of no length makes
/// some programs refuse all.
inline constexpr double kLeastExportedLengthM = 1e-5;
/// Files say positions in steps of a micrometre.
inline constexpr double kExportStepM = 1e-6;

class StrandSet {
 public:
  /// `first`: the first frame. Strands without a length in it or at rest are left out.
  StrandSet(const ExportScene& scene, const ExportOptions& options, const PosedStrands& first);

  uint32_t strand_count() const { return static_cast<uint32_t>(strand_.size()); }
  uint32_t vertex_count() const { return vertex_count_; }
  uint32_t left_out_count() const { return left_out_count_; }

  /// Points of a frame in the units and axes of the file, strand after strand, root first.
  std::vector<glm::dvec3> points(const PosedStrands& strands) const;
  /// The rest shape likewise, in the world on the head of the first frame.
  std::vector<glm::dvec3> rest_points() const { return points(rest_); }
  /// Diameter of the vertices of one strand from root to tip, file units.
  const std::vector<float>& widths() const { return width_; }
  /// Where each root is: longitude and latitude about the middle of all roots, 0..1.
  std::vector<glm::vec2> root_uv() const;
  /// Strands of these that have no length, m: they have lost it since.
  uint32_t collapsed_count(const PosedStrands& strands) const;

 private:
  uint32_t all_strand_count_;
  uint32_t vertex_count_;
  ExportOptions options_;
  PosedStrands rest_;
  std::vector<uint32_t> strand_;  // of the asset, those that are not left out
  uint32_t left_out_count_ = 0;
  std::vector<float> width_;
};

}  // namespace strandcast
