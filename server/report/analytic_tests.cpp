#include "server/report/analytic_tests.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "server/report/exact_solutions.h"
#include "server/report/swing_fit.h"

namespace strandcast {
namespace {

constexpr double kAnalyticLengthM = 0.3;
constexpr double kGravityMps2 = 9.81;
// Enough for a hair of 0.3 m to come to rest within kSettlingS: its slowest mode decays by omega^2 / drag > 2
// / s.
constexpr double kSettlingDragPerS = 20.0;
constexpr double kSettlingS = 6.0;
constexpr glm::dvec3 kDown(0.0, -1.0, 0.0);
constexpr const char* kBeadName = "tip_mass_kg";
constexpr glm::dvec3 kSideways(1.0, 0.0, 0.0);

AnalyticResult failed(const Error& error) {
  AnalyticResult result;
  result.note = error.to_string();
  return result;
}

/// A hair whose EI / (rho A) is b: Young's modulus is what is changed.
HairConstants hair_with(double b_m4ps2) {
  HairConstants hair;
  hair.young_modulus_pa = b_m4ps2 * 4.0 * hair.density_kgpm3 / (hair.radius_m * hair.radius_m);
  return hair;
}

/// A strand of a test with the largest stretch so far.
class TestStrand {
 public:
  static Result<TestStrand> make(const Workbench& workbench, const RunSetting& setting,
                                 const RunPhysics& physics, Groom groom) {
    ASSIGN_OR_RETURN(StrandRun run, StrandRun::make(workbench, setting, physics, groom));
    return TestStrand(std::move(run), std::move(groom));
  }
  void step(const StepInput& input) {
    run_.step(input);
    stretch_ = std::max(stretch_, largest_run_stretch(groom_, run_.state()));
  }
  glm::dvec3 vertex(size_t i) { return glm::dvec3(run_.state().position_m[i]); }
  size_t vertex_count() const { return groom_.rest_position_m.size(); }
  double stretch() const { return stretch_; }
  StrandRun& run() { return run_; }

 private:
  TestStrand(StrandRun run, Groom groom) : run_(std::move(run)), groom_(std::move(groom)) {}

