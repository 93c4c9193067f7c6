#include "server/sim/executor/gl_executor.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/check.h"
#include "common/gl/device_limits.h"
#include "common/gl/egl_context.h"
#include "common/gl/program.h"
#include "common/gl/timer.h"
#include "server/sim/executor/gl_plane.h"
#include "server/sim/executor/gl_volume.h"
#include "shaders/shared/bindings.h"
#include "shaders/shared/limits.h"

namespace strandcast {
namespace {

// Values of the variant COLLIDERS in shaders/sim/follow.glsl besides 0.
constexpr uint32_t kColliderCapacities[] = {1, 4, kMaxSphereColliders};
// How much scratch is worth having: strands that do not fit wait for the next dispatch. A software device
// finds on the way back what still fits its caches; hardware wants all strands at once.
constexpr size_t kCachedScratchBytes = size_t{2} << 20;
constexpr size_t kMaxScratchBytes = size_t{64} << 20;

/// One kernel compiled for the numbers of colliders that a scene may come to have, with its constants set.
using Capacities = std::map<uint32_t, gl::Program>;

Status set_constants(const gl::Program& program, const ModelConstants& constants) {
  for (const auto& [name, value] : constants) {
    if (const auto* number = std::get_if<double>(&value)) {
      RETURN_IF_ERROR(program.check_uniform(name, "float"));
      program.set(name, static_cast<float>(*number));
    } else {
      RETURN_IF_ERROR(program.check_uniform(name, "uint"));
      program.set(name, std::get<uint32_t>(value));
    }
  }
  return {};
}

Result<Capacities> compile(const gl::ShaderLibrary& shaders, const SceneFeatures& features,
                           const KernelDesc& desc) {
  std::vector<uint32_t> capacities = {0};
  if (features.has_colliders && desc.meets_colliders)
    capacities.assign(std::begin(kColliderCapacities), std::end(kColliderCapacities));
  Capacities compiled;
  for (const uint32_t capacity : capacities) {
    gl::Variant variant = desc.variant;
    if (desc.meets_colliders) variant["COLLIDERS"] = static_cast<int>(capacity);
    if (desc.meets_air) variant["HAS_TURBULENCE"] = features.has_turbulence ? 1 : 0;
    ASSIGN_OR_RETURN(gl::Program program, gl::Program::make(shaders, {desc.shader_path}, variant));
    RETURN_IF_ERROR(set_constants(program, desc.constants));
    compiled[capacity] = std::move(program);
  }
  return compiled;
}

/// The cheapest that can hold so many colliders; the largest when none can.
const gl::Program& fitting(const Capacities& compiled, size_t collider_count) {
  const auto found =
      compiled.lower_bound(static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders)));
  return found == compiled.end() ? compiled.rbegin()->second : found->second;
}

std::string words(const StrandLayout& layout) {
  return fmt::format("a groom of {} strands x {} vertices", layout.strand_count, layout.vertex_count);
}

/// How the strands are spread over dispatches and groups.
struct Dispatches {
  uint32_t strand_count = 0;
  uint32_t strands_per_group = 1;
  uint32_t batch = 0;  // strands of a dispatch

  uint32_t group_count(uint32_t strands) const {
    return (strands + strands_per_group - 1) / strands_per_group;
  }
};

class GlKernel final : public KernelProgram {
 public:
  GlKernel(std::shared_ptr<const Capacities> compiled, const Dispatches& dispatches,
           const std::string& shader_path, size_t scratch_bytes)
      : compiled_(std::move(compiled)), dispatches_(dispatches) {
    if (scratch_bytes > 0) scratch_ = gl::Buffer(shader_path + " scratch", scratch_bytes);
  }

  using KernelProgram::run;
  void run(const StepBlock& step, size_t collider_count, const BoundPlanes& planes,
           const BoundTables& tables) override {
    step_.write(0, std::as_bytes(std::span(&step, 1)));
    step_.bind_uniform(shader::kBindingStep);
    for (size_t role = 0; role < planes.size(); ++role)
      if (planes[role] != nullptr) static_cast<const GlPlane*>(planes[role])->bind(kPlaneBindings[role]);
    for (size_t role = 0; role < tables.size(); ++role)
      if (tables[role] != nullptr) static_cast<const GlTable*>(tables[role])->bind(kTableUnits[role]);
    const gl::Program& program = fitting(*compiled_, collider_count);
    program.use();
    if (scratch_.size_bytes() == 0)
      glDispatchCompute(dispatches_.group_count(dispatches_.strand_count), 1, 1);
    else
      run_batches(program);
    // The next kernel fetches what this one stored; read() copies it.
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                    GL_BUFFER_UPDATE_BARRIER_BIT);
  }
  uint64_t size_bytes() const override { return step_.size_bytes() + scratch_.size_bytes(); }

 private:
  void run_batches(const gl::Program& program) {
    scratch_.bind_storage(shader::kBindingRodScratch);
    for (uint32_t begin = 0; begin < dispatches_.strand_count; begin += dispatches_.batch) {
      // The dispatch before used the same scratch.
      if (begin > 0) glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
      const uint32_t end = std::min(begin + dispatches_.batch, dispatches_.strand_count);
      program.set("u_strand_begin", begin);
      program.set("u_strand_end", end);
      glDispatchCompute(dispatches_.group_count(end - begin), 1, 1);
    }
  }

  std::shared_ptr<const Capacities> compiled_;
  Dispatches dispatches_;
  gl::Buffer scratch_;  // (vertex_count x scratch_rows x batch) vec4
  gl::Buffer step_{"step", sizeof(StepBlock)};
};

