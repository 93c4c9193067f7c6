#include "server/sim/executor/lanes_executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <new>

#include "common/base/check.h"
#include "common/gl/program.h"
#include "server/sim/executor/lane_kernel.h"
#include "server/sim/strand_blocks.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

/// Vertices that a worker takes at once, 20 to 200 microseconds of work, and those that are worth one more
/// worker: waking one costs more than it takes off below.
constexpr uint32_t kVerticesPerShare = 4096;
constexpr uint32_t kVerticesPerWorker = 32768;

/// Zeroed memory of one worker.
class WorkerMemory {
 public:
  explicit WorkerMemory(size_t size_bytes)
      : bytes_(static_cast<std::byte*>(::operator new (size_bytes, std::align_val_t{kBlockAlignment}))) {
    std::memset(bytes_.get(), 0, size_bytes);
  }
  std::byte* data() const { return bytes_.get(); }

 private:
  struct Free {
    void operator()(std::byte* bytes) const { ::operator delete (bytes, std::align_val_t{kBlockAlignment}); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
};

class LanePlane final : public StrandPlane {
 public:
  LanePlane(uint32_t strand_count, std::span<const glm::vec4> values)
      : blocks_(strand_count, static_cast<uint32_t>(values.size() / strand_count)) {
    LanePlane::write(values);
  }

  void write(std::span<const glm::vec4> values) override {
    CHECK(values.size() == value_count());
    for_each(blocks_, [&](float* at, size_t index) {
      for (int axis = 0; axis < 4; ++axis) at[axis * kBlockStrands] = values[index][axis];
    });
    pad();
  }
  void read(std::vector<glm::vec4>& values) const override {
    values.resize(value_count());
    for_each(blocks_, [&](const float* at, size_t index) {
      for (int axis = 0; axis < 4; ++axis) values[index][axis] = at[axis * kBlockStrands];
    });
  }
  uint64_t size_bytes() const override { return blocks_.size() * sizeof(float); }
  std::optional<StrandBlocksView> view() const override { return blocks_.view(); }

  float* data() { return blocks_.data(); }
  size_t block_floats() const { return blocks_.row_count() * kBlockRowFloats; }

 private:
  size_t value_count() const { return size_t{blocks_.strand_count()} * blocks_.row_count(); }

  /// work(x of the value, its place outside of here) for all of them.
  template <class Blocks, class Work>
  static void for_each(Blocks& blocks, Work work) {
    const uint32_t strand_count = blocks.strand_count();
    for (uint32_t block = 0; block < block_count(strand_count); ++block) {
      const uint32_t first = block * kBlockStrands;
      const uint32_t count = std::min(kBlockStrands, strand_count - first);
      for (uint32_t row = 0; row < blocks.row_count(); ++row)
        for (uint32_t lane = 0; lane < count; ++lane)
          work(blocks.row(block, row, 0) + lane, size_t{row} * strand_count + first + lane);
    }
  }
  /// Strands that are not there do what the last one does.
  void pad() {
    const uint32_t strand_count = blocks_.strand_count();
    const uint32_t used = strand_count % kBlockStrands;
    if (used == 0) return;
    const uint32_t last_block = block_count(strand_count) - 1;
    for (uint32_t row = 0; row < blocks_.row_count(); ++row)
      for (uint32_t axis = 0; axis < 4; ++axis) {
        float* values = blocks_.row(last_block, row, axis);
        std::fill(values + used, values + kBlockStrands, values[used - 1]);
      }
  }

  StrandBlocks blocks_;
};

class LaneProgram final : public KernelProgram {
 public:
  LaneProgram(const LaneKernel& kernel, const KernelDesc& desc, const SceneFeatures& features,
              const StrandLayout& layout, WorkerPool& workers)
      : kernel_(kernel),
        has_colliders_(features.has_colliders),
        has_turbulence_(features.has_turbulence && desc.meets_air),
        names_(desc.constants),
        kernel_bytes_((kernel.memory_bytes + kBlockAlignment - 1) / kBlockAlignment * kBlockAlignment),
        memory_bytes_(kernel_bytes_ +
                      size_t{desc.scratch_rows} * layout.vertex_count * 4 * kernel.strands * sizeof(float)),
        block_count_(block_count(layout.strand_count)),
        blocks_per_share_(std::max(1u, kVerticesPerShare / (layout.vertex_count * kBlockStrands))),
        most_workers_(
            std::clamp(layout.strand_count * layout.vertex_count / kVerticesPerWorker, 1u, workers.size())),
        workers_(workers) {
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

  void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes) override {
    StepBlock one_strand = step;
    one_strand.shape.x = 1;
    std::array<float*, kPlaneRoleCount> data{};
    std::array<size_t, kPlaneRoleCount> block_floats{};
    for (size_t role = 0; role < kPlaneRoleCount; ++role) {
      if (planes[role] == nullptr) continue;
      auto* plane = static_cast<LanePlane*>(planes[role]);
      data[role] = plane->data();
      block_floats[role] = plane->block_floats();
    }
    LaneRun run;
    run.step = &one_strand;
    // What the scene lacks does not count, whatever the step says.
    if (has_colliders_)
      run.collider_count = static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders));
    if (has_turbulence_) run.gust_count = gust_count(step);
    run.planes = data.data();
    run.block_floats = block_floats.data();
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
    workers_.at(Priority::Simulation, most_workers_).for_ranges(block_count_, blocks_per_share_, run_share);
  }

