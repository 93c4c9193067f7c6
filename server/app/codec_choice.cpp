#include "server/app/codec_choice.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "common/base/quantile.h"
#include "common/base/units.h"
#include "common/base/worker_pool.h"
#include "common/math/pose.h"
#include "common/strands/strand_codec.h"
#include "server/sim/solver_registry.h"

namespace strandcast {
namespace {

constexpr const char* kFewestBits = "step";
constexpr const char* kMeasured =
    "tangent";  // what viewers get that cannot step, and the dearest of its frames
constexpr const char* kCheapest = "delta";
constexpr int kWarmUpStates = 4, kMeasuredStates = 5;

// Hair that swings about its roots, every strand in its own time, with segments as long as they are.
constexpr double kSwingRad = 0.35, kSwingHz = 1.2, kPhaseRadPerM = 40.0;

double process_cpu_ms() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  return static_cast<double>(cpu.tv_sec) * 1e3 + static_cast<double>(cpu.tv_nsec) * 1e-6;
}

std::vector<glm::vec3> swung(const SceneAsset& asset, double time_s) {
  const std::vector<glm::vec3>& rest = asset.rest_position_m;
  std::vector<glm::vec3> points(rest.begin(), rest.begin() + asset.strand_count);
  points.resize(rest.size());
  for (uint32_t strand = 0; strand < asset.strand_count; ++strand) {
    const double phase = kPhaseRadPerM * (rest[strand].x + rest[strand].z);
    const double swing_rad = kSwingRad * std::sin(2.0 * std::numbers::pi * kSwingHz * time_s + phase);
    for (uint32_t vertex = 1; vertex < asset.vertex_count; ++vertex) {
      const size_t i = static_cast<size_t>(vertex) * asset.strand_count + strand;
      const double share = static_cast<double>(vertex) / (asset.vertex_count - 1);
      const auto turn = static_cast<float>(swing_rad * share);
      const glm::vec3 segment = rest[i] - rest[i - asset.strand_count];
      const float c = std::cos(turn), s = std::sin(turn);
      points[i] = points[i - asset.strand_count] +
                  glm::vec3(c * segment.x - s * segment.y, s * segment.x + c * segment.y, segment.z);
    }
  }
  return points;
}

Result<EncodeCost> measure(const SceneDesc& scene, const SceneAsset& asset) {
  ASSIGN_OR_RETURN(auto encoder, make_strand_encoder(kMeasured));
  encoder->set_rest_shape(asset.rest_position_m);
  ASSIGN_OR_RETURN(const float quantum_m, lattice_step_m(kMeasured, scene.stream.bound_m));
  EncodeCost cost{0.0, shared_workers().size(), states_per_second(scene)};
  std::vector<double> cpu_ms;
  for (int i = 0; i < kWarmUpStates + kMeasuredStates; ++i) {
    const std::vector<glm::vec3> points = swung(asset, i / cost.states_hz);
    QuantiseInput input;
    input.tick = static_cast<uint64_t>(i);
    input.strand_count = asset.strand_count;
    input.vertex_count = asset.vertex_count;
    input.quantum_m = quantum_m;
    input.position_in_head_m = points;
    const Quantised state = quantise(input);
    const double begin_ms = process_cpu_ms();
    // A state that fits into no message takes its time as well.
    static_cast<void>(encoder->encode(state.snapshot));
    if (i >= kWarmUpStates) cpu_ms.push_back(process_cpu_ms() - begin_ms);
  }
  cost.cpu_ms = median(std::move(cpu_ms));
  return cost;
}

}  // namespace

double states_per_second(const SceneDesc& scene) {
  const double wanted_hz = scene.stream.strand_rate_hz;
  return wanted_hz > 0.0 ? std::min(wanted_hz, scene.step_rate_hz) : scene.step_rate_hz;
}

CodecChoice choose_codec(const EncodeCost& cost) {
  const double room_ms = kEncodeShare * cost.processors * kMsPerS / cost.states_hz;
  const bool is_kept = cost.cpu_ms <= room_ms;
  const std::string measured = fmt::format(
      "tangent takes {:.1f} ms of processor time a state here, {:.1f} ms are there ({} processors, {:g} "
      "states a second)",
      cost.cpu_ms, room_ms, cost.processors, cost.states_hz);
  if (is_kept) return {kFewestBits, fmt::format("Codec step: {}.", measured)};
  return {kCheapest, fmt::format("Codec delta: {}. It needs many times the bits; --set stream.codec=step has "
                                 "the fewest, and --set stream.strand_rate_hz={:g} gives it time.",
                                 measured, std::round(0.5 * cost.states_hz))};
}

Result<CodecChoice> choose_codec(const SceneDesc& scene, const SceneAsset& asset,
                                 const ExecutorConfig& executor) {
  const StreamDesc& stream = scene.stream;
  if (stream.has_codec || stream.codec != kFewestBits)
    return CodecChoice{stream.codec, fmt::format("Codec {}: the scene names it.", stream.codec)};
  const size_t vertices = asset.rest_position_m.size();
  if (vertices <= kAlwaysFewestBitsVertices || asset.vertex_count < 2)
    return CodecChoice{
        kFewestBits, fmt::format("Codec step: the fewest bits, and {} vertices are soon encoded.", vertices)};
  ASSIGN_OR_RETURN(const SolverRow* solver, find_solver(scene.solver.name));
  if (solver->has_kernel && likely_sim_device(executor) == SimDevice::Lanes)
    return CodecChoice{
        kFewestBits, "Codec step: viewers take the simulation's own steps, and nothing is encoded for them."};
  ASSIGN_OR_RETURN(const EncodeCost cost, measure(scene, asset));
  return choose_codec(cost);
}

}  // namespace strandcast