class GlExecutor final : public Executor {
 public:
  GlExecutor(std::unique_ptr<gl::EglContext> context, gl::ShaderLibrary shaders)
      : context_(std::move(context)), shaders_(std::move(shaders)), timer_(context_->info()) {
    const gl::DeviceInfo& device = context_->info();
    info_ = {SimDevice::Gl, "OpenGL, " + device.renderer, device.is_software};
  }
  // Whatever else is current by then.
  ~GlExecutor() override { static_cast<void>(context_->make_current()); }

  const ExecutorInfo& info() const override { return info_; }
  Status make_current() override { return context_->make_current(); }
  gl::GpuTimer* timer() override { return &timer_; }

  Status check_size(const StrandLayout& layout) const override {
    RETURN_IF_ERROR(check(gl::DeviceLimit::BufferTexels, layout.size(), layout));
    return check(gl::DeviceLimit::StorageBlockBytes, layout.size() * sizeof(glm::vec4), layout);
  }

  std::unique_ptr<StrandPlane> make_plane(const std::string& label, uint32_t strand_count,
                                          std::span<const glm::vec4> values) override {
    CHECK(strand_count > 0 && values.size() % strand_count == 0);
    return std::make_unique<GlPlane>(label, values);
  }

  Result<std::unique_ptr<LookupTable>> make_table(const std::string& label, uint32_t element_count) override {
    CHECK(element_count > 0);
    const gl::DeviceLimits& limits = context_->info().limits;
    RETURN_IF_ERROR(gl::check_device_limit(limits, gl::DeviceLimit::BufferTexels, element_count, label));
    return std::unique_ptr<LookupTable>(std::make_unique<GlTable>(label, element_count));
  }

  Result<std::unique_ptr<DeviceVolume>> make_volume(const DeviceVolumeDesc& desc) override {
    return make_gl_volume(shaders_, context_->info().limits, desc);
  }

  Result<std::unique_ptr<KernelProgram>> make_program(const KernelDesc& desc, const SceneFeatures& features,
                                                      const StrandLayout& layout) override {
    Dispatches dispatches;
    dispatches.strand_count = dispatches.batch = layout.strand_count;
    dispatches.strands_per_group =
        desc.is_per_vertex ? shader::kVertexLocalSize / layout.vertex_count : shader::kStrandLocalSize;
    RETURN_IF_ERROR(check(gl::DeviceLimit::GroupCount, dispatches.group_count(layout.strand_count), layout));
    const size_t bytes_per_strand = size_t{desc.scratch_rows} * sizeof(glm::vec4) * layout.vertex_count;
    if (bytes_per_strand > 0) dispatches.batch = fitting_strands(bytes_per_strand, layout.strand_count);
    ASSIGN_OR_RETURN(auto compiled, compiled_once(desc, features));
    return std::unique_ptr<KernelProgram>(std::make_unique<GlKernel>(
        std::move(compiled), dispatches, desc.shader_path, bytes_per_strand * dispatches.batch));
  }

 private:
  using Key = std::tuple<KernelDesc, bool, bool>;

  Status check(gl::DeviceLimit limit, uint64_t needed, const StrandLayout& layout) const {
    return gl::check_device_limit(context_->info().limits, limit, needed, words(layout));
  }

  uint32_t fitting_strands(size_t bytes_per_strand, uint32_t strand_count) const {
    const size_t worthwhile_bytes = info_.is_software ? kCachedScratchBytes : kMaxScratchBytes;
    const size_t strands =
        worthwhile_bytes / bytes_per_strand / shader::kStrandLocalSize * shader::kStrandLocalSize;
    return static_cast<uint32_t>(
        std::min<size_t>(std::max<size_t>(strands, shader::kStrandLocalSize), strand_count));
  }

  Result<std::shared_ptr<const Capacities>> compiled_once(const KernelDesc& desc,
                                                          const SceneFeatures& features) {
    const Key key(desc, features.has_colliders, features.has_turbulence);
    if (const auto found = compiled_.find(key); found != compiled_.end())
      if (auto compiled = found->second.lock()) return compiled;
    ASSIGN_OR_RETURN(Capacities made, compile(shaders_, features, desc));
    auto compiled = std::make_shared<const Capacities>(std::move(made));
    std::erase_if(compiled_, [](const auto& entry) { return entry.second.expired(); });
    compiled_[key] = compiled;
    return compiled;
  }

  std::unique_ptr<gl::EglContext> context_;  // first: goes last
  gl::ShaderLibrary shaders_;
  gl::GpuTimer timer_;
  ExecutorInfo info_;
  std::map<Key, std::weak_ptr<const Capacities>> compiled_;  // as long as somebody runs them
};

}  // namespace

Result<std::unique_ptr<Executor>> make_gl_executor(
    const std::string& gl_device, const std::optional<std::filesystem::path>& shader_folder) {
  ASSIGN_OR_RETURN(auto context, gl::EglContext::make(gl_device));
  gl::ShaderLibrary shaders = shader_folder ? gl::ShaderLibrary(*shader_folder) : gl::ShaderLibrary();
  return std::unique_ptr<Executor>(std::make_unique<GlExecutor>(std::move(context), std::move(shaders)));
}

}  // namespace strandcast
