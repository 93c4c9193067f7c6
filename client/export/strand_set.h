// StrandSet: selects the strands of an export, simulated or drawn ones, and converts them and the head to the
// file's order, unit, axes, space and widths. The same for all frames. One thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <span>
#include <string>
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

  uint32_t strand_count() const { return static_cast<uint32_t>(members_.size()); }
  /// Returns the vertices of each strand; drawn ones differ.
  const std::vector<uint32_t>& vertex_counts() const { return vertex_counts_; }
  /// Returns the most vertices of a strand.
  uint32_t vertex_count() const { return vertex_count_; }
  uint32_t left_out_count() const { return left_out_count_; }

  /// Returns the points of a frame in the file's units and axes, strand after strand, root first.
  std::vector<glm::dvec3> points(const PosedStrands& strands) const;
  /// Returns the rest shape as points() does, placed in the world on the head of the first frame: the file's
  /// own where it is known, else as simulated.
  std::vector<glm::dvec3> rest_points() const { return points({first_pose_, rest_position_m(scene_)}); }
  /// Returns the diameters of all points, in file units.
  const std::vector<float>& widths() const { return width_; }
  /// Returns the coordinates of each root: the file's own, else longitude and latitude about the centre of
  /// all roots, 0..1.
  std::vector<glm::vec2> root_uv() const;
  /// Returns the id of each strand: the file's own, else numbers from 0; those of followers come after them.
  std::vector<int32_t> ids() const;
  /// Returns the group of each strand: the file's own, else 0.
  std::vector<int32_t> groups() const;
  /// Returns 1 for each strand that drives others, else 0.
  std::vector<int16_t> guides() const;
  /// Ids of the guides that a strand hangs between, and shares, three for each strand; none if no guides are
  /// exported with what hangs between them.
  struct Influence {
    std::vector<int32_t> id;
    std::vector<float> share;
  };
  Influence influence() const;
  /// Returns the name of the curves that each strand belongs to; empty if no file says it.
  std::vector<std::string> names() const;
  /// Returns what the hair is made of, in kg and the file's lengths; nothing if no file says it.
  HairMaterial material() const;
  /// Counts the strands that have no length in points of a frame, having lost it since the first one.
  uint32_t collapsed_count(std::span<const glm::dvec3> points) const;

  /// Returns the vertices of the head on its pose, in the file's units and axes; none if it is not exported.
  std::vector<glm::dvec3> head_points(const Pose& world_from_head) const;
  std::vector<glm::dvec3> rest_head_points() const { return head_points(first_pose_); }
  /// Returns the head's triangles, counter-clockwise seen from outside.
  std::span<const glm::uvec3> head_triangles() const;

 private:
  /// One strand of the file.
  struct Member {
    uint32_t strand = 0;  // of shape_
    uint32_t key = 0;     // the simulated strand that it is, or that is nearest to it
    bool is_key = true;
  };

  static const std::vector<glm::vec3>& rest_position_m(const ExportScene& scene);
  std::vector<Member> members_of_all(std::span<const glm::vec3> rest_m) const;
  std::vector<glm::vec3> in_head(const std::vector<glm::vec3>& position_m) const;
  glm::dvec3 in_file(const glm::vec3& point_in_head, const Pose& world_from_head) const;

  ExportScene scene_;
  ExportOptions options_;
  Pose first_pose_;
  uint32_t key_count_ = 0;       // simulated strands in the shape, which come first
  ExportShape shape_;            // of all strands
  std::vector<Member> members_;  // those that are not left out
  std::vector<uint32_t> vertex_counts_;
  uint32_t vertex_count_ = 0;
  uint32_t left_out_count_ = 0;
  std::vector<float> width_;
};

}  // namespace strandcast