  StrandRun run_;
  Groom groom_;
  double stretch_ = 0.0;
};

Result<TestStrand> make_straight(const Workbench& workbench, const RunSetting& setting,
                                 const RunPhysics& physics, const glm::dvec3& direction) {
  return TestStrand::make(
      workbench, setting, physics,
      groom_of({straight_run(setting.vertex_count, physics.length_m, direction)}, Pinning::Root));
}

void settle(TestStrand& strand, const glm::dvec3& gravity_mps2, double time_s) {
  StepInput input;
  input.gravity_mps2 = gravity_mps2;
  for (int step = 0; step < time_s * strand.run().setting().rate_hz; ++step) strand.step(input);
}

// T1: the shape at rest of a horizontal hair of that gamma.
AnalyticResult run_cantilever(const Workbench& workbench, const RunSetting& setting, double gamma) {
  const auto shapes = cantilever_shapes();
  const auto shape = std::find_if(shapes.begin(), shapes.end(),
                                  [&](const CantileverShape& candidate) { return candidate.gamma == gamma; });
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  physics.hair = hair_with(kGravityMps2 * std::pow(kAnalyticLengthM, 3) / gamma);
  physics.given = {{"air_drag_per_s", kSettlingDragPerS}};
  auto strand = make_straight(workbench, setting, physics, kSideways);
  if (!strand) return failed(strand.error());
  settle(*strand, kGravityMps2 * kDown, kSettlingS);
  const glm::dvec3 tip = strand->vertex(strand->vertex_count() - 1) / kAnalyticLengthM;
  AnalyticResult result;
  result.value = -tip.y / tip.x;
  result.exact = shape->height_over_width();
  result.error = glm::distance(tip, glm::dvec3(shape->x, -shape->y, 0.0));
  result.droop = -tip.y;
  result.stretch = strand->stretch();
  return result;
}

// T2: a horizontal hair with a bead at its tip, so heavy that its own weight does not count.
AnalyticResult run_end_load(const Workbench& workbench, const RunSetting& setting, double alpha) {
  constexpr double kBeadPerHair = 1000.0;
  const auto tips = end_load_tips();
  const auto exact = std::find_if(tips.begin(), tips.end(),
                                  [&](const EndLoadTip& candidate) { return candidate.alpha == alpha; });
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  physics.hair = hair_with(kBeadPerHair * kGravityMps2 * std::pow(kAnalyticLengthM, 3) / alpha);
  const double bead_kg = kBeadPerHair * physics.hair.linear_density_kgpm() * kAnalyticLengthM;
  physics.given = {{"air_drag_per_s", kSettlingDragPerS}, {kBeadName, bead_kg}};
  auto strand = make_straight(workbench, setting, physics, kSideways);
  if (!strand) return failed(strand.error());
  settle(*strand, kGravityMps2 * kDown, 2.0 * kSettlingS);
  const glm::dvec3 tip = strand->vertex(strand->vertex_count() - 1) / kAnalyticLengthM;
  AnalyticResult result;
  result.value = -tip.y;
  result.exact = exact->y;
  result.error = glm::distance(tip, glm::dvec3(exact->x, -exact->y, 0.0));
  result.stretch = strand->stretch();
  return result;
}

// T3: a hair whose natural shape is a closed circle, let go from straight: the moment of its natural
// curvature rolls it up until the tip is at the root.
AnalyticResult run_roll_up(const Workbench& workbench, const RunSetting& setting) {
  // Stiff enough for its slowest mode to decay within the time: omega = 3.516 sqrt(b) / L^2 = 15 / s.
  constexpr double kStiffness = 0.15;
  const uint32_t n = setting.vertex_count;
  const double radius_m = kAnalyticLengthM / (2.0 * std::numbers::pi);
  std::vector<glm::dvec3> circle;
  for (uint32_t i = 0; i < n; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / (n - 1);
    circle.push_back(radius_m * glm::dvec3(std::sin(angle), std::cos(angle) - 1.0, 0.0));
  }
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  physics.hair = hair_with(kStiffness);
  physics.given = {{"air_drag_per_s", kSettlingDragPerS}};
  auto strand = TestStrand::make(workbench, setting, physics, groom_of({circle}, Pinning::Root));
  if (!strand) return failed(strand.error());
  SolverState state = strand->run().state();
  const glm::dvec3 leaving = circle[1];
  for (uint32_t i = 0; i < n; ++i) state.position_m[i] = glm::vec3(leaving * static_cast<double>(i));
  strand->run().write(state);
  settle(*strand, glm::dvec3(0.0), kSettlingS);
  AnalyticResult result;
  result.value = result.error = glm::length(strand->vertex(n - 1)) / kAnalyticLengthM;
  result.exact = 0.0;
  result.stretch = strand->stretch();
  return result;
}

/// Displacements along an axis, weighted with a mode.
double project(const SolverState& state, const glm::dvec3& axis, const std::function<double(double)>& mode) {
  const size_t n = state.position_m.size();
  double sum = 0.0;
  for (size_t i = 0; i < n; ++i) {
    const double weight = i + 1 < n ? 1.0 : 0.5;
    sum += weight * mode(static_cast<double>(i) / static_cast<double>(n - 1)) *
           glm::dot(axis, glm::dvec3(state.position_m[i]));
  }
  return sum;
}

/// The strand displaced along `axis` by a mode, `amplitude` lengths at the tip.
void displace(StrandRun& run, const glm::dvec3& axis, double amplitude,
              const std::function<double(double)>& mode) {
  SolverState state = run.state();
  const size_t n = state.position_m.size();
  for (size_t i = 1; i < n; ++i)
    state.position_m[i] += glm::vec3(
        axis * (amplitude * kAnalyticLengthM * mode(static_cast<double>(i) / static_cast<double>(n - 1))));
  run.write(state);
}

/// Order of the row's time integration, where it says; else backward Euler.
int integration_order(const RunSetting& setting) {
  for (const SolverParameterInfo& info : setting.row->parameters) {
    if (info.name == "order") return static_cast<int>(std::lround(info.default_value));
  }
  return 1;
}

// T4 and T7: small swings of a hanging chain in its first mode: period, and damping against the integrator's.
AnalyticResult run_heavy_chain(const Workbench& workbench, const RunSetting& setting) {
  constexpr double kPeriods = 4.2;
  constexpr double kAmplitude = 1e-2;  // well above the rounding of float positions
  // An integrator of order 2 has no history to begin with: its first steps are of order 1.
  constexpr std::ptrdiff_t kStartSteps = 10;
  const auto mode = [](double s) { return chain_mode(s, 1); };
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  auto strand = make_straight(workbench, setting, physics, kDown);
  if (!strand) return failed(strand.error());
  displace(strand->run(), kSideways, kAmplitude, mode);
  const double omega = chain_frequency_radps(kAnalyticLengthM, kGravityMps2, 1);
  const double exact_s = 2.0 * std::numbers::pi / omega;
  StepInput input;
  input.gravity_mps2 = kGravityMps2 * kDown;
  std::vector<double> q = {project(strand->run().state(), kSideways, mode)};
  for (int step = 0; step < kPeriods * exact_s * setting.rate_hz; ++step) {
    strand->step(input);
    q.push_back(project(strand->run().state(), kSideways, mode));
  }
  AnalyticResult result;
  result.stretch = strand->stretch();
  result.exact = exact_s;
  result.value = swing_period_s(q, 1.0 / setting.rate_hz);
  result.error = result.period_error = std::abs(result.value / exact_s - 1.0);
  const double predicted =
      damping_per_radian(implicit_step_root(integration_order(setting), omega * setting.substep_s()));
  if (std::isnan(result.value)) {
    result.note = "does not swing";
  } else {
    result.damping_ratio =
        damping_per_radian(swing_root(std::vector<double>(q.begin() + kStartSteps, q.end()))) / predicted;
  }
  return result;
}

// T5: a horizontal hair on which a small weight is put at once: period and first swing of the beam.
AnalyticResult run_beam(const Workbench& workbench, const RunSetting& setting) {
  constexpr double kPeriodS = 1.787018;
  constexpr double kPeriods = 2.7;
  constexpr double kLoadMps2 = 0.01;
  constexpr double kFirstSwingPeriods = 0.7;  // the first maximum is at 0.49
  const double b =
      std::pow(2.0 * std::numbers::pi / kPeriodS / kBeamBetaSquared, 2) * std::pow(kAnalyticLengthM, 4);
  const double static_m = kLoadMps2 * std::pow(kAnalyticLengthM, 4) / (8.0 * b);
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  physics.hair = hair_with(b);
  auto strand = make_straight(workbench, setting, physics, kSideways);
  if (!strand) return failed(strand.error());
  StepInput input;
  input.gravity_mps2 = kLoadMps2 * kDown;
  SolverState bent = strand->run().state();
  for (size_t i = 0; i < bent.position_m.size(); ++i) {
    const double s = static_cast<double>(i) / static_cast<double>(bent.position_m.size() - 1);
    bent.position_m[i].y = static_cast<float>(-static_m * s * s * (6.0 - 4.0 * s + s * s) / 3.0);
  }
  const double middle = project(bent, kDown, beam_mode);
  double largest = 0.0;
  std::vector<double> q;
  for (int step = 0; step < kPeriods * kPeriodS * setting.rate_hz; ++step) {
    strand->step(input);
    const SolverState& state = strand->run().state();
    if (step < kFirstSwingPeriods * kPeriodS * setting.rate_hz)
      largest = std::max(largest, -static_cast<double>(state.position_m.back().y) / static_m);
    q.push_back(project(state, kDown, beam_mode) - middle);
  }
  AnalyticResult result;
  result.stretch = strand->stretch();
  result.value = largest;
  result.exact = kBeamFirstSwing;
  result.error = std::abs(largest / kBeamFirstSwing - 1.0);
  result.period_error = std::abs(swing_period_s(q, 1.0 / setting.rate_hz) / kPeriodS - 1.0);
  if (std::isnan(result.period_error)) result.note = "does not swing";
  return result;
}

// T6: a chain hung from two points at half its length apart.
AnalyticResult run_catenary(const Workbench& workbench, const RunSetting& setting) {
  constexpr double kSpan = 0.5;
  const uint32_t n = setting.vertex_count;
  const uint32_t segments = n - 3;  // between the inner held vertices; the outer ones only hold
  const double segment_m = kAnalyticLengthM / segments;
  // Equal chords of a circle: d = l sin(m a / 2) / sin(a / 2).
  double low = 0.0;
  double high = 2.0 * std::numbers::pi / segments;
  for (int i = 0; i < 100; ++i) {
    const double turn = 0.5 * (low + high);
    (std::sin(0.5 * segments * turn) / std::sin(0.5 * turn) > kSpan * segments ? low : high) = turn;
  }
  std::vector<glm::dvec3> points = {{-0.5 * kSpan * kAnalyticLengthM, segment_m, 0.0}};
  glm::dvec3 point(-0.5 * kSpan * kAnalyticLengthM, 0.0, 0.0);
  for (uint32_t i = 0; i <= segments; ++i) {
    points.push_back(point);
    const double angle = low * (i + 0.5 - 0.5 * segments);
    point += segment_m * glm::dvec3(std::cos(angle), std::sin(angle), 0.0);
  }
  points.push_back(points.back() + glm::dvec3(0.0, segment_m, 0.0));
  RunPhysics physics;
  physics.length_m = segment_m * (n - 1);
  physics.given = {{"air_drag_per_s", kSettlingDragPerS}};
  auto strand = TestStrand::make(workbench, setting, physics, groom_of({points}, Pinning::BothEnds));
  if (!strand) return failed(strand.error());
  settle(*strand, kGravityMps2 * kDown, kSettlingS);
  AnalyticResult result;
  const double depth_m = -0.5 * (strand->vertex((n - 1) / 2).y + strand->vertex(n / 2).y);
  result.value = result.droop = depth_m / kAnalyticLengthM;
  result.exact = catenary_sag(kSpan);
  result.error = std::abs(result.value / result.exact - 1.0);
  result.stretch = strand->stretch();
  return result;
}

// T9: one segment dragged by its head across its own direction, its velocity taken away after every step: the
// curve of pursuit. Follow-the-leader reaches it with small steps, a tractrix step with any.
AnalyticResult run_tractrix(const Workbench& workbench, const RunSetting& setting) {
  constexpr double kWay = 1.0;  // lengths, within a second
  RunSetting two = setting;
  two.vertex_count = 2;
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  auto strand = make_straight(workbench, two, physics, {0.0, 0.0, 1.0});
  if (!strand) return failed(strand.error());
  StepInput input;
  input.gravity_mps2 = glm::dvec3(0.0);
  const auto steps = static_cast<int>(std::lround(setting.rate_hz));
  input.head_shift_m = kSideways * (kWay * kAnalyticLengthM / steps);
  for (int step = 0; step < steps; ++step) {
    strand->step(input);
    SolverState state = strand->run().state();
    for (glm::vec3& velocity : state.velocity_mps) velocity = glm::vec3(0.0f);
    strand->run().write(state);
  }
  const glm::dvec2 exact = tractrix_end(kWay);
  const glm::dvec3 end = strand->vertex(1) / kAnalyticLengthM + glm::dvec3(kWay, 0.0, 0.0);
  AnalyticResult result;
  result.value = end.x;
  result.exact = exact.x;
  result.error = glm::distance(end, glm::dvec3(exact.x, 0.0, exact.y));
  result.stretch = strand->stretch();
  return result;
}

/// -omega^2 of an upright rod's first mode, over that of the weightless rod.
Result<double> growth_of_upright(const Workbench& workbench, const RunSetting& setting, double gamma,
                                 double& stretch) {
  constexpr double kAmplitude = 1e-3;
  constexpr double kTimeS = 1.0;
  const double b = kGravityMps2 * std::pow(kAnalyticLengthM, 3) / gamma;
  RunPhysics physics;
  physics.length_m = kAnalyticLengthM;
  physics.hair = hair_with(b);
  ASSIGN_OR_RETURN(TestStrand strand, make_straight(workbench, setting, physics, -kDown));
  displace(strand.run(), kSideways, kAmplitude, beam_mode);
  StepInput input;
  input.gravity_mps2 = kGravityMps2 * kDown;
  std::vector<double> q = {project(strand.run().state(), kSideways, beam_mode)};
  for (int step = 0; step < kTimeS * setting.rate_hz; ++step) {
    strand.step(input);
    q.push_back(project(strand.run().state(), kSideways, beam_mode));
  }
  stretch = std::max(stretch, strand.stretch());
  const double free_radps = beam_frequency_radps(kAnalyticLengthM, b);
  return swing_growth_per_s2(q, 1.0 / setting.rate_hz) / (free_radps * free_radps);
}

// T10: weight at which an upright hair buckles: where the square of its frequency goes through nought,
// between two measurements on either side.
AnalyticResult run_buckling(const Workbench& workbench, const RunSetting& setting) {
  constexpr double kBelow = 0.9;
  constexpr double kAbove = 1.1;
  AnalyticResult result;
  const auto below = growth_of_upright(workbench, setting, kBelow * kBucklingGamma, result.stretch);
  if (!below) return failed(below.error());
  const auto above = growth_of_upright(workbench, setting, kAbove * kBucklingGamma, result.stretch);
  if (!above) return failed(above.error());
  result.exact = kBucklingGamma;
  if (*above > *below)
    result.value = kBucklingGamma * (kBelow - *below * (kAbove - kBelow) / (*above - *below));
  result.error = std::abs(result.value / kBucklingGamma - 1.0);
  if (!(result.error < 1.0)) result.note = "does not buckle near";
  return result;
}

template <int kAlpha>
AnalyticResult run_end_load_of(const Workbench& workbench, const RunSetting& setting) {
  return run_end_load(workbench, setting, kAlpha);
}

template <int kGamma>
AnalyticResult run_cantilever_of(const Workbench& workbench, const RunSetting& setting) {
  return run_cantilever(workbench, setting, kGamma);
}

}  // namespace

const std::vector<AnalyticTest>& analytic_tests() {
  constexpr const char* kCantilever =
      "tip of a horizontal hair at rest under its weight; error: distance of the tip over the length";
  constexpr const char* kEndLoad =
      "tip of a horizontal hair at rest under a heavy bead; error: distance of the tip over the length";
  static const std::vector<AnalyticTest> tests = {
      {"T1 Gamma 1", kCantilever, Material::Hair, 0.0, 0, false, kSettlingS, run_cantilever_of<1>},
      {"T1 Gamma 10", kCantilever, Material::Hair, 0.0, 0, true, kSettlingS, run_cantilever_of<10>},
      {"T1 Gamma 100", kCantilever, Material::Hair, 0.0, 0, false, kSettlingS, run_cantilever_of<100>},
      {"T1 Gamma 1000", kCantilever, Material::Hair, 0.0, 0, false, kSettlingS, run_cantilever_of<1000>},
      {"T2 alpha 2", kEndLoad, Material::Hair, 0.0, 0, true, 2.0 * kSettlingS, run_end_load_of<2>},
      {"T2 alpha 10", kEndLoad, Material::Hair, 0.0, 0, false, 2.0 * kSettlingS, run_end_load_of<10>},
      {"T3", "straight hair rolled up by its natural curvature; error: tip to root over the length",
       Material::Hair, 0.0, 0, false, kSettlingS, run_roll_up},
      {"T4, T7", "small swings of a hanging chain; error: period; damping against the integrator's",
       Material::Limp, 0.0, 0, true, 4.0, run_heavy_chain},
      {"T5", "a weight put on a horizontal hair at once; error: first swing over static; period",
       Material::Hair, 0.0, 0, true, 5.0, run_beam},
      {"T6", "a chain hung from two points; error: sag", Material::Limp, 0.0, 0, true, kSettlingS,
       run_catenary},
      {"T9", "one segment dragged by its head; error: its end over the length", Material::Limp, 0.0, 2, true,
       1.0, run_tractrix},
      {"T10", "weight at which an upright hair buckles; error: relative", Material::Hair, 0.0, 0, true, 2.0,
       run_buckling},
      {"T12", "a curl that hangs under its own weight; error: its extension, all of it twist", Material::Hair,
       0.0, kCurlVertices, true, 6.0, run_curl},
      {"T18",
       "30 particles, 10 ms steps, let go from horizontal; error: RMS of positions over the length from a "
       "limp direct_rod with steps of 1/6400 s, so of little weight for that row",
       Material::Limp, kPaperChainRateHz, kPaperChainVertices, true, 0.4, run_paper_chain},
  };
  return tests;
}

bool has_physics(const SolverRow& row, const AnalyticTest& test) {
  if (test.run == run_curl && !has_twist(row)) return false;
  if (test.name.starts_with("T2 ") && !has_parameter(row, kBeadName)) return false;
  return test.material == Material::Hair ? row.as_hair != nullptr : can_be_limp(row);
}

}  // namespace strandcast
