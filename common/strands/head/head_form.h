// HeadForm: how the built-in head is fitted under hair: placed, stretched, pulled by direction, its shoulders
// lowered and its neck narrowed. The same form gives the same mesh on every processor, so that an asset may
// hold the form alone. Any thread.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "common/strands/scene_asset.h"

namespace strandcast {
namespace head {

// Directions are the cells of a cube's six faces, evenly spaced in angle along both edges.
inline constexpr int kSide = 16;
inline constexpr int kCells = 6 * kSide * kSide;
/// Below this height, in skull radii, neck and bust give way to hair sideways.
inline constexpr double kNeckTop = -0.72;
inline constexpr int kNeckRows = 32, kNeckColumns = 24;
/// Between these heights the neck gets longer where shoulders sink.
inline constexpr double kStretchTop = -1.45, kStretchEnd = -2.05;

/// Returns the middle of each cell, as a direction.
const std::vector<glm::dvec3>& cell_directions();
int cell_of(const glm::dvec3& direction);
/// Returns a field on the directions, between the middles of its cells; neighbours across an edge of the cube
/// included.
double blend(const std::vector<double>& field, const glm::dvec3& direction);

/// Returns the middle of neck and bust at a height.
glm::dvec3 neck_axis(double y);
/// Returns row and column of a point of the neck on its grid of heights and azimuths.
glm::dvec2 neck_grid(const glm::dvec3& u);
size_t neck_cell(int row, int column);

}  // namespace head

struct HeadForm {
  glm::dvec3 center_m{0.0};
  glm::dvec3 radius_m{1.0};                                           // of the skull, by axis
  double drop = 0.0;                                                  // of the shoulders, in skull radii
  std::vector<double> pull = std::vector<double>(head::kCells, 1.0);  // (direction) factor on the radius
  std::vector<double> neck_width =
      std::vector<double>(head::kNeckRows * head::kNeckColumns, 1.0);  // (height x azimuth) factor

  /// Returns the factor on the radius at a point, in skull radii.
  double pull_at(const glm::dvec3& u) const;
  /// Returns the factor on the width of neck and bust there.
  double neck_width_at(const glm::dvec3& u) const;
};

/// Makes the built-in head in this form; the mesh names it.
Mesh make_head(const HeadForm& form);

}  // namespace strandcast
