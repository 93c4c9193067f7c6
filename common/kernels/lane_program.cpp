#include "common/kernels/lane_program.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>

#include "common/base/check.h"
#include "common/math/sphere_collider.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

/// Vertices that a worker takes at once, 20 to 200 microseconds of work, and those that are worth one more
/// worker: waking one costs more than it takes off below.
constexpr uint32_t kVerticesPerShare = 4096;
constexpr uint32_t kVerticesPerWorker = 32768;

/// Waves up to the last one with an amplitude.
uint32_t gust_count(const StepBlock& step) {
  uint32_t count = shader::kMaxGustWaves;
  while (count > 0 && glm::vec3(step.gust_amplitude[count - 1]) == glm::vec3(0.0f)) --count;
  return count;
}

/// Whether a kernel's variant, "HAS_PINNED_TAIL=0 HAS_TWIST=1", is what is wanted: 0 where nothing is said.
bool is_variant(std::string_view built, std::map<std::string, int> wanted) {
  while (!built.empty()) {
    const std::string_view axis = built.substr(0, built.find(' '));
    built.remove_prefix(std::min(axis.size() + 1, built.size()));
    const size_t equals = axis.find('=');
    const std::string name(axis.substr(0, equals));
    if (axis.substr(equals + 1) != std::to_string(wanted[name])) return false;
    wanted.erase(name);
  }
  return wanted.empty();
}

}  // namespace

std::vector<simd::InstructionSet> lane_sets() {
  std::vector<simd::InstructionSet> sets;
  const LaneKernels all = lane_kernels();
  for (const simd::InstructionSet set : simd::instruction_sets()) {
    const bool is_built = std::any_of(all.kernels, all.kernels + all.count, [set](const LaneKernel* kernel) {
      return kernel->set == static_cast<int>(set);
    });
    if (is_built) sets.push_back(set);
  }
  return sets;
}

const LaneKernel* find_lane_kernel(const KernelDesc& desc, simd::InstructionSet set) {
  const LaneKernels all = lane_kernels();
  for (size_t i = 0; i < all.count; ++i) {
    const LaneKernel& kernel = *all.kernels[i];
    if (kernel.set == static_cast<int>(set) && kernel.shader_path == desc.shader_path &&
        is_variant(kernel.variant, desc.variant))
      return &kernel;
  }
  return nullptr;
}

LaneProgram::Memory::Memory(size_t size_bytes)
    : bytes_(static_cast<std::byte*>(::operator new (size_bytes, std::align_val_t{kBlockAlignment}))) {
  std::memset(bytes_.get(), 0, size_bytes);
}

LaneProgram::LaneProgram(const LaneKernel& kernel, const KernelDesc& desc, const LaneWork& work)
    : kernel_(kernel),
      work_(work),
      names_(desc.constants),
      kernel_bytes_((kernel.memory_bytes + kBlockAlignment - 1) / kBlockAlignment * kBlockAlignment),
      memory_bytes_(kernel_bytes_ +
                    size_t{desc.scratch_rows} * work.vertex_count * 4 * kernel.strands * sizeof(float)),
      blocks_per_share_(std::max(1u, kVerticesPerShare / (work.vertex_count * kBlockStrands))),
      most_workers_(
          std::clamp(work.strand_count * work.vertex_count / kVerticesPerWorker, 1u, work.workers->size())) {
  for (uint32_t worker = 0; worker < most_workers_; ++worker) memory_.emplace_back(memory_bytes_);
  CHECK(kernel.step_bytes == sizeof(StepBlock));
  for (const auto& [name, value] : names_) {
    const auto* number = std::get_if<double>(&value);
    constants_.push_back({name.c_str(), number != nullptr ? static_cast<float>(*number) : 0.0f,
                          number != nullptr ? 0u : std::get<uint32_t>(value)});
  }
  constants_.push_back({"u_strand_begin", 0.0f, 0});
  constants_.push_back({"u_strand_end", 0.0f, 1});
}

void LaneProgram::run(const StepBlock& step, size_t collider_count, const LanePlanes& planes,
                      const LaneTables& tables) {
  StepBlock one_strand = step;
  one_strand.shape.x = 1;
  std::array<float*, kPlaneRoleCount> data{};
  std::array<size_t, kPlaneRoleCount> block_floats{};
  for (size_t role = 0; role < kPlaneRoleCount; ++role) {
    if (planes[role] == nullptr) continue;
    data[role] = planes[role]->data();
    block_floats[role] = planes[role]->row_count() * kBlockRowFloats;
  }
  LaneRun run;
  run.step = &one_strand;
  if (work_.has_colliders)
    run.collider_count = static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders));
  if (work_.has_turbulence) run.gust_count = gust_count(step);
  run.planes = data.data();
  run.block_floats = block_floats.data();
  run.tables = tables.data();
  run.constants = constants_.data();
  run.constant_count = static_cast<uint32_t>(constants_.size());
  const auto run_share = [&](size_t begin, size_t end, uint32_t worker) {
    LaneRun share = run;
    std::byte* memory = memory_[worker].data();
    share.memory = memory;
    share.scratch = reinterpret_cast<float*>(memory + kernel_bytes_);
    share.block_begin = static_cast<uint32_t>(begin);
    share.block_end = static_cast<uint32_t>(end);
    kernel_.run(share);
  };
  work_.workers->at(work_.priority, most_workers_)
      .for_ranges(block_count(work_.strand_count), blocks_per_share_, run_share);
}

}  // namespace strandcast
