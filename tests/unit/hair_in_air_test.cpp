// Hair in air: the drag of a cylinder as it was measured, and what follows for hairs and locks.
#include "common/kernels/volume/hair_in_air.h"

#include <gtest/gtest.h>

#include <cmath>

namespace strandcast::hair_in_air_test {
namespace {

/// Sucker and Brauer 1975, whole.
double published_drag_coefficient(double reynolds) {
  return 6.8 * std::pow(reynolds, -0.89) + 1.96 / std::sqrt(reynolds) + 1.18 -
         4e-4 * reynolds / (1.0 + 3.64e-7 * reynolds * reynolds);
}

TEST(HairInAir, DragIsThatOfACylinder) {
  for (double reynolds = 0.03; reynolds < 45.0; reynolds *= 1.1)
    EXPECT_NEAR(drag_number(reynolds) / reynolds, published_drag_coefficient(reynolds),
                0.03 * published_drag_coefficient(reynolds))
        << reynolds;
}

// A hair of 0.1 mm has 1.02e-5 kg/m; the rates follow from that and the published coefficient.
TEST(HairInAir, ALoneHairIsCarriedWithinHundredthsOfASecond) {
  const AirDesc air;
  for (const double speed_mps : {0.1, 1.0, 3.0}) {
    const double reynolds = speed_mps * 1e-4 / kAirViscosityM2ps;
    const double force_npm =
        0.5 * kAirDensityKgpm3 * 1e-4 * published_drag_coefficient(reynolds) * speed_mps * speed_mps;
    const double rate_per_s = force_npm / (1.021e-5 * speed_mps);
    EXPECT_NEAR(air_rate_per_s(air, speed_mps), rate_per_s, 0.03 * rate_per_s) << speed_mps;
  }
  EXPECT_GT(air_rate_per_s(air, 1.0), 15.0);
}

// Half of the air moves with 10 to 15 hairs/cm^2 through a lock of 5 cm at 1 m/s, nearly all of it with those
// of a scalp.
TEST(HairInAir, ALockCarriesItsAirAlong) {
  AirDesc air;
  air.lock_width_m = 0.05;
  constexpr double kPerCm2 = 1e4;
  EXPECT_LT(carried_air_share(air, 10.0 * kPerCm2, 1.0), 0.5);
  EXPECT_GT(carried_air_share(air, 15.0 * kPerCm2, 1.0), 0.5);
  EXPECT_GT(carried_air_share(air, 150.0 * kPerCm2, 1.0), 0.9);
  EXPECT_EQ(carried_air_share(air, 0.0, 1.0), 0.0);
  EXPECT_NEAR(carried_air_share(air, kPerCm2, 0.0), 1.0, 1e-3);
  // Slow air is carried along more easily.
  for (double speed_mps = 0.1; speed_mps < 8.0; speed_mps *= 2.0)
    EXPECT_GT(carried_air_share(air, kPerCm2, speed_mps), carried_air_share(air, kPerCm2, 2.0 * speed_mps));
}

// Hair at rest in a wind leans as far as drag and weight say in steps of any length: other forces do as much
// less as drag does. Without that the lean goes with the step.
TEST(HairInAir, AHairLeansAlikeAtAnyStepRate) {
  const AirDesc air;
  constexpr double kWindMps = 1.0, kForceMps2 = 9.81;
  const double rate_per_s = air_rate_per_s(air, kWindMps);
  for (const double step_s : {1.0 / 30.0, 1.0 / 60.0, 1.0 / 960.0}) {
    const double taken_on = -std::expm1(-step_s * rate_per_s);
    // Speed against the force that drag and force agree on.
    const auto speed_mps = [&](double inertia) { return step_s * kForceMps2 / inertia / taken_on; };
    EXPECT_NEAR(speed_mps(inertia_in_air(step_s, rate_per_s)), kForceMps2 / rate_per_s, 1e-9) << step_s;
    EXPECT_GT(speed_mps(1.0), (1.0 + 0.3 * step_s * rate_per_s) * kForceMps2 / rate_per_s) << step_s;
  }
  EXPECT_EQ(inertia_in_air(1.0 / 60.0, 0.0), 1.0);
}

// Hair in front takes its part of a wind, and the more there is the more goes around: all of a thin wisp's
// comes, little of a thick lock's does. No lock is held by more than twice what a solid cylinder takes of it.
TEST(HairInAir, ADenseLockMeetsLittleWind) {
  const AirDesc air;
  EXPECT_NEAR(met_wind_share(carried_air_share(air, 1e2, 1.0)), 1.0, 1e-2);
  EXPECT_NEAR(2.0 * std::pow(met_wind_share(1.0), 2.0), 1.1, 1e-4);
  EXPECT_GT(arriving_wind_share(air, 1e4 * air.lock_width_m, 1.0), 0.9);
  EXPECT_LT(arriving_wind_share(air, 3e6 * air.lock_width_m, 1.0), 1e-2);
  EXPECT_EQ(arriving_wind_share(air, 0.0, 1.0), 1.0);
}

// Momentum of wind of 1 m/s gets 4 to 7 mm into 100 hairs/cm^2.
TEST(HairInAir, WindEndsWithinMillimetres) {
  const double depth_m = 1.0 / (1e6 * stopping_width_m(AirDesc{}, 1.0));
  EXPECT_GT(depth_m, 0.004);
  EXPECT_LT(depth_m, 0.007);
}

}  // namespace
}  // namespace strandcast::hair_in_air_test
