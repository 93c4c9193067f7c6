#include "common/scene/hair_color.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "common/scene/scene_file.h"

namespace strandcast::hair_color_test {
namespace {

TEST(HairColor, TheSentenceNamesEveryPreset) {
  for (const HairColorPreset& preset : hair_color_presets()) {
    EXPECT_NE(std::string(kHairColorSentence).find(preset.name), std::string::npos) << preset.name;
    EXPECT_TRUE(is_hair_color(preset.name));
  }
  EXPECT_FALSE(is_hair_color("purple"));
}

TEST(HairColor, NoMelaninIsWhiteAndMoreIsDarker) {
  EXPECT_EQ(color_of_melanin(0.0f, 0.0f), glm::vec3(1.0f));
  const glm::vec3 light = color_of_melanin(0.3f, 0.0f);
  const glm::vec3 dark = color_of_melanin(3.0f, 0.0f);
  for (int c = 0; c < 3; ++c) EXPECT_LT(dark[c], light[c]);
  EXPECT_GT(light.r, light.g);
  EXPECT_GT(light.g, light.b);
  const glm::vec3 red = color_of_melanin(0.0f, 1.0f);
  const glm::vec3 brown = color_of_melanin(1.0f, 0.0f);
  EXPECT_GT(red.r / red.b, brown.r / brown.b) << "pheomelanin leaves more red";
}

// Chiang et al. 2016, equation 9: sqrt(absorption) = ln(colour) / fit(roughness 0.3). For absorption 0.25 in
// every channel, the fit being 5.969 - 0.0645 + 0.22788 - 0.28971 + 0.04515 + 0.000595 = 5.88841.
TEST(HairColor, FollowsThePublishedFit) {
  const float eumelanin = 0.25f / 0.419f;
  EXPECT_NEAR(color_of_melanin(eumelanin, 0.0f).r, std::exp(-5.88841 * 0.5), 1e-5);
}

TEST(HairColor, AbsorptionAndColorAreInverseAtEveryRoughness) {
  const glm::dvec3 color(0.83, 0.41, 0.07);
  for (const double roughness : {0.0, 0.3, 0.7, 1.0}) {
    const glm::dvec3 back = color_of_absorption(absorption_of_color(color, roughness), roughness);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(back[c], color[c], 1e-12) << roughness;
  }
  // pbrt's default brown: 1.3 of eumelanin.
  EXPECT_NEAR(absorption_of_melanin(1.3, 0.0).b, 1.781, 1e-12);
  EXPECT_NEAR(absorption_of_melanin(1.0, 2.0).g, 1.497, 1e-12);
}

TEST(HairColor, IsChosenByName) {
  LookDesc look;
  EXPECT_EQ(colors_of(look).root, look.root_color);
  EXPECT_EQ(colors_of(look).tip, look.tip_color);
  look.hair_color = "melanin";
  EXPECT_EQ(colors_of(look).tip, color_of_melanin(look.eumelanin, look.pheomelanin));
  for (const HairColorPreset& preset : hair_color_presets()) {
    look.hair_color = preset.name;
    EXPECT_EQ(colors_of(look).root, preset.colors.root);
  }
}

TEST(HairColor, AnUnknownNameIsRefusedWithTheKnownOnes) {
  const auto scene = parse_scene("look { hair_color: \"purple\" }", "test", {});
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find(kHairColorSentence), std::string::npos) << scene.error().message;
}

}  // namespace
}  // namespace strandcast::hair_color_test
