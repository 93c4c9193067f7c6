#include "server/report/ponytail.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <utility>

#include "server/report/crowded_hair.h"
#include "server/report/exact_solutions.h"
#include "server/report/hanging_hair.h"
#include "server/report/swing_fit.h"

namespace strandcast {
namespace {

constexpr double kChainNudgeM = 0.0005;  // sideways, to begin with
constexpr double kTuftNudgeM = 0.005;    // its strands move a little by themselves
constexpr double kNudgeS = 0.25;
constexpr double kModulation = 0.5;
/// From an amplitude of this share of the length on, sway is no longer small; below this share of what it
/// began with, it is lost in what strands do besides.
constexpr double kSmallShare = 0.2;
constexpr double kLostShare = 0.25;

/// What hangs, and what it is made of.
struct PonytailMaker {
  std::string name;
  SceneDesc scene;
  SceneContent content;
  double seconds = 0.0;
  double nudge_m = 0.0;
};

/// Of the head: up and down, and a nudge sideways to begin with.
struct HeadBeat {
  double radps = 0.0;
  double height_m = 0.0;
  double nudge_m = 0.0;
  Pose at(double time_s) const {
    const double share = std::clamp(time_s / kNudgeS, 0.0, 1.0);
    const double smooth = share * share * (3.0 - 2.0 * share);
    return {{nudge_m * smooth, kHangingHeightM + smooth * height_m * std::cos(radps * time_s), 0.0},
            glm::dquat(1.0, 0.0, 0.0, 0.0)};
  }
};

/// What each vertex counts for in the slowest mode of a hanging chain, which has the amplitude 1.
std::vector<double> mode_weights(const StrandLayout& layout) {
  std::vector<double> weights;
  double sum = 0.0;
  for (uint32_t vertex = 0; vertex < layout.vertex_count; ++vertex) {
    const double shape = chain_mode(static_cast<double>(vertex) / (layout.vertex_count - 1), 1);
    const double length = vertex == 0 || vertex + 1 == layout.vertex_count ? 0.5 : 1.0;
    weights.push_back(length * shape);
    sum += length * shape * shape;
  }
  for (double& weight : weights) weight /= sum * layout.strand_count;
  return weights;
}

/// Sideways displacement in that mode at each step after the nudge, m.
Result<std::vector<double>> sideways_of(const PonytailMaker& maker, const HeadBeat& beat,
                                        Executor& executor) {
  ASSIGN_OR_RETURN(HairRun run, HairRun::make(executor, maker.scene, maker.content));
  const StrandLayout& layout = run.layout();
  const std::vector<double> weights = mode_weights(layout);
  std::vector<double> moved_m;
  const double rate_hz = maker.scene.step_rate_hz;
  for (int64_t step = 1; step <= std::llround(maker.seconds * rate_hz); ++step) {
    run.step(beat.at(static_cast<double>(step) / rate_hz));
    if (run.time_s() < kNudgeS) continue;
    moved_m.push_back(0.0);
    for (size_t i = 0; i < layout.size(); ++i)
      moved_m.back() += weights[i / layout.strand_count] * static_cast<double>(run.position_in_head_m()[i].x);
  }
  return moved_m;
}

/// Half of what nudges to either side differ by: how hair settles that nobody nudged is not sway.
Result<std::vector<double>> sway_of(const PonytailMaker& maker, HeadBeat beat, Executor& executor) {
  beat.nudge_m = maker.nudge_m;
  ASSIGN_OR_RETURN(std::vector<double> sway_m, sideways_of(maker, beat, executor));
  beat.nudge_m = -maker.nudge_m;
  ASSIGN_OR_RETURN(const std::vector<double> other_m, sideways_of(maker, beat, executor));
  for (size_t i = 0; i < sway_m.size(); ++i) sway_m[i] = 0.5 * (sway_m[i] - other_m[i]);
  return sway_m;
}

/// Slope of the logarithm of the largest sway in windows of so long, as long as sway is small; NaN where it
/// is not for two windows.
double growth_per_s(const std::vector<double>& sway_m, double rate_hz, double window_s) {
  const auto window = static_cast<size_t>(std::llround(window_s * rate_hz));
  std::vector<double> logarithm;
  for (size_t begin = window; begin + window <= sway_m.size(); begin += window) {
    double most = 0.0;
    for (size_t i = begin; i < begin + window; ++i) most = std::max(most, std::abs(sway_m[i]));
    const bool is_lost = !logarithm.empty() && most < kLostShare * std::exp(logarithm.front());
    if (is_lost || most > kSmallShare * static_cast<double>(kHangingLengthM)) break;
    logarithm.push_back(std::log(std::max(most, std::numeric_limits<double>::min())));
  }
  if (logarithm.size() < 2) return std::numeric_limits<double>::quiet_NaN();
  const double middle = 0.5 * static_cast<double>(logarithm.size() - 1);
  double along = 0.0, square = 0.0;
  for (size_t k = 0; k < logarithm.size(); ++k) {
    const double at = static_cast<double>(k) - middle;
    along += at * logarithm[k];
    square += at * at;
  }
  return along / (square * window_s);
}

Result<Ponytail> measure_ponytail(const PonytailDesc& desc, const PonytailMaker& maker, Executor& executor) {
  const double rate_hz = maker.scene.step_rate_hz;
  Ponytail tail;
  tail.name = maker.name;
  tail.modulation = kModulation;
  tail.chain_radps = chain_frequency_radps(static_cast<double>(kHangingLengthM), kEarthMps2, 1);
  ASSIGN_OR_RETURN(const std::vector<double> free_m, sway_of(maker, {}, executor));
  const std::complex<double> rate = rate_hz * std::log(swing_root(free_m));
  tail.sway_radps = std::abs(rate);
  tail.decay_per_s = -rate.real();
  for (const double ratio : desc.ratios) {
    PonytailSway row;
    row.ratio = ratio;
    const double head_radps = 2.0 * ratio * tail.sway_radps;
    row.head_hz = head_radps / (2.0 * std::numbers::pi);
    // Only what gravity does of the sway is changed by the head, not what stiffness does.
    const double by_gravity = std::min(tail.chain_radps / tail.sway_radps, 1.0);
    row.theory_per_s = mathieu_growth_per_s(
        {tail.sway_radps, tail.decay_per_s, kModulation * by_gravity * by_gravity, head_radps});
    const HeadBeat beat{head_radps, kModulation * kEarthMps2 / (head_radps * head_radps)};
    ASSIGN_OR_RETURN(const std::vector<double> sway_m, sway_of(maker, beat, executor));
    row.ours_per_s = growth_per_s(sway_m, rate_hz, 2.0 / row.head_hz);
    tail.rows.push_back(row);
  }
  return tail;
}

}  // namespace

double mathieu_growth_per_s(const MathieuSway& sway) {
  constexpr int kSteps = 2000;
  const double period_s = 2.0 * std::numbers::pi / sway.head_radps;
  const double h = period_s / kSteps;
  const double stiffness = sway.frequency_radps * sway.frequency_radps;
  const auto rate = [&](double time_s, const glm::dvec2& state) {
    const double force = stiffness * (1.0 + sway.modulation * std::cos(sway.head_radps * time_s));
    return glm::dvec2(state.y, -force * state.x - 2.0 * sway.decay_per_s * state.y);
  };
  std::array<glm::dvec2, 2> columns = {glm::dvec2(1.0, 0.0), glm::dvec2(0.0, 1.0)};
  for (glm::dvec2& state : columns)
    for (int i = 0; i < kSteps; ++i) {
      const double t = i * h;
      const glm::dvec2 k1 = rate(t, state);
      const glm::dvec2 k2 = rate(t + 0.5 * h, state + 0.5 * h * k1);
      const glm::dvec2 k3 = rate(t + 0.5 * h, state + 0.5 * h * k2);
      const glm::dvec2 k4 = rate(t + h, state + h * k3);
      state += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
  const double half_trace = 0.5 * (columns[0].x + columns[1].y);
  const double determinant = columns[0].x * columns[1].y - columns[0].y * columns[1].x;
  const double apart = half_trace * half_trace - determinant;
  const double largest = apart > 0.0 ? std::abs(half_trace) + std::sqrt(apart) : std::sqrt(determinant);
  return std::log(largest) / period_s;
}

Result<std::vector<Ponytail>> measure_ponytails(const PonytailDesc& desc, Executor& executor) {
  PonytailMaker chain{
      "one limp hair without air", hanging_scene(desc.step_rate_hz), {}, desc.seconds, kChainNudgeM};
  chain.scene.solver = limp_rod();
  chain.content.groom = make_hanging_hair(kHangingVertices, kHangingLengthM);
  PonytailMaker tuft{
      "a tuft of full quality", hanging_scene(desc.step_rate_hz), {}, desc.seconds, kTuftNudgeM};
  tuft.scene.solver.parameters["sag_free"] = 1.0;
  tuft.scene.volume = volume_of({true, true});
  tuft.scene.volume.air.hairs = desc.tuft_hairs;
  tuft.content.groom = make_tuft(desc.tuft_strands, kHangingVertices, kHangingLengthM, kHangingSeed);
  std::vector<Ponytail> tails;
  for (const PonytailMaker& maker : {chain, tuft}) {
    ASSIGN_OR_RETURN(Ponytail tail, measure_ponytail(desc, maker, executor));
    tails.push_back(std::move(tail));
  }
  return tails;
}

}  // namespace strandcast
