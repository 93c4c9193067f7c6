// What strandcast-report coherence runs: a small head of rods in the shake, and hair in air against the laws
// that it is held against.
#include "server/report/coherence_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <glm/trigonometric.hpp>

#include "common/scene/scene_file.h"
#include "server/report/crowded_hair.h"
#include "tests/support/test_grid.h"

namespace strandcast::coherence_study_test {
namespace {

using testing::HasSubstr;

CoherenceStudyDesc small_head() {
  CoherenceStudyDesc desc;
  desc.scene = built_in_scene_with({"groom.procedural.strand_count=500"}).value();
  desc.shake_s = 1.4;
  desc.settle_s = 0.5;
  desc.hold_s = 0.1;
  desc.look_s = 0.1;
  desc.moments = 6;
  return desc;
}

class CoherenceOfAHead : public testing::Test {
 protected:
  double incoherent_share(const HairCompany& company) {
    const auto found = measure_row(small_head(), {"row", "direct_rod", company}, *executor_);
    EXPECT_TRUE(found) << found.error().to_string();
    return found ? found->coherence.incoherent_share() : -1.0;
  }
  std::unique_ptr<Executor> executor_ = open_executor({"lanes", "auto", {}}).value();
};

// The counter-example is in the test: with air off, contact alone leaves more of the motion against the
// neighbours.
TEST_F(CoherenceOfAHead, AirMakesRodsMoveAsOne) {
  const double alone = incoherent_share({});
  const double contact = incoherent_share({.has_contact = true});
  const double full = incoherent_share({.has_contact = true, .has_air = true});
  EXPECT_LT(full, 0.5 * alone) << "contact " << contact;
  EXPECT_GT(contact, 1.3 * full) << "alone " << alone;
}

// The whole head in the whole shake; rates of steps that take longer are for nights.
TEST_F(CoherenceOfAHead, TheBuiltInHairMovesAsOne) {
  CoherenceStudyDesc desc;
  desc.scene = built_in_scene();
  desc.hold_s = desc.look_s = 0.1;
  double at_60_hz = 0.0;
  for (const double rate_hz : {60.0, 30.0, 240.0}) {
    if (rate_hz != 60.0 && test_grid() == TestGrid::Small) continue;
    SCOPED_TRACE(rate_hz);
    const HairCompany company{.has_contact = true, .has_air = true};
    const auto found = measure_row(
        desc, {"row", "direct_rod", company, rate_hz, false, rate_hz < 60.0 ? 2u : 1u}, *executor_);
    ASSERT_TRUE(found) << found.error().to_string();
    const Coherence& coherence = found->coherence;
    EXPECT_LE(coherence.incoherent_share(), 0.05);
    EXPECT_LE(coherence.lone_share(), 0.015);
    EXPECT_GE(coherence.order(), 0.91);
    if (rate_hz == 60.0) at_60_hz = coherence.incoherent_share();
    EXPECT_NEAR(coherence.incoherent_share(), at_60_hz, 0.2 * at_60_hz);
  }
}

// Of long steps rods take more than one, and the volume is as young then.
TEST_F(CoherenceOfAHead, AHeadMovesAsOneAtAnyStepRate) {
  const HairCompany company{.has_contact = true, .has_air = true};
  const double at_60_hz = incoherent_share(company);
  CoherenceStudyDesc desc = small_head();
  desc.scene =
      built_in_scene_with({"groom.procedural.strand_count=500", "quality=full", "step_rate_hz=30"}).value();
  EXPECT_EQ(desc.scene.substeps, 2u);
  const auto share_of = [&](uint32_t substeps) {
    return measure_row(desc, {"row", "direct_rod", company, 30.0, false, substeps}, *executor_)
        .value()
        .coherence.incoherent_share();
  };
  EXPECT_LT(share_of(2), 1.3 * at_60_hz);
  EXPECT_GT(share_of(1), 1.4 * at_60_hz) << "one substep";
}

// Drag and weight hold the hair together in each step, however long it is.
TEST_F(CoherenceOfAHead, OneHairLeansAsFarAsItsDragSays) {
  HangingHair hair;
  hair.groom = make_hanging_hair(12, 0.25f);
  hair.step_rate_hz = 60.0;
  hair.volume_cells = 8;
  for (const double wind_mps : {0.2, 1.0}) {
    hair.wind_mps = wind_mps;
    const auto lean = lean_rad(hair, *executor_);
    ASSERT_TRUE(lean) << lean.error().to_string();
    const double force = std::tan(lawful_lean_rad(wind_mps, 9.81));
    EXPECT_NEAR(std::tan(*lean), force, 0.01 * force) << wind_mps;
  }
  hair.company.has_air = false;
  EXPECT_NEAR(lean_rad(hair, *executor_).value(), 0.0, 1e-3) << "without air wind is not felt";
}

// 40,000 hairs in a lock of 6 cm, in 1 m/s: a cylinder as wide and as heavy, of the drag coefficient 1.1,
// leans by 0.57 degrees, and one of the hairs by 63.
TEST_F(CoherenceOfAHead, ALockLeansAboutAsASolidCylinder) {
  HangingHair lock;
  lock.groom = make_tuft(100, 12, kHangingLengthM, kHangingSeed);
  lock.hairs = 40'000.0;
  lock.step_rate_hz = 60.0;
  lock.company.has_contact = true;
  const double windless_rad = lean_rad(lock, *executor_).value();
  lock.wind_mps = 1.0;
  const double blown_deg = glm::degrees(lean_rad(lock, *executor_).value() - windless_rad);
  EXPECT_GT(blown_deg, 0.6 * 0.57);
  EXPECT_LT(blown_deg, 1.5 * 0.57);
  lock.hairs = 100.0;
  EXPECT_GT(glm::degrees(lean_rad(lock, *executor_).value() - windless_rad), 20.0) << "hardly any shelter";
}

// Mathieu: growth of modulation x frequency / 4 at twice the frequency, less the decay; none far from it.
TEST(MathieuSway, GrowsAtTwiceItsFrequencyAlone) {
  const MathieuSway sway{7.5, 0.1, 0.2, 15.0};
  EXPECT_NEAR(mathieu_growth_per_s(sway), 0.2 * 7.5 / 4.0 - 0.1, 0.01);
  MathieuSway far = sway;
  far.head_radps = 1.5 * 15.0;
  EXPECT_NEAR(mathieu_growth_per_s(far), -0.1, 1e-3);
}

TEST(CoherencePage, HasATableAndSaysWhatIsNotHeld) {
  CoherenceStudy study;
  for (const CoherenceRow& row : coherence_rows(false)) study.outcomes.emplace_back().row = row;
  const std::string page = coherence_page(study);
  EXPECT_THAT(page, HasSubstr("direct_rod, full"));
  EXPECT_THAT(page, HasSubstr("is not held here"));
  EXPECT_THAT(coherence_csv(study), HasSubstr("incoherent_share"));
}

}  // namespace
}  // namespace strandcast::coherence_study_test
