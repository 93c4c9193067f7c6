// The tractrix step against its closed form, the equation of motion and the limit it is of Follow-The-Leader,
// in double and on the GPU.
#include <algorithm>
#include <numeric>
#include <set>

#include "common/base/hash.h"
#include "server/sim/solvers/tractrix/tractrix_step.h"
#include "tests/support/solver_fixture.h"

namespace strandcast::tractrix_test {
namespace {

constexpr double kSubstepS = 1.0 / 60.0;

/// Tail of a segment of length 1 that stood at right angles to the way its head has gone.
glm::dvec3 pulled_sideways(double way) {
  return {way - std::tanh(way), 1.0 / std::cosh(way), 0.0};
}

glm::dvec3 random_direction(uint32_t seed) {
  const auto number = [seed](uint32_t salt) { return 2.0 * unit_float(mix_u32(4 * seed + salt)) - 1.0; };
  return glm::normalize(glm::dvec3(number(0), number(1), number(2)));
}

/// The equation of motion, L du/dx = (s.u) u - s, in Runge-Kutta steps; knows nothing of its solution.
glm::dvec3 integrated_direction(glm::dvec3 u, const glm::dvec3& s, double way_per_length) {
  constexpr int kSteps = 4000;
  const double h = way_per_length / kSteps;
  const auto rate = [&s](const glm::dvec3& at) { return glm::dot(s, at) * at - s; };
  for (int i = 0; i < kSteps; ++i) {
    const glm::dvec3 k1 = rate(u);
    const glm::dvec3 k2 = rate(u + 0.5 * h * k1);
    const glm::dvec3 k3 = rate(u + 0.5 * h * k2);
    const glm::dvec3 k4 = rate(u + h * k3);
    u += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  return u;
}

TEST(TractrixStep, HasTheValuesOfTheCurve) {
  const double table[][3] = {{0.5, 0.037883, 0.886819},
                             {1.0, 0.238406, 0.648054},
                             {2.0, 1.035972, 0.265802},
                             {3.0, 2.004945, 0.099328}};
  for (const auto& [way, x, y] : table) {
    const glm::dvec3 tail = tractrix_followed(glm::dvec3(0.0), {way, 0.0, 0.0}, {0.0, 1.0, 0.0}, 1.0);
    EXPECT_NEAR(tail.x, x, 6e-7);
    EXPECT_NEAR(tail.y, y, 6e-7);
  }
  for (double way = 1e-6; way < 1e6; way *= 3.7) {
    for (const double length_m : {1e-3, 0.02, 5.0}) {
      const glm::dvec3 tail =
          tractrix_followed(glm::dvec3(0.0), {way * length_m, 0.0, 0.0}, {0.0, length_m, 0.0}, length_m);
      EXPECT_LE(glm::distance(tail, length_m * pulled_sideways(way)), 1e-15 * length_m * (4.0 + way));
    }
  }
}

TEST(TractrixStep, SolvesTheEquationOfMotionFromAnyDirection) {
  for (uint32_t seed = 0; seed < 40; ++seed) {
    const glm::dvec3 u = random_direction(2 * seed);
    const glm::dvec3 s = random_direction(2 * seed + 1);
    const double way = 0.1 + 0.1 * seed;
    const glm::dvec3 head = way * s;
    const glm::dvec3 tail = tractrix_followed(glm::dvec3(0.0), head, u, 1.0);
    EXPECT_LE(glm::distance(tail - head, integrated_direction(u, s, way)), 1e-9) << "seed " << seed;
    EXPECT_NEAR(glm::distance(tail, head), 1.0, 1e-14);
    EXPECT_LE(glm::distance(tail, u), way + 1e-14) << "the tail moves no further than the head";
  }
}

TEST(TractrixStep, ManySmallStepsAreOneLargeStepAndTheWayBackUndoesIt) {
  for (uint32_t seed = 0; seed < 20; ++seed) {
    const glm::dvec3 start = random_direction(seed);
    const glm::dvec3 way = 2.5 * random_direction(seed + 100);
    const glm::dvec3 at_once = tractrix_followed(glm::dvec3(0.0), way, start, 1.0);
    for (const int steps : {2, 7, 100}) {
      glm::dvec3 tail = start;
      for (int i = 0; i < steps; ++i)
        tail = tractrix_followed(way * (i / double(steps)), way * ((i + 1) / double(steps)), tail, 1.0);
      EXPECT_LE(glm::distance(tail, at_once), 1e-12) << steps << " steps";
    }
    EXPECT_LE(glm::distance(tractrix_followed(way, glm::dvec3(0.0), at_once, 1.0), start), 1e-13);
  }
}

// S = 0, S along T in both senses, a head that goes towards its tail and past it, no length, no direction.
TEST(TractrixStep, SpecialCasesAreLimitsOfTheGeneralOne) {
  const glm::dvec3 origin(0.0);
  const glm::dvec3 x_axis(1.0, 0.0, 0.0);
  const glm::dvec3 tail(0.3, -0.4, 1.2);
  EXPECT_EQ(tractrix_followed(origin, origin, tail, 1.3), tail);
  EXPECT_EQ(tractrix_followed(origin, -2.0 * x_axis, x_axis, 1.0), -x_axis) << "pulled along itself";
  EXPECT_EQ(tractrix_followed(origin, 2.0 * x_axis, x_axis, 1.0), 3.0 * x_axis) << "pushed along itself";
  // Next to the equilibrium the segment turns around; when, the logarithm of its angle says: half of the turn
  // is over at a way of L ln(2 / angle).
  for (const double angle : {1e-3, 1e-8, 1e-12}) {
    const glm::dvec3 aside(std::cos(angle), std::sin(angle), 0.0);
    const glm::dvec3 head = -std::log(std::tan(0.5 * angle)) * x_axis;
    const glm::dvec3 half = tractrix_followed(origin, head, aside, 1.0) - head;
    EXPECT_LE(glm::distance(half, glm::dvec3(0.0, 1.0, 0.0)), 1e-3) << angle;
    const glm::dvec3 far = 100.0 * x_axis;
    EXPECT_LE(glm::distance(tractrix_followed(origin, far, aside, 1.0) - far, -x_axis), 1e-12);
  }
  EXPECT_EQ(tractrix_followed(origin, x_axis, origin, 0.0), x_axis);
  EXPECT_EQ(tractrix_followed(origin, x_axis, origin, 1.0), x_axis) << "carried along";
}

// Follow-The-Leader puts the tail onto the line from the new head to the old tail: right to first order of
// the step, so the error over a given way falls with the step.
TEST(TractrixStep, FollowTheLeaderConvergesToItWithTheFirstOrder) {
  const glm::dvec3 way(2.0, 0.5, 0.0);
  const glm::dvec3 start(0.0, 0.6, 0.8);
  const glm::dvec3 exact = tractrix_followed(glm::dvec3(0.0), way, start, 1.0);
  const auto error = [&](int steps) {
    glm::dvec3 tail = start;
    for (int i = 1; i <= steps; ++i) {
      const glm::dvec3 head = way * (i / double(steps));
      tail = head + glm::normalize(tail - head);
    }
    return glm::distance(tail, exact);
  };
  for (const int steps : {32, 64, 128, 256}) {
    const double order = std::log2(error(steps) / error(2 * steps));
    EXPECT_NEAR(order, 1.0, 0.05) << steps << " steps";
    fmt::print("follow-the-leader, {} steps: error {:.2e}, order {:.3f}\n", steps, error(steps), order);
  }
}

TEST(TractrixOrder, IsAPermutationThatFavoursNobody) {
  for (uint32_t count = 1; count <= 64; ++count) {
    for (uint32_t seed = 0; seed < 20; ++seed) {
      const std::vector<uint32_t> order = shuffled_order(count, mix_u32(seed));
      EXPECT_EQ(std::set<uint32_t>(order.begin(), order.end()).size(), count);
      EXPECT_EQ(order.size(), count);
      EXPECT_EQ(*std::max_element(order.begin(), order.end()), count - 1);
    }
  }
  constexpr uint32_t kCount = 14;
  constexpr int kDraws = 14'000;
  std::vector<int> first(kCount, 0);
  std::vector<int> last(kCount, 0);
  for (uint32_t seed = 0; seed < kDraws; ++seed) {
    const std::vector<uint32_t> order = shuffled_order(kCount, mix_u32(seed));
    ++first[order.front()];
    ++last[order.back()];
  }
  // 1,000 each, with a standard deviation of 30.
  for (const auto* counts : {&first, &last}) {
    for (const int count : *counts) EXPECT_NEAR(count, 1000, 150);
  }
}

class TractrixRows : public SolverTest {
 protected:
  static std::vector<SolverKind> kinds() {
    std::vector<SolverKind> result;
    for (const SolverKind& kind : all_kinds()) {
      if (kind.row->name == "tractrix_emulation" || kind.row->name == "tractrix_split")
        result.push_back(kind);
    }
    return result;
  }
};

/// Strands of one segment each, of many lengths and directions, with their roots in one point.
struct Spokes {
  glm::dvec3 root{0.3, 0.0, 0.0};
  std::vector<double> length_m;
  std::vector<glm::dvec3> direction;

  Groom groom() const {
    std::vector<std::vector<glm::vec3>> strands;
    for (size_t i = 0; i < length_m.size(); ++i)
      strands.push_back({glm::vec3(root), glm::vec3(root + length_m[i] * direction[i])});
    return groom_from(strands, Pinning::Root);
  }
};

// A head that turns moves the roots along a chord, without any force on limp strands: the kernels show their
// bare step, for ways of a thousandth of a segment to a thousand segments.
TEST_F(TractrixRows, ATurnedHeadShowsTheExactStepForAnyStepSize) {
  const glm::dquat turn = glm::angleAxis(1.2, glm::dvec3(0.0, 1.0, 0.0));
  Spokes spokes;
  const glm::dvec3 shift = turn * spokes.root - spokes.root;
  const glm::dvec3 s = glm::normalize(shift);
  const glm::dvec3 y_axis(0.0, 1.0, 0.0);
  for (double length_m = 3e-4; length_m < 300.0; length_m *= 2.0) {
    spokes.length_m.insert(spokes.length_m.end(), 4, length_m);
    spokes.direction.insert(spokes.direction.end(), {y_axis, -s, random_direction(3), random_direction(4)});
  }
  const Groom groom = spokes.groom();
  StepInput input = calm_input();
  input.world_from_head_rotation = turn;
  for (const SolverKind& kind : kinds()) {
    SCOPED_TRACE(kind.name());
    auto solver = make(kind, groom, {{"style_stiffness_per_s2", 0.0}, {"style_mix", 0.0}});
    solver->substep(input);
    const SolverState state = read(*solver);
    const size_t count = spokes.length_m.size();
    for (size_t i = 0; i < count; ++i) {
      const double length_m = spokes.length_m[i];
      const glm::dvec3 head(state.position_m[i]);
      const glm::dvec3 edge = glm::dvec3(state.position_m[count + i]) - head;
      const double way = glm::length(shift) / length_m;
      const glm::dvec3 u = spokes.direction[i];
      const glm::dvec3 closed = -std::tanh(way) * s + y_axis / std::cosh(way);
      const glm::dvec3 expected = i % 4 == 0 ? closed : integrated_direction(u, s, std::min(way, 40.0));
      // Positions are floats: a rounding of the root and of the tail, and of the direction they give.
      const double rounding_m = 2e-7 * (0.3 + length_m) + 1e-6 * length_m;
      EXPECT_LE(glm::distance(edge, length_m * expected), rounding_m) << "way " << way << ", " << i % 4;
      EXPECT_NEAR(glm::length(edge), length_m, 1.5e-7 * (0.3 + length_m));
    }
  }
}

/// Ten minutes of a head that moves for five seconds in ten.
struct Wear {
  double before_m = 0.0;  // mean distance from the style after a minute, head at rest
  double after_m = 0.0;   // after ten
  double shiver_m = 0.0;  // largest way of a vertex in the last step
};

class TractrixStyle : public TractrixRows {
 protected:
  static constexpr int kMinute = 3600;

  Wear wear(const SolverKind& kind, const SolverParameters& given, int minutes) {
    TestGroomDesc desc;
    desc.strand_count = 8;
    desc.vertex_count = 10;
    auto solver = make(kind, make_test_groom(desc), given);
    const SolverState style = read(*solver);
    const auto distance_m = [&] {
      const SolverState state = read(*solver);
      double sum = 0.0;
      for (size_t i = 0; i < style.position_m.size(); ++i)
        sum += glm::distance(state.position_m[i], style.position_m[i]);
      return sum / static_cast<double>(style.position_m.size());
    };
    Wear result;
    SolverState last;
    for (int step = 1; step <= minutes * kMinute; ++step) {
      const int phase = (step - 1) % 600;
      StepInput input;
      input.groom_gravity_in_head_mps2 = input.gravity_mps2;
      if (phase < 300) {
        input = moving_input(phase, kSubstepS);
        input.wind_mps = glm::dvec3(0.0);
        input.gusts.clear();
        input.colliders.clear();
      }
      if (step == minutes * kMinute) last = read(*solver);
      solver->substep(input);
      if (step == kMinute) result.before_m = distance_m();
    }
    result.after_m = distance_m();
    result.shiver_m = largest_distance_m(read(*solver).position_m, last.position_m);
    return result;
  }
};

// Zappe 2020, 4.2: strands find their style and then slowly leave it for the shape that gravity gives them.
// What does it: each step's fall is undone by the pull back to the root, which turns every segment towards
// hanging, and nothing in the style carries that. Cured by a style that carries the weight (sag_free); moves
// from the tip to the root with the reaction of each correction (s_damping) stop the shiver.
TEST_F(TractrixStyle, TenMinutesLeaveTheStyleOnlyAsPublished) {
  // Ten minutes by lanes, which take a tenth of the time that OpenGL takes on processors.
  const SolverKind kind{*find_solver("tractrix_emulation"), kLanesHost};
  const SolverParameters published = {{"sag_free", 0.0}, {"random_order", 1.0}, {"s_damping", 0.0}};
  const Wear before = wear(kind, published, 10);
  const Wear after = wear(kind, {}, 10);
  for (const auto& [name, result] : {std::pair{"published", before}, {"cured", after}}) {
    fmt::print("{}: {:.3f} mm from the style after 1 minute, {:.3f} after 10, shiver {:.4f} mm per step\n",
               name, 1e3 * result.before_m, 1e3 * result.after_m, 1e3 * result.shiver_m);
  }
  EXPECT_GT(before.after_m, 0.02) << "strands of 0.17 to 0.25 m";
  EXPECT_GT(before.shiver_m, 2e-4);
  EXPECT_LT(after.after_m, 1e-4);
  EXPECT_LT(after.after_m, 2.0 * after.before_m + 1e-6) << "it still drifts";
  EXPECT_LT(after.shiver_m, 1e-4);
}

TEST_F(TractrixStyle, TheRandomOrderIsSeededAndKeepsLengths) {
  const Groom groom = make_test_groom({});
  for (const SolverHost& host : solver_hosts()) {
    const SolverKind kind{*find_solver("tractrix_emulation"), host};
    const auto run = [&](double seed) {
      auto solver = make(kind, groom, {{"random_order", 1.0}, {"order_seed", seed}});
      for (int step = 1; step <= 60; ++step) {
        solver->substep(moving_input(step, kSubstepS));
        EXPECT_LE(length_excess_m(groom, read(*solver), 1e-5), 0.0) << "step " << step;
      }
      return read(*solver).position_m;
    };
    const auto first = run(7.0);
    EXPECT_EQ(first, run(7.0));
    EXPECT_NE(first, run(8.0));
  }
}

// In a random order the kernel visits vertices in the order that the reference does.
TEST_F(TractrixStyle, TheRandomOrderIsTheSameInKernelAndReference) {
  const Groom groom = make_test_groom({});
  const SolverParameters random = {{"random_order", 1.0}, {"style_stiffness_per_s2", 120.0}};
  for (const SolverHost& host : kernel_hosts()) {
    SCOPED_TRACE(host.name());
    auto kernel = make({*find_solver("tractrix_emulation"), host}, groom, random);
    auto reference = make({*find_solver("tractrix_emulation"), kReferenceHost}, groom, random);
    auto other = make({*find_solver("tractrix_emulation"), kReferenceHost}, groom,
                      {{"random_order", 1.0}, {"style_stiffness_per_s2", 120.0}, {"order_seed", 2.0}});
    for (int step = 1; step <= 4; ++step) {
      for (Solver* solver : {kernel.get(), reference.get(), other.get()})
        solver->substep(moving_input(step, kSubstepS));
    }
    const double apart_m = largest_distance_m(read(*kernel).position_m, read(*reference).position_m);
    EXPECT_LE(apart_m, 1e-5);
    EXPECT_GT(largest_distance_m(read(*other).position_m, read(*reference).position_m), 10.0 * apart_m);
  }
}

}  // namespace
}  // namespace strandcast::tractrix_test
