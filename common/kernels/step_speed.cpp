#include "common/kernels/step_speed.h"

#include <algorithm>
#include <chrono>

#include "common/kernels/head_path.h"
#include "common/kernels/lane_program.h"

namespace strandcast {
namespace {

constexpr uint32_t kStrands = 512;
constexpr uint32_t kVertices = 16;
constexpr int kSteps = 24;  // of which the quickest counts
constexpr float kSegmentM = 0.015f;

/// Straight strands side by side; `w` of each vertex by work(vertex).
template <class W>
std::unique_ptr<StrandBlocks> hanging(W w) {
  auto blocks = std::make_unique<StrandBlocks>(kStrands, kVertices);
  for (uint32_t block = 0; block < block_count(kStrands); ++block)
    for (uint32_t v = 0; v < kVertices; ++v)
      for (uint32_t lane = 0; lane < kBlockStrands; ++lane) {
        blocks->row(block, v, 0)[lane] = 0.001f * static_cast<float>(block * kBlockStrands + lane);
        blocks->row(block, v, 2)[lane] = kSegmentM * static_cast<float>(v);
        blocks->row(block, v, 3)[lane] = w(v);
      }
  return blocks;
}

}  // namespace

double measure_kernel_step_ns() {
  const std::vector<simd::InstructionSet> sets = lane_sets();
  KernelDesc desc;
  desc.shader_path = "sim/dftl.comp";
  const LaneKernel* kernel = sets.empty() ? nullptr : find_lane_kernel(desc, sets.back());
  if (kernel == nullptr) return 0.0;
  WorkerPool one_thread(1);
  LaneProgram program(*kernel, desc, {kStrands, kVertices, false, false, &one_thread, Priority::Background});
  const auto rest = hanging([](uint32_t v) { return v == 0 ? 0.0f : kSegmentM; });
  const auto position = hanging([](uint32_t v) { return static_cast<float>(v) / (kVertices - 1); });
  StrandBlocks velocity(kStrands, kVertices);
  LanePlanes planes{};
  planes[static_cast<size_t>(PlaneRole::Rest)] = rest.get();
  planes[static_cast<size_t>(PlaneRole::Position)] = position.get();
  planes[static_cast<size_t>(PlaneRole::Velocity)] = &velocity;
  StrandParameters parameters;
  parameters.style_stiffness_per_s2 = kSupportStiffnessPerS2;
  parameters.max_speed_mps = 10.0;
  const StepBlock step =
      make_step_block(StepInput(), parameters, {kStrands, kVertices, 1, kVertices}, HeadPath());
  auto quickest = std::chrono::steady_clock::duration::max();
  for (int i = 0; i < kSteps; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    program.run(step, 0, planes);
    quickest = std::min(quickest, std::chrono::steady_clock::now() - begin);
  }
  return std::chrono::duration<double, std::nano>(quickest).count() / (kStrands * kVertices);
}

}  // namespace strandcast
