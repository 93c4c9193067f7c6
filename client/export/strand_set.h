// StrandSet: selects the strands of an export and converts them to the file's order, unit, axes, space and
// widths. The same for all frames. Pure; one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "client/export/export_options.h"
#include "client/export/export_source.h"
#include "common/strands/posed_strands.h"

namespace strandcast {

/// Strands shorter than this at rest or in the first frame are left out, because one curve without length
/// makes some programs reject the whole file.
inline constexpr double kLeastExportedLengthM = 1e-5;
/// Resolution of positions in files: a micrometre.
inline constexpr double kExportStepM = 1e-6;

class StrandSet {
 public:
  /// Selects the strands; those without length at rest or in the `first` frame are left out.
  StrandSet(const ExportScene& scene, const ExportOptions& options, const PosedStrands& first);

  uint32_t strand_count() const { return static_cast<uint32_t>(strand_.size()); }
  uint32_t vertex_count() const { return vertex_count_; }
  uint32_t left_out_count() const { return left_out_count_; }

  /// Returns the points of a frame in the file's units and axes, strand after strand, root first.
  std::vector<glm::dvec3> points(const PosedStrands& strands) const;
  /// Returns the rest shape as points() does, placed in the world on the head of the first frame.
  std::vector<glm::dvec3> rest_points() const { return points(rest_); }
  /// Returns the diameters of one strand's vertices from root to tip, in file units.
  const std::vector<float>& widths() const { return width_; }
  /// Returns longitude and latitude of each root about the centre of all roots, 0..1.
  std::vector<glm::vec2> root_uv() const;
  /// Counts the exported strands that have no length in `strands`, having lost it since the first frame.
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
