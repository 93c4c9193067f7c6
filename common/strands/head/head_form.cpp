#include "common/strands/head/head_form.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "common/strands/head/head_mesh.h"

namespace strandcast {
namespace head {
namespace {

constexpr double kBustEnd = -3.95;  // in skull radii
// The axis is that of head_field.cpp: along the neck, then straight down.
constexpr double kNeckAxisZ = -0.14, kNeckAxisY = -0.70, kNeckLean = 0.19, kBustAxisZ = -0.40;

struct FacePoint {
  int face = 0;
  double x = 0.0, y = 0.0;  // -1..1 across the face
};

FacePoint face_point(const glm::dvec3& d) {
  const glm::dvec3 size = glm::abs(d);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
  const double along = std::max(size[axis], 1e-300);
  const auto even = [&](double value) { return std::atan(value / along) * 4.0 / std::numbers::pi; };
  return {2 * axis + (d[axis] < 0.0 ? 1 : 0), even(d[(axis + 1) % 3]), even(d[(axis + 2) % 3])};
}

glm::dvec3 direction_of(const FacePoint& at) {
  glm::dvec3 d;
  const int axis = at.face / 2;
  d[axis] = at.face % 2 == 0 ? 1.0 : -1.0;
  d[(axis + 1) % 3] = std::tan(at.x * std::numbers::pi / 4.0);
  d[(axis + 2) % 3] = std::tan(at.y * std::numbers::pi / 4.0);
  return glm::normalize(d);
}

double center_of_row(int row) {
  return 2.0 * (row + 0.5) / kSide - 1.0;
}

}  // namespace

int cell_of(const glm::dvec3& direction) {
  const FacePoint at = face_point(direction);
  const auto row = [](double value) {
    return std::clamp(static_cast<int>((value + 1.0) / 2.0 * kSide), 0, kSide - 1);
  };
  return (at.face * kSide + row(at.y)) * kSide + row(at.x);
}

const std::vector<glm::dvec3>& cell_directions() {
  static const std::vector<glm::dvec3> kDirections = [] {
    std::vector<glm::dvec3> directions;
    for (int cell = 0; cell < kCells; ++cell)
      directions.push_back(direction_of(
          {cell / (kSide * kSide), center_of_row(cell % kSide), center_of_row(cell / kSide % kSide)}));
    return directions;
  }();
  return kDirections;
}

double blend(const std::vector<double>& field, const glm::dvec3& direction) {
  const FacePoint at = face_point(direction);
  const double x = (at.x + 1.0) / 2.0 * kSide - 0.5, y = (at.y + 1.0) / 2.0 * kSide - 0.5;
  const double low_x = std::floor(x), low_y = std::floor(y);
  const auto value = [&](double column, double row) {
    if (column >= 0.0 && row >= 0.0 && column < kSide && row < kSide)
      return field[static_cast<size_t>((at.face * kSide + static_cast<int>(row)) * kSide +
                                       static_cast<int>(column))];
    const FacePoint beyond{at.face, 2.0 * (column + 0.5) / kSide - 1.0, 2.0 * (row + 0.5) / kSide - 1.0};
    return field[static_cast<size_t>(cell_of(direction_of(beyond)))];
  };
  return std::lerp(std::lerp(value(low_x, low_y), value(low_x + 1.0, low_y), x - low_x),
                   std::lerp(value(low_x, low_y + 1.0), value(low_x + 1.0, low_y + 1.0), x - low_x),
                   y - low_y);
}

glm::dvec3 neck_axis(double y) {
  return {0.0, y, std::max(kNeckAxisZ + kNeckLean * (y - kNeckAxisY), kBustAxisZ)};
}

glm::dvec2 neck_grid(const glm::dvec3& u) {
  const glm::dvec3 offset = u - neck_axis(u.y);
  const double turns = std::atan2(offset.x, offset.z) / (2.0 * std::numbers::pi) + 1.0;
  const double row = (kNeckTop - u.y) / (kNeckTop - kBustEnd) * (kNeckRows - 1);
  return {std::clamp(row, 0.0, kNeckRows - 1.0), turns * kNeckColumns};
}

size_t neck_cell(int row, int column) {
  return static_cast<size_t>(std::clamp(row, 0, kNeckRows - 1) * kNeckColumns +
                             (column + kNeckColumns) % kNeckColumns);
}

}  // namespace head

namespace {

/// Down to here directions pull in full, and from there on not at all.
constexpr double kPullEnd = -1.4, kNoPull = -2.1;

/// The height at which a part of the built-in head comes to lie when its neck is longer.
double lowered(const HeadForm& form, double y) {
  return y -
         form.drop * std::clamp((head::kStretchTop - y) / (head::kStretchTop - head::kStretchEnd), 0.0, 1.0);
}

}  // namespace

double HeadForm::pull_at(const glm::dvec3& u) const {
  const double length = glm::length(u);
  const double share = std::clamp((u.y - kNoPull) / (kPullEnd - kNoPull), 0.0, 1.0);
  if (!(length > 0.0) || share == 0.0) return 1.0;
  return std::lerp(1.0, head::blend(pull, u / length), share * share * (3.0 - 2.0 * share));
}

double HeadForm::neck_width_at(const glm::dvec3& u) const {
  if (u.y >= head::kNeckTop) return 1.0;
  const glm::dvec2 at = head::neck_grid(u);
  const int row = static_cast<int>(at.x), column = static_cast<int>(at.y);
  const auto value = [&](int r, int c) { return neck_width[head::neck_cell(r, c % head::kNeckColumns)]; };
  return std::lerp(std::lerp(value(row, column), value(row, column + 1), at.y - column),
                   std::lerp(value(row + 1, column), value(row + 1, column + 1), at.y - column), at.x - row);
}

Mesh make_head(const HeadForm& form) {
  Mesh mesh = make_head(1.0f);
  for (glm::vec3& point : mesh.position_m) {
    glm::dvec3 u(point);
    const glm::dvec3 axis = head::neck_axis(u.y);
    u = axis + (u - axis) * form.neck_width_at(u);
    u.y = lowered(form, u.y);
    point = glm::vec3(form.center_m + form.radius_m * u * form.pull_at(u));
  }
  mesh.normal = compute_normals(mesh.position_m, mesh.triangle);
  mesh.form = std::make_shared<const HeadForm>(form);
  return mesh;
}

}  // namespace strandcast
