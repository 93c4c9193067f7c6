#include "server/scene/first_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace strandcast {
namespace {

/// Of half a picture's height, how far from its middle hair may be; of a picture that is a little higher than
/// wide, how far to its sides.
constexpr float kShare = 0.95f;
constexpr float kSideShare = 0.85f;
/// Skull and chin about the head joint, m.
constexpr std::array kHeadM = {glm::vec3(0.0f, 0.12f, 0.0f), glm::vec3(0.0f, -0.13f, 0.05f)};
/// Of the vertices, what may hang or stick out of the picture.
constexpr size_t kOneOf = 20;

float all_but_some(std::vector<float>& values) {
  const auto last = values.begin() + static_cast<ptrdiff_t>(values.size() - 1 - (values.size() - 1) / kOneOf);
  std::nth_element(values.begin(), last, values.end());
  return *last;
}

}  // namespace

// A point beside the axis by `across`, and nearer than the place looked at by `near`, is within the picture
// where |across - shift| <= share tan(angle / 2) (distance - near): bounds of the shift and the distance that
// are linear.
CameraDesc first_camera(const CameraDesc& home, std::span<const glm::vec3> rest_in_head_m) {
  const float distance_m = glm::length(home.offset_m);
  if (rest_in_head_m.empty() || !(distance_m > 0.0f)) return home;
  const glm::vec3 back = home.offset_m / distance_m;
  const glm::vec3 right = glm::normalize(glm::cross(glm::vec3(0.0f, 1.0f, 0.0f), back));
  const glm::vec3 up = glm::cross(back, right);
  const float slope = std::tan(0.5f * home.fov_y_rad);
  float highest = -kFarthestFirstM;
  std::vector<float> deep, wide;
  const auto take = [&](const glm::vec3& point) {
    const glm::vec3 from_target = point - home.target_m;
    const float near = glm::dot(from_target, back), above = glm::dot(from_target, up);
    highest = std::max(highest, above + kShare * slope * near);
    deep.push_back(kShare * slope * near - above);
    wide.push_back(std::abs(glm::dot(from_target, right)) / (kSideShare * slope) + near);
  };
  std::for_each(kHeadM.begin(), kHeadM.end(), take);
  const float chin = *std::max_element(deep.begin(), deep.end());
  std::for_each(rest_in_head_m.begin(), rest_in_head_m.end(), take);
  const float lowest = -std::max(chin, all_but_some(deep)), aside = all_but_some(wide);
  const float wanted_m = std::max({distance_m, (highest - lowest) / (2.0f * kShare * slope), aside});
  CameraDesc camera = home;
  const float reach = kShare * slope * std::min(wanted_m, kFarthestFirstM);
  if (wanted_m > distance_m) camera.offset_m = std::min(wanted_m, kFarthestFirstM) * back;
  const float shift_m = highest - lowest > 2.0f * reach ? 0.5f * (highest + lowest)
                                                        : std::clamp(0.0f, highest - reach, lowest + reach);
  if (shift_m != 0.0f) camera.target_m += shift_m * up;
  return camera;
}

}  // namespace strandcast
