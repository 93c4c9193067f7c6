#include "server/sim/executor/lanes_executor.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/check.h"
#include "common/gl/program.h"
#include "common/kernels/lane_program.h"
#include "common/kernels/strand_blocks.h"

namespace strandcast {
namespace {

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

  StrandBlocks& blocks() { return blocks_; }

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

class LaneLookupTable final : public LookupTable {
 public:
  explicit LaneLookupTable(uint32_t element_count)
      : values_((element_count + 3) / 4), count_(element_count) {}

  void write(std::span<const glm::vec4> values) override {
    CHECK(values.size() == count_);
    std::copy(values.begin(), values.end(), memory().begin());
  }
  std::span<glm::vec4> memory() override { return {values_.data()->value, count_}; }
  uint64_t size_bytes() const override { return values_.size() * sizeof(Line); }
  LaneTable table() { return {&values_.data()->value[0].x, count_}; }

 private:
  /// Of a cache: no element lies in two.
  struct alignas(kBlockAlignment) Line {
    glm::vec4 value[4] = {};
  };
  std::vector<Line> values_;
  uint32_t count_;
};

class LaneKernelProgram final : public KernelProgram {
 public:
  LaneKernelProgram(const LaneKernel& kernel, const KernelDesc& desc, const LaneWork& work)
      : program_(kernel, desc, work) {}

  using KernelProgram::run;
  void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes,
           const BoundTables& tables) override {
    LanePlanes blocks{};
    for (size_t role = 0; role < kPlaneRoleCount; ++role)
      if (planes[role] != nullptr) blocks[role] = &static_cast<LanePlane*>(planes[role])->blocks();
    LaneTables looked_up{};
    for (size_t role = 0; role < kTableRoleCount; ++role)
      if (tables[role] != nullptr) looked_up[role] = static_cast<LaneLookupTable*>(tables[role])->table();
    program_.run(step, collider_count, blocks, looked_up);
  }
  uint64_t size_bytes() const override { return program_.size_bytes(); }

 private:
  LaneProgram program_;
};

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
  Result<std::unique_ptr<LookupTable>> make_table(const std::string&, uint32_t element_count) override {
    CHECK(element_count > 0);
    return std::unique_ptr<LookupTable>(std::make_unique<LaneLookupTable>(element_count));
  }
  Result<std::unique_ptr<KernelProgram>> make_program(const KernelDesc& desc, const SceneFeatures& features,
                                                      const StrandLayout& layout) override {
    RETURN_IF_ERROR(check_constants(desc));
    if (const LaneKernel* kernel = find_lane_kernel(desc, set_)) {
      const LaneWork work{layout.strand_count, layout.vertex_count, features.has_colliders,
                          features.has_turbulence && desc.meets_air, &workers_};
      return std::unique_ptr<KernelProgram>(std::make_unique<LaneKernelProgram>(*kernel, desc, work));
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
