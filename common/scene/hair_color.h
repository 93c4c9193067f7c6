// Colours of hair: presets by name, and colours from amounts of melanin. Pure functions, any thread.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <string_view>

#include "common/scene/scene_desc.h"

namespace strandcast {

/// Colours at root and tip, linear RGB, 0..1: the share of white light that leaves the hair after much
/// scattering between strands.
struct HairColors {
  glm::vec3 root{0.0f};
  glm::vec3 tip{0.0f};
};

struct HairColorPreset {
  std::string_view name;
  HairColors colors;
};
std::span<const HairColorPreset> hair_color_presets();

/// Returns whether `name` is "custom", "melanin" or a preset.
bool is_hair_color(std::string_view name);
/// Error sentence for an unknown name.
inline constexpr const char* kHairColorSentence =
    "must be custom, melanin, black, brown, blond, red, grey or dyed";

/// Returns absorption per strand radius for melanin concentrations >= 0 (Chiang et al. 2016, section 4.2).
glm::dvec3 absorption_of_melanin(double eumelanin, double pheomelanin);
/// Convert between the colour of hair as a whole and absorption per strand radius (equation 9 of Chiang et
/// al., a fit). `roughness`: azimuthal, 0..1. Colour components are within (0, 1].
inline constexpr double kUsualRoughness = 0.3;
glm::dvec3 absorption_of_color(const glm::dvec3& color, double roughness = kUsualRoughness);
glm::dvec3 color_of_absorption(const glm::dvec3& absorption, double roughness = kUsualRoughness);

/// Returns the colour of hair as a whole with these melanin concentrations.
glm::vec3 color_of_melanin(float eumelanin, float pheomelanin);

/// Returns the colours that `look` states; an unknown name counts as "custom".
HairColors colors_of(const LookDesc& look);

}  // namespace strandcast
