#include "client/window/form.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace strandcast {
namespace {

constexpr double kDegPerRad = 57.29577951308232;
// IEC 61966-2-1, equations 5 to 8.
constexpr float kLinearEnd = 0.0031308f;
constexpr float kShownEnd = 0.04045f;
constexpr float kLinearSlope = 12.92f;
constexpr float kGamma = 2.4f;
constexpr float kOffset = 0.055f;

}  // namespace

void FormActions::add(FormActions later) {
  edits.insert(edits.end(), std::make_move_iterator(later.edits.begin()),
               std::make_move_iterator(later.edits.end()));
  if (later.file) file = std::move(later.file);
  wants_save = wants_save || later.wants_save;
  wants_undo = wants_undo || later.wants_undo;
  wants_share = wants_share || later.wants_share;
}

DirectionAngles angles_of(const glm::vec3& direction) {
  const glm::dvec3 from = -glm::normalize(glm::dvec3(direction));
  return {std::atan2(from.x, from.z) * kDegPerRad, std::asin(std::clamp(from.y, -1.0, 1.0)) * kDegPerRad};
}

glm::vec3 direction_of(const DirectionAngles& angles, float length) {
  const double azimuth = angles.azimuth_deg / kDegPerRad;
  const double elevation = angles.elevation_deg / kDegPerRad;
  const glm::dvec3 from(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                        std::cos(elevation) * std::cos(azimuth));
  return glm::vec3(-from * static_cast<double>(length));
}

float to_srgb(float linear) {
  if (linear <= kLinearEnd) return kLinearSlope * linear;
  return (1.0f + kOffset) * std::pow(linear, 1.0f / kGamma) - kOffset;
}

float from_srgb(float shown) {
  if (shown <= kShownEnd) return shown / kLinearSlope;
  return std::pow((shown + kOffset) / (1.0f + kOffset), kGamma);
}

}  // namespace strandcast