  uint64_t size_bytes() const override { return memory_bytes_ * most_workers_; }

 private:
  /// Waves up to the last one with an amplitude.
  static uint32_t gust_count(const StepBlock& step) {
    uint32_t count = shader::kMaxGustWaves;
    while (count > 0 && glm::vec3(step.gust_amplitude[count - 1]) == glm::vec3(0.0f)) --count;
    return count;
  }

  const LaneKernel& kernel_;
  const bool has_colliders_;
  const bool has_turbulence_;
  const ModelConstants names_;
  std::vector<LaneConstant> constants_;  // names point into names_
  const size_t kernel_bytes_;            // of a worker: the kernel's, then its scratch
  const size_t memory_bytes_;
  const uint32_t block_count_;
  const uint32_t blocks_per_share_;
  const uint32_t most_workers_;
  WorkerPool& workers_;
  std::vector<WorkerMemory> memory_;
};

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

/// As gl::Program::check_uniform says it.
Status check_constants(const KernelDesc& desc) {
  ASSIGN_OR_RETURN(const gl::FlatSource source, gl::ShaderLibrary().flatten(desc.shader_path));
  const auto declared = gl::declared_uniforms(source);
  for (const auto& [name, value] : desc.constants) {
    const auto found = declared.find(name);
    if (found == declared.end())
      return at(desc.shader_path, make_error(ErrorCode::BadInput, "no variant declares a uniform {}", name));
    const std::string type = std::holds_alternative<double>(value) ? "float" : "uint";
    if (found->second != type)
      return at(desc.shader_path, make_error(ErrorCode::BadInput, "uniform {} is declared as {}, not as {}",
                                             name, found->second, type));
  }
  return {};
}

class LanesExecutor final : public Executor {
 public:
  explicit LanesExecutor(const LaneOptions& options)
      : workers_(options.workers == nullptr ? shared_workers() : *options.workers),
        set_(options.set),
        info_{SimDevice::Lanes,
              fmt::format("lanes ({}, {} thread{})", simd::to_string(options.set), workers_.size(),
                          workers_.size() == 1 ? "" : "s"),
              true} {}

  const ExecutorInfo& info() const override { return info_; }
  Status check_size(const StrandLayout&) const override { return {}; }
  std::unique_ptr<StrandPlane> make_plane(const std::string&, uint32_t strand_count,
                                          std::span<const glm::vec4> values) override {
    return std::make_unique<LanePlane>(strand_count, values);
  }
  Result<std::unique_ptr<KernelProgram>> make_program(const KernelDesc& desc, const SceneFeatures& features,
                                                      const StrandLayout& layout) override {
    RETURN_IF_ERROR(check_constants(desc));
    const LaneKernels all = lane_kernels();
    for (size_t i = 0; i < all.count; ++i) {
      const LaneKernel& kernel = *all.kernels[i];
      if (kernel.set != static_cast<int>(set_) || kernel.shader_path != desc.shader_path ||
          !is_variant(kernel.variant, desc.variant))
        continue;
      return std::unique_ptr<KernelProgram>(
          std::make_unique<LaneProgram>(kernel, desc, features, layout, workers_));
    }
    return make_error(ErrorCode::Unsupported,
                      "{} runs on OpenGL only: its vertices wait for each other (--sim-device gl)",
                      desc.shader_path);
  }

 private:
  WorkerPool& workers_;
  const simd::InstructionSet set_;
  const ExecutorInfo info_;
};

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

Result<std::unique_ptr<Executor>> make_lanes_executor() {
  const std::vector<simd::InstructionSet> sets = lane_sets();
  if (sets.empty())
    return make_error(ErrorCode::Unavailable,
                      "no strand kernel was built for this processor (it needs SSE4.2): --sim-device gl");
  return make_lanes_executor({sets.back()});
}

std::unique_ptr<Executor> make_lanes_executor(const LaneOptions& options) {
  return std::make_unique<LanesExecutor>(options);
}

}  // namespace strandcast
