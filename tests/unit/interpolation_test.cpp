// What is shown between states, against motions whose truth is known at every moment.
#include "common/replay/interpolation.h"
#include "common/base/units.h"

#include <cmath>
#include <numbers>
#include <random>

#include "common/replay/position_blend.h"

namespace strandcast::interpolation_test {
namespace {

constexpr int kParts = 16;  // moments looked at between two states

int64_t ns(double seconds) {
  return std::llround(seconds * kNsPerS);
}

/// States of a motion that is known at every time, and what is shown between the middle two.
template <class Truth>
struct Around {
  Around(const Truth& truth, const KnotTimes& times_ns) : times(times_ns) {
    for (size_t i = 0; i < times.size(); ++i) states[i] = truth(static_cast<double>(times[i]) / kNsPerS);
  }
  PosedStrands cubic(int64_t time_ns) const {
    return blend({&states[0], &states[1], &states[2], &states[3]}, cubic_terms(times, time_ns));
  }
  PosedStrands line(int64_t time_ns) const {
    return blend(states[1], states[2], cubic_terms(times, time_ns).blend);
  }
  KnotTimes times;
  std::array<PosedStrands, 4> states;
};

/// Errors of both ways over a second and all moments between states `steps_s` apart, taken in turn.
struct Errors {
  double line_rms = 0.0;
  double cubic_rms = 0.0;
};
template <class Truth, class Measure>
Errors errors_of(const Truth& truth, const std::vector<double>& steps_s, const Measure& measure) {
  std::vector<int64_t> times = {0};
  for (size_t i = 0; times.back() < ns(1.1); ++i)
    times.push_back(times.back() + ns(steps_s[i % steps_s.size()]));
  double line = 0.0, cubic = 0.0;
  int count = 0;
  for (size_t i = 1; i + 2 < times.size(); ++i) {
    const Around around(truth, {times[i - 1], times[i], times[i + 1], times[i + 2]});
    for (int part = 0; part < kParts; ++part) {
      // In the middle of each part: the mean over all of them is the integral's but for 1 / kParts^2.
      const int64_t time_ns = times[i] + (times[i + 1] - times[i]) * (2 * part + 1) / (2 * kParts);
      const PosedStrands right = truth(static_cast<double>(time_ns) / kNsPerS);
      const double line_error = measure(around.line(time_ns), right);
      const double cubic_error = measure(around.cubic(time_ns), right);
      line += line_error * line_error;
      cubic += cubic_error * cubic_error;
      ++count;
    }
  }
  return {std::sqrt(line / count), std::sqrt(cubic / count)};
}

double head_space_error(const PosedStrands& shown, const PosedStrands& right) {
  double worst = 0.0;
  for (size_t i = 0; i < right.position_m.size(); ++i)
    worst = std::max(worst, glm::distance(glm::dvec3(shown.position_m[i]), glm::dvec3(right.position_m[i])));
  return worst;
}
double world_error(const PosedStrands& shown, const PosedStrands& right) {
  double worst = 0.0;
  for (size_t i = 0; i < right.position_m.size(); ++i)
    worst = std::max(worst, glm::distance(shown.world_from_head * glm::dvec3(shown.position_m[i]),
                                          right.world_from_head * glm::dvec3(right.position_m[i])));
  return worst;
}

constexpr double kRadiusM = 0.1;
constexpr double kTurnRadPerS = 3.0 * std::numbers::pi;  // one and a half rounds a second

PosedStrands on_circle(double t_s) {
  const double angle = kTurnRadPerS * t_s;
  return {{}, {glm::vec3(kRadiusM * std::cos(angle), 0.2, kRadiusM * std::sin(angle))}};
}

TEST(Interpolation, ErrsAsTheorySaysOnACircle) {
  // The line errs by h^2/2 s(1-s) |x''|, Lagrange's cubic by h^4/24 s(1-s)(1+s)(2-s) |x''''|; with u = s(1-s)
  // the squares' integrals are those of u^2: 1/30, and of u^2 (2+u)^2: 4/30 + 4/140 + 1/630.
  const double line_share = std::sqrt(1.0 / 30.0) / 2.0;
  const double cubic_share = std::sqrt(4.0 / 30.0 + 4.0 / 140.0 + 1.0 / 630.0) / 24.0;
  std::vector<Errors> errors;
  for (const double hz : {30.0, 60.0}) {
    const double turn = kTurnRadPerS / hz;  // |x''| h^2 = radius turn^2, |x''''| h^4 = radius turn^4
    errors.push_back(errors_of(on_circle, {1.0 / hz}, head_space_error));
    // Terms of higher order are a sixth of turn^2 at most.
    EXPECT_NEAR(errors.back().line_rms / (kRadiusM * line_share * std::pow(turn, 2)), 1.0, turn * turn / 6.0);
    EXPECT_NEAR(errors.back().cubic_rms / (kRadiusM * cubic_share * std::pow(turn, 4)), 1.0,
                turn * turn / 6.0 + 0.01)
        << hz;
  }
  EXPECT_NEAR(std::log2(errors[0].line_rms / errors[1].line_rms), 2.0, 0.05) << "order of convergence";
  EXPECT_NEAR(std::log2(errors[0].cubic_rms / errors[1].cubic_rms), 4.0, 0.1);
  EXPECT_LT(errors[0].cubic_rms, errors[1].line_rms / 10.0) << "30 Hz on cubics beside 60 Hz on lines";
}

TEST(Interpolation, TheCubicIsExactOnCubicsAtUnevenTimesAndInBothDirections) {
  const auto truth = [](double t) {
    const glm::dvec3 at = glm::dvec3(0.1, -0.2, 0.05) + t * glm::dvec3(1.0, 0.5, -2.0) +
                          t * t * glm::dvec3(-3.0, 8.0, 2.0) + t * t * t * glm::dvec3(40.0, -20.0, 10.0);
    return PosedStrands{{at, {1.0, 0.0, 0.0, 0.0}}, {glm::vec3(at)}};
  };
  for (const auto& [before, inner, after] : {std::array{1, 1, 1}, std::array{1, 2, 1}, std::array{2, 1, 1},
                                             std::array{1, 3, 2}, std::array{8, 1, 8}, std::array{1, 8, 1}}) {
    const int64_t tick_ns = 16'666'667;
    const KnotTimes times = {0, before * tick_ns, (before + inner) * tick_ns,
                             (before + inner + after) * tick_ns};
    const Around around(truth, times);
    const KnotTimes back = {-times[3], -times[2], -times[1], -times[0]};
    for (int part = 1; part < kParts; ++part) {
      const int64_t time_ns = times[1] + (times[2] - times[1]) * part / kParts;
      const PosedStrands shown = around.cubic(time_ns);
      const PosedStrands right = truth(static_cast<double>(time_ns) / kNsPerS);
      EXPECT_LT(head_space_error(shown, right), 3e-7) << before << inner << after << ' ' << part;
      EXPECT_LT(glm::distance(shown.world_from_head.position_m, right.world_from_head.position_m), 1e-12);
      const PosedStrands backwards =
          blend({&around.states[3], &around.states[2], &around.states[1], &around.states[0]},
                cubic_terms(back, -time_ns));
      EXPECT_LT(head_space_error(backwards, right), 3e-7);
    }
  }
}

TEST(Interpolation, KeepsToItsBoundAtUnevenTimes) {
  // Half the rate and back, frames that are lost.
  for (const std::vector<double>& ticks :
       std::vector<std::vector<double>>{{1, 2}, {1, 1, 2, 2}, {2, 2, 4}, {1, 1, 1, 3}, {1, 4}, {2, 1, 3}}) {
    std::vector<double> steps_s;
    for (const double tick : ticks) steps_s.push_back(tick / 60.0);
    const Errors errors = errors_of(on_circle, steps_s, head_space_error);
    EXPECT_LT(errors.cubic_rms, 0.1 * errors.line_rms);
  }
  for (const auto& [before, inner, after] : {std::array{1, 2, 1}, std::array{2, 1, 1}, std::array{1, 1, 2},
                                             std::array{1, 3, 2}, std::array{4, 1, 4}}) {
    const int64_t tick_ns = ns(1.0 / 60.0);
    const KnotTimes times = {0, before * tick_ns, (before + inner) * tick_ns,
                             (before + inner + after) * tick_ns};
    const Around around(on_circle, times);
    for (int part = 1; part < kParts; ++part) {
      const int64_t time_ns = times[1] + (times[2] - times[1]) * part / kParts;
      double product = kRadiusM / 24.0;
      for (const int64_t knot_ns : times)
        product *= kTurnRadPerS * std::abs(static_cast<double>(time_ns - knot_ns)) / kNsPerS;
      EXPECT_LT(head_space_error(around.cubic(time_ns), on_circle(static_cast<double>(time_ns) / kNsPerS)),
                product + 1e-7);
    }
  }
}

/// A strand that swings about its root as a whole: its segments keep their lengths.
PosedStrands swinging(double t_s) {
  const double angle = 0.8 * std::sin(8.0 * t_s);
  PosedStrands strands;
  for (int v = 0; v < 8; ++v)
    strands.position_m.emplace_back(0.04 * v * std::sin(angle), 0.1 - 0.04 * v * std::cos(angle), 0.02);
  return strands;
}

TEST(Interpolation, SegmentsShrinkLessOnTheCubic) {
  const auto length_error = [](const PosedStrands& shown, const PosedStrands& right) {
    double worst = 0.0;
    for (size_t i = 1; i < right.position_m.size(); ++i) {
      const double length_m = glm::distance(shown.position_m[i], shown.position_m[i - 1]);
      EXPECT_LT(length_m, 0.04 * (1.0 + 1e-3)) << "nothing grows";
      worst = std::max(worst, std::abs(length_m - 0.04));
    }
    return worst;
  };
  const Errors errors = errors_of(swinging, {1.0 / 30.0}, length_error);
  // A chord of an angle d is shorter by d^2/8 in its middle: here by up to (0.8 x 8 / 30)^2 / 8 = 0.57 %.
  EXPECT_GT(errors.line_rms, 0.04 * 0.0015);
  EXPECT_LT(errors.line_rms, 0.04 * 0.0057);
  EXPECT_LT(errors.cubic_rms, 0.1 * errors.line_rms);
}

/// A head that looks from side to side and walks, with hair that stands still on it.
PosedStrands on_moving_head(double t_s) {
  Pose head;
  head.position_m = {0.05 * std::sin(7.0 * t_s), 0.03 * std::sin(11.0 * t_s), 1.3 * t_s};
  head.rotation = glm::angleAxis(0.9 * std::sin(6.0 * t_s), glm::dvec3(0.0, 1.0, 0.0)) *
                  glm::angleAxis(0.4 * std::sin(8.0 * t_s), glm::dvec3(1.0, 0.0, 0.0));
  return {head, {glm::vec3(0.0f, 0.1f, -0.25f)}};
}

TEST(Interpolation, TheHeadErrsByTheFourthOrderToo) {
  const Errors at30 = errors_of(on_moving_head, {1.0 / 30.0}, world_error);
  const Errors at60 = errors_of(on_moving_head, {1.0 / 60.0}, world_error);
  EXPECT_NEAR(std::log2(at30.line_rms / at60.line_rms), 2.0, 0.1);
  EXPECT_NEAR(std::log2(at30.cubic_rms / at60.cubic_rms), 4.0, 0.2);
  EXPECT_GT(at30.line_rms, 5e-4) << "more than hair between states is off: lines of the head would rule";
  EXPECT_LT(at30.cubic_rms, 0.05 * at30.line_rms);
}

TEST(Interpolation, ASteadyTurnStaysOne) {
  // The line (the shortest arc) is exact there, so the cubic must be nearly: the fifth order is left,
  // (turn / 2)^5 / 120 times the product of the distances to the states, at most 1.42 of a quarter turn's.
  const auto steady = [](double t_s) {
    return PosedStrands{{{}, glm::angleAxis(10.0 * t_s, glm::normalize(glm::dvec3(0.2, 1.0, -0.1)))},
                        {glm::vec3(0.0f)}};
  };
  const Around around(steady, {0, ns(1.0 / 30.0), ns(2.0 / 30.0), ns(3.0 / 30.0)});
  for (int part = 1; part < kParts; ++part) {
    const int64_t time_ns = around.times[1] + (around.times[2] - around.times[1]) * part / kParts;
    const PosedStrands shown = around.cubic(time_ns);
    const PosedStrands right = steady(static_cast<double>(time_ns) / kNsPerS);
    const glm::dquat apart = glm::conjugate(right.world_from_head.rotation) * shown.world_from_head.rotation;
    EXPECT_LT(2.0 * glm::length(glm::dvec3(apart.x, apart.y, apart.z)), 2.0 * std::pow(1.0 / 6.0, 5) / 60.0);
    EXPECT_NEAR(glm::length(shown.world_from_head.rotation), 1.0, 1e-12);
  }
}

TEST(Interpolation, MeetsTheStatesBitForBit) {
  const Around around(on_moving_head, {0, ns(0.03), ns(0.07), ns(0.1)});
  for (const size_t i : {1, 2}) {
    const PosedStrands shown = around.cubic(around.times[i]);
    EXPECT_EQ(shown.position_m, around.states[i].position_m);
    EXPECT_EQ(shown.world_from_head, around.states[i].world_from_head);
  }
  // Nor is there a jump just beside them.
  EXPECT_LT(world_error(around.cubic(around.times[1] + 1), around.states[1]), 1e-6);
  EXPECT_LT(world_error(around.cubic(around.times[2] - 1), around.states[2]), 1e-6);
}

/// Whatever happens at this time: a strand that is put back to rest, a head that is put elsewhere.
PosedStrands jumping(double t_s, double jump_s) {
  const float where = t_s < jump_s ? 0.0f : 0.3f;
  Pose head;
  head.position_m.x = t_s < jump_s ? 0.0 : 5.0;
  head.rotation = glm::angleAxis(t_s < jump_s ? 0.0 : 0.9, glm::dvec3(0.0, 1.0, 0.0));
  return {head, {glm::vec3(where, 0.1f, 0.0f), glm::vec3(0.0f, 0.1f + where, -where)}};
}

TEST(Interpolation, NothingSwingsOutBesideAJump) {
  for (const double jump_s : {0.5, 1.5, 2.5}) {
    const auto truth = [&](double t_s) { return jumping(30.0 * t_s, jump_s); };
    const Around around(truth, {0, ns(1.0 / 30.0), ns(2.0 / 30.0), ns(3.0 / 30.0)});
    for (int part = 1; part < kParts; ++part) {
      const int64_t time_ns = around.times[1] + (around.times[2] - around.times[1]) * part / kParts;
      const PosedStrands shown = around.cubic(time_ns), line = around.line(time_ns);
      EXPECT_EQ(shown.position_m, line.position_m) << jump_s;
      EXPECT_LT(glm::distance(shown.world_from_head.position_m, line.world_from_head.position_m), 1e-12);
      EXPECT_LT(angle_between_rad(shown.world_from_head.rotation, line.world_from_head.rotation), 1e-7);
    }
  }
}

TEST(Interpolation, BesideAJumpOfAnySizeTheCubicLeavesTheLineByHalfAUsualStep) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(-1.0f, 1.0f);
  for (int i = 0; i < 2'000; ++i) {
    const float usual[2] = {unit(random), unit(random)};
    const float jump = 40.0f * unit(random);
    const bool is_first = i % 2 == 0;
    const float x1 = is_first ? jump : usual[0];
    const float x2 = x1 + (is_first ? usual[0] : usual[1]);
    const float x3 = x2 + (is_first ? usual[1] : jump);
    PosedStrands states[4];
    size_t at = 0;
    for (const float x : {0.0f, x1, x2, x3}) states[at++].position_m = {glm::vec3(x)};
    const CubicTerms terms = cubic_terms({0, 32, 64, 96}, 32 + 1 + i % 31);
    const float cubic = blend({&states[0], &states[1], &states[2], &states[3]}, terms).position_m[0].x;
    const float line = blend(states[1], states[2], terms.blend).position_m[0].x;
    // In the middle, where it is most, the line bends by 1/16 of how much the outer steps differ; a jump that
    // still counts is eight times the others, and the last one of them is at most all of these.
    const float others = std::abs(usual[0]) + std::abs(usual[1]);
    EXPECT_LE(std::abs(cubic - line), 0.625f * others + 1e-5f) << i;
  }
}

TEST(Interpolation, AHeadThatTurnsTooFarGoesOnTheArc) {
  const auto spinning = [](double t_s) {
    return PosedStrands{{{}, glm::angleAxis(45.0 * t_s, glm::dvec3(0.0, 1.0, 0.0))}, {glm::vec3(0.0f)}};
  };
  const Around around(spinning, {0, ns(1.0 / 30.0), ns(2.0 / 30.0), ns(3.0 / 30.0)});
  const int64_t time_ns = ns(1.3 / 30.0);
  EXPECT_LT(angle_between_rad(around.cubic(time_ns).world_from_head.rotation,
                              spinning(1.3 / 30.0).world_from_head.rotation),
            1e-6);
  // A quaternion and its negative are the same turn.
  Around other(on_moving_head, around.times);
  const PosedStrands before = other.cubic(time_ns);
  other.states[2].world_from_head.rotation = -other.states[2].world_from_head.rotation;
  EXPECT_LT(world_error(other.cubic(time_ns), before), 1e-12);
}

// ---- lanes

TEST(Interpolation, AllInstructionSetsGiveTheBitsOfPlainLoops) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-0.3f, 0.3f);
  for (const size_t count : {1, 7, 8, 9, 24, 300}) {
    std::array<std::vector<float>, 4> states;
    for (auto& state : states)
      for (size_t i = 0; i < count; ++i) state.push_back(unit(random));
    for (size_t i = 0; i < count; i += 5) states[3][i] += 50.0f;  // a jump
    const CubicBlend terms{{states[0].data(), states[1].data(), states[2].data(), states[3].data()},
                           nullptr,
                           count,
                           0.3f,
                           1.5f,
                           0.75f,
                           -0.09f,
                           -0.04f};
    std::vector<float> line(count), cubic(count);
    for (size_t i = 0; i < count; ++i) {
      const float from = states[1][i], step = states[2][i] - from;
      line[i] = from + step * 0.3f;
      const float before = (from - states[0][i]) * 1.5f, after = (states[3][i] - states[2][i]) * 0.75f;
      const float bend = (step - before) * -0.09f + (after - step) * -0.04f;
      const float all = (std::abs(before) + std::abs(step)) + std::abs(after);
      const float largest = std::max({std::abs(before), std::abs(step), std::abs(after)});
      cubic[i] = line[i] + (largest > (all - largest) * kJumpSteps ? 0.0f : bend);
    }
    for (const simd::InstructionSet set : simd::instruction_sets()) {
      std::vector<float> out(count + 1, 7.0f);
      blend_on_line(set, {states[1].data(), states[2].data(), out.data(), count, 0.3f});
      EXPECT_EQ(std::vector<float>(out.begin(), out.end() - 1), line) << to_string(set) << ' ' << count;
      CubicBlend work = terms;
      work.out = out.data();
      blend_on_cubic(set, work);
      EXPECT_EQ(std::vector<float>(out.begin(), out.end() - 1), cubic) << to_string(set) << ' ' << count;
      EXPECT_EQ(out.back(), 7.0f) << "nothing is written behind the end";
    }
  }
}

