// Wet hair: heavier, limper, closer together; dry hair is what it was.
#include "server/source/wet_hair.h"

#include <gtest/gtest.h>

namespace strandcast::wet_hair_test {
namespace {

TEST(WetHair, DryHairIsAsItWas) {
  VolumeDesc volume;
  volume.friction_per_s = 3.0;
  for (const SolverRow& row : solver_table()) {
    const SolverParameters dry = complete_parameters(row, {}).value();
    EXPECT_EQ(wet_parameters(row, dry, 0.0), dry) << row.name;
  }
  EXPECT_EQ(wet_volume(volume, 0.0), volume);
  SceneDesc scene;
  scene.volume.air.acts = true;
  const VolumeDesc of_rods = moving_volume(scene, {{"radius_m", 3e-5}, {"density_kgpm3", 1200.0}});
  EXPECT_EQ(of_rods.air.hair_radius_m, 3e-5) << "one hair, one radius";
  EXPECT_EQ(of_rods.air.hair_density_kgpm3, 1200.0);
  EXPECT_EQ(moving_volume(scene, {{"radius", 1.0}}), scene.volume);
  scene.look.shading.wetness = 1.0f;
  EXPECT_EQ(moving_volume(scene, {}).air.hair_density_kgpm3, kWetMass * kHairDensityKgpm3);
  EXPECT_EQ(wet_volume({}, 1.0), VolumeDesc{}) << "hair that does not act on hair goes on so";
}

TEST(WetHair, EveryModelGetsHeavierWithinItsRanges) {
  for (const SolverRow& row : solver_table()) {
    SCOPED_TRACE(row.name);
    const SolverParameters dry = complete_parameters(row, {}).value();
    SolverParameters before = dry;
    for (const double wetness : {0.3, 0.7, 1.0}) {
      const SolverParameters wet = wet_parameters(row, dry, wetness);
      EXPECT_TRUE(complete_parameters(row, wet)) << "within the row's ranges";
      EXPECT_LT(wet.at("air_drag_per_s"), before.at("air_drag_per_s"));
      before = wet;
    }
    EXPECT_NEAR(before.at("air_drag_per_s"), dry.at("air_drag_per_s") / kWetMass, 1e-12);
    if (dry.contains("density_kgpm3")) {
      EXPECT_GT(before.at("density_kgpm3"), dry.at("density_kgpm3"));
    }
    for (const char* same : {"max_speed_mps", "collider_friction"})
      if (dry.contains(same)) {
        EXPECT_EQ(before.at(same), dry.at(same));
      }
  }
}

TEST(WetHair, LiesCloserAndHoldsOn) {
  VolumeDesc dry;
  dry.repulsion_per_s2 = 18000.0;
  dry.target_per_s2 = 1000.0;
  const VolumeDesc half = wet_volume(dry, 0.5);
  const VolumeDesc wet = wet_volume(dry, 1.0);
  EXPECT_GT(half.rest_density_scale, dry.rest_density_scale);
  EXPECT_NEAR(wet.rest_density_scale, kWetDensity * dry.rest_density_scale, 1e-12);
  EXPECT_GT(wet.friction_per_s, half.friction_per_s);
  EXPECT_EQ(wet.target_per_s2, 0.0);
}

TEST(WetHair, ANewSolverIsNeededForAnotherWetness) {
  SceneDesc a;
  SceneDesc b = a;
  EXPECT_FALSE(moves_otherwise(a, b));
  b.look.exposure += 0.1f;
  EXPECT_FALSE(moves_otherwise(a, b)) << "a look that moves nothing";
  b.look.shading.wetness = 0.5f;
  EXPECT_TRUE(moves_otherwise(a, b));
}

}  // namespace
}  // namespace strandcast::wet_hair_test
