// Fronts, picks and the question who beats whom; periods and growth out of sampled swings.
#include <cmath>
#include <limits>
#include <numbers>

#include "server/report/pareto.h"
#include "server/report/swing_fit.h"

namespace strandcast::pareto_test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

std::vector<WorkPoint> points() {
  return {{"rod", 2.0, 0.02, "rod A"},     {"rod", 4.0, 0.005, "rod B"},
          {"rod", 8.0, 0.006, "rod C"},    {"other", 1.0, 0.1, "other A"},
          {"other", 9.0, 0.05, "other B"}, {"other", 3.0, INFINITY, "blown up"}};
}

TEST(ParetoFront, HoldsWhatNothingIsBetterThan) {
  EXPECT_THAT(pareto_front(points()), ElementsAre(3, 0, 1));
  EXPECT_THAT(pareto_front({}), IsEmpty());
}

// Whatever the points: each off the front has one on it that is no slower and no less exact; on the front
// none has.
TEST(ParetoFront, DominatesEverythingElse) {
  std::vector<WorkPoint> many;
  for (int i = 0; i < 200; ++i) many.push_back({"m", 1.0 + (i * 37) % 101, 1.0 + (i * 53) % 97, ""});
  const std::vector<size_t> front = pareto_front(many);
  for (size_t i = 0; i < many.size(); ++i) {
    bool is_dominated = false;
    for (const size_t f : front) {
      is_dominated = is_dominated || (f != i && many[f].us <= many[i].us && many[f].error <= many[i].error);
    }
    EXPECT_NE(is_dominated, std::find(front.begin(), front.end(), i) != front.end()) << i;
  }
}

TEST(ParetoFront, PicksTheMostExactWithinTheBudget) {
  EXPECT_EQ(best_within(points(), 5.0), 1u);
  EXPECT_EQ(best_within(points(), 100.0), 1u);
  EXPECT_EQ(best_within(points(), 1.5), 3u);
  EXPECT_EQ(best_within(points(), 0.5), std::nullopt);
}

TEST(Beaten, NeedsBothAndAnErrorBelowTheLimit) {
  std::vector<WorkPoint> all = points();
  EXPECT_FALSE(find_beaten(all, "rod", 0.01));
  EXPECT_THAT(beaten_sentence(all, "rod", 0.01), StartsWith("No: for no error below 1 %"));
  all.push_back({"other", 5.0, 0.001, "slower but more exact"});
  all.push_back({"other", 0.1, 0.009, "faster but less exact"});
  EXPECT_FALSE(find_beaten(all, "rod", 0.01));
  // Beats only a run above the limit, and one that is not on the rod's own front.
  all.push_back({"other", 7.0, 0.0055, "beats rod C"});
  EXPECT_FALSE(find_beaten(all, "rod", 0.01));
  EXPECT_TRUE(find_beaten(all, "rod", 0.05));
  all.push_back({"other", 3.9, 0.0049, "better at all"});
  const auto beaten = find_beaten(all, "rod", 0.01);
  ASSERT_TRUE(beaten);
  EXPECT_EQ(all[beaten->winner].label, "better at all");
  EXPECT_EQ(all[beaten->champion].label, "rod B");
  EXPECT_THAT(beaten_sentence(all, "rod", 0.01), StartsWith("Yes: better at all"));
}

TEST(Beaten, SaysWhenThereIsNothingToBeat) {
  EXPECT_THAT(beaten_sentence(points(), "rod", 1e-4), HasSubstr("nothing to beat"));
  EXPECT_THAT(beaten_sentence({}, "rod", 0.01), HasSubstr("nothing to beat"));
}

std::vector<double> damped_swing(double omega, double decay, double sample_s, int count) {
  std::vector<double> q;
  for (int k = 0; k < count; ++k)
    q.push_back(std::exp(-decay * k * sample_s) * std::cos(omega * k * sample_s));
  return q;
}

TEST(SwingFit, FindsPeriodAndDamping) {
  const std::vector<double> q = damped_swing(7.0, 0.3, 0.01, 400);
  EXPECT_NEAR(swing_period_s(q, 0.01), 2.0 * std::numbers::pi / 7.0, 1e-3);
  const std::complex<double> root = swing_root(q);
  EXPECT_NEAR(std::arg(root), 0.07, 1e-9);
  EXPECT_NEAR(std::log(std::abs(root)), -0.003, 1e-9);
  EXPECT_TRUE(std::isnan(swing_period_s(std::vector<double>(50, 1.0), 0.01)));
}

TEST(SwingFit, FindsGrowthAndSwing) {
  std::vector<double> growing;
  for (int k = 0; k < 100; ++k) growing.push_back(std::cosh(2.0 * k * 0.01));
  EXPECT_NEAR(swing_growth_per_s2(growing, 0.01), 4.0, 1e-3);
  EXPECT_NEAR(swing_growth_per_s2(damped_swing(2.0, 0.0, 0.01, 100), 0.01), -4.0, 1e-3);
}

}  // namespace
}  // namespace strandcast::pareto_test