// ---- which of them

std::deque<std::shared_ptr<const Snapshot>> states_at(const std::vector<int64_t>& times_ms) {
  std::deque<std::shared_ptr<const Snapshot>> states;
  for (const int64_t time_ms : times_ms) {
    auto snapshot = std::make_shared<Snapshot>();
    snapshot->sim_time_ns = time_ms * 1'000'000;
    states.push_back(std::move(snapshot));
  }
  return states;
}

TEST(Interpolation, TakesTheCubicWhereFourStatesAreNearEnough) {
  const auto chosen = [](const std::vector<int64_t>& times_ms, size_t later) {
    return choose_interpolation(states_at(times_ms), later);
  };
  const auto is_none = testing::Eq(Interpolation::None);
  const auto is_line = testing::Eq(Interpolation::Linear);
  const auto is_cubic = testing::Eq(Interpolation::Cubic);
  EXPECT_THAT(chosen({}, 0), is_none);
  EXPECT_THAT(chosen({0}, 0), is_none);
  EXPECT_THAT(chosen({0, 33}, 0), is_none) << "before all states";
  EXPECT_THAT(chosen({0, 33}, 2), is_none) << "behind all states";
  EXPECT_THAT(chosen({0, 33}, 1), is_line);
  EXPECT_THAT(chosen({0, 33, 67}, 1), is_line) << "none before";
  EXPECT_THAT(chosen({0, 33, 67}, 2), is_line) << "none after";
  EXPECT_THAT(chosen({0, 33, 67, 100}, 1), is_line);
  EXPECT_THAT(chosen({0, 33, 67, 100}, 2), is_cubic);
  EXPECT_THAT(chosen({0, 33, 67, 100}, 3), is_line);
  EXPECT_THAT(chosen({0, 17, 50, 83}, 2), is_cubic) << "half the states from now on";
  EXPECT_THAT(chosen({0, 33, 50, 67}, 2), is_cubic) << "all again";
  EXPECT_THAT(chosen({0, 17, 67, 83}, 2), is_cubic) << "two frames were lost";
  EXPECT_THAT(chosen({0, 150, 300, 450}, 2), is_cubic);
  EXPECT_THAT(chosen({0, 150, 301, 450}, 2), is_line) << "a long gap";
  EXPECT_THAT(chosen({0, 151, 300, 450}, 2), is_line);
  EXPECT_THAT(chosen({0, 150, 300, 451}, 2), is_line);
  EXPECT_THAT(chosen({0, 10, 91, 110}, 2), is_line) << "very uneven";
  EXPECT_THAT(chosen({0, 81, 91, 110}, 2), is_line);
}

}  // namespace
}  // namespace strandcast::interpolation_test
