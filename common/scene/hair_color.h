// Colours of hair: presets by name, and the colour that an amount of melanin gives. Pure functions, any
// thread.
#pragma once

#include <glm/glm.hpp>
#include <span>
#include <string_view>

#include "common/scene/scene_desc.h"

namespace strandcast {

/// Linear RGB, 0..1: what is left of white light that was scattered many times among such strands.
struct HairColors {
  glm::vec3 root{0.0f};
  glm::vec3 tip{0.0f};
};

struct HairColorPreset {
  std::string_view name;
  HairColors colors;
};
std::span<const HairColorPreset> hair_color_presets();

/// "custom", "melanin" or the name of a preset.
bool is_hair_color(std::string_view name);
/// Said to whoever names another.
inline constexpr const char* kHairColorSentence =
    "must be custom, melanin, black, brown, blond, red, grey or dyed";

/// Absorption per strand radius of concentrations >= 0 (Chiang et al. 2016, section 4.2).
glm::dvec3 absorption_of_melanin(double eumelanin, double pheomelanin);
/// Absorption per strand radius with which hair as a whole has a colour, and back (their equation 9, a fit).
/// `roughness`: azimuthal, 0..1. Components of the colour within (0, 1].
inline constexpr double kUsualRoughness = 0.3;
glm::dvec3 absorption_of_color(const glm::dvec3& color, double roughness = kUsualRoughness);
glm::dvec3 color_of_absorption(const glm::dvec3& absorption, double roughness = kUsualRoughness);

/// The colour that hair with these concentrations has as a whole.
glm::vec3 color_of_melanin(float eumelanin, float pheomelanin);

/// What `look` asks for. An unknown name counts as "custom".
HairColors colors_of(const LookDesc& look);

}  // namespace strandcast
