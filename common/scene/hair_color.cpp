#include "common/scene/hair_color.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace strandcast {
namespace {

// Chosen by eye under the built-in scene's light, which shows them as a path tracer does; tips are bleached
// by the sun.
constexpr std::array<HairColorPreset, 6> kPresets{{
    {"black", {{0.006f, 0.0045f, 0.0038f}, {0.012f, 0.009f, 0.0075f}}},
    {"brown", {{0.042f, 0.018f, 0.008f}, {0.115f, 0.050f, 0.020f}}},
    {"blond", {{0.330f, 0.190f, 0.080f}, {0.620f, 0.420f, 0.205f}}},
    {"red", {{0.150f, 0.033f, 0.010f}, {0.310f, 0.082f, 0.024f}}},
    {"grey", {{0.300f, 0.300f, 0.310f}, {0.500f, 0.500f, 0.510f}}},
    {"dyed", {{0.038f, 0.012f, 0.140f}, {0.170f, 0.038f, 0.400f}}},
}};

const glm::dvec3 kEumelaninAbsorption(0.419, 0.697, 1.37);
const glm::dvec3 kPheomelaninAbsorption(0.187, 0.4, 1.05);

// Between the root of the absorption and the logarithm of the colour (Chiang et al. 2016, equation 9).
constexpr double color_fit(double b) {
  const double b2 = b * b;
  return 5.969 - 0.215 * b + 2.532 * b2 - 10.73 * b2 * b + 5.574 * b2 * b2 + 0.245 * b2 * b2 * b;
}

}  // namespace

std::span<const HairColorPreset> hair_color_presets() {
  return kPresets;
}

bool is_hair_color(std::string_view name) {
  return name == "custom" || name == "melanin" ||
         std::any_of(kPresets.begin(), kPresets.end(),
                     [&](const HairColorPreset& preset) { return preset.name == name; });
}

glm::dvec3 absorption_of_melanin(double eumelanin, double pheomelanin) {
  return kEumelaninAbsorption * eumelanin + kPheomelaninAbsorption * pheomelanin;
}

glm::dvec3 absorption_of_color(const glm::dvec3& color, double roughness) {
  const glm::dvec3 root = glm::log(color) / color_fit(roughness);
  return root * root;
}

glm::dvec3 color_of_absorption(const glm::dvec3& absorption, double roughness) {
  return glm::exp(-color_fit(roughness) * glm::sqrt(glm::max(absorption, 0.0)));
}

glm::vec3 color_of_melanin(float eumelanin, float pheomelanin) {
  return glm::vec3(color_of_absorption(absorption_of_melanin(eumelanin, pheomelanin)));
}

HairColors colors_of(const LookDesc& look) {
  if (look.hair_color == "melanin") {
    const glm::vec3 color = color_of_melanin(look.eumelanin, look.pheomelanin);
    return {color, color};
  }
  for (const HairColorPreset& preset : kPresets)
    if (preset.name == look.hair_color) return preset.colors;
  return {look.root_color, look.tip_color};
}

}  // namespace strandcast
