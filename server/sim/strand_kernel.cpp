#include "server/sim/strand_kernel.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <string_view>

#include "common/base/check.h"
#include "shaders/shared/bindings.h"

namespace strandcast {
namespace {

// Values of the variant COLLIDERS in shaders/sim/follow.glsl besides 0.
constexpr uint32_t kColliderCapacities[] = {1, 4, kMaxSphereColliders};

/// A buffer texture of vec4 over the whole buffer.
gl::Handle<gl::delete_texture> make_view(const std::string& label, const gl::Buffer& buffer) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_BUFFER, 1, &name);
  glTextureBuffer(name, GL_RGBA32F, buffer.name());
  glObjectLabel(GL_TEXTURE, name, -1, label.c_str());
  return gl::Handle<gl::delete_texture>(name);
}

Status check_device_limits(const StrandLayout& layout, uint32_t group_count) {
  GLint most_texels = 0;
  glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most_texels);
  if (layout.size() > static_cast<size_t>(std::max(most_texels, 0))) {
    return make_error(ErrorCode::Unsupported,
                      "{} strands x {} vertices do not fit the device ({} vertices at most)",
                      layout.strand_count, layout.vertex_count, most_texels);
  }
  if (group_count > gl::kMaxGroupCount) {
    return make_error(ErrorCode::LimitExceeded, "{} strands x {} vertices need {} work groups (at most {})",
                      layout.strand_count, layout.vertex_count, group_count, gl::kMaxGroupCount);
  }
  return {};
}

uint32_t group_count(const StrandKernelDesc& desc, const StrandLayout& layout) {
  const uint32_t per_group = desc.is_per_vertex ? desc.local_size / layout.vertex_count : desc.local_size;
  return (layout.strand_count + per_group - 1) / per_group;
}

}  // namespace

bool is_software_device() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return renderer != nullptr && std::string_view(renderer).find("llvmpipe") != std::string_view::npos;
}

Result<std::unique_ptr<Solver>> StrandKernel::make(StrandKernelDesc desc, const StrandParameters& parameters,
                                                   const GpuSolverContext& context) {
  CHECK(context.shaders != nullptr);
  std::unique_ptr<StrandKernel> kernel(
      new StrandKernel(std::move(desc), parameters, context.features, *context.shaders));
  RETURN_IF_ERROR(kernel->compile(false));
  kernel->step_ = gl::Buffer(kernel->desc_.name + " step", sizeof(StepBlock));
  return std::unique_ptr<Solver>(std::move(kernel));
}

Status StrandKernel::compile(bool has_pinned_tail) {
  programs_.clear();
  std::vector<uint32_t> capacities = {0};
  if (features_.has_colliders)
    capacities.assign(std::begin(kColliderCapacities), std::end(kColliderCapacities));
  for (const uint32_t capacity : capacities) {
    const gl::Variant variant = {{"COLLIDERS", static_cast<int>(capacity)},
                                 {"HAS_TURBULENCE", features_.has_turbulence ? 1 : 0},
                                 {"HAS_PINNED_TAIL", has_pinned_tail ? 1 : 0}};
    ASSIGN_OR_RETURN(programs_[capacity], gl::Program::make(shaders_, {desc_.shader_path}, variant));
    for (const auto& [name, value] : desc_.uniforms) programs_[capacity].set(name, value);
  }
  is_compiled_for_tail_ = has_pinned_tail;
  return {};
}

Status StrandKernel::load(const Groom& groom, const glm::dquat& world_from_head) {
  ASSIGN_OR_RETURN(StrandLayout layout, make_strand_layout(groom));
  RETURN_IF_ERROR(check_device_limits(layout, group_count(desc_, layout)));
  const bool has_pinned_tail = layout.pinned_tail_count > 0;
  if (has_pinned_tail != is_compiled_for_tail_) RETURN_IF_ERROR(compile(has_pinned_tail));
  previous_rotation_ = limited_rotation(world_from_head);
  step_index_ = 0;
  previous_turn_per_s_ = glm::dmat3(0.0);
  upload(layout);
  // The kernels read these back from the buffers.
  layout.rest = {};
  layout.arc = {};
  layout_ = std::move(layout);
  return {};
}

void StrandKernel::upload(const StrandLayout& layout) {
  rest_ = gl::Buffer::of(desc_.name + " rest", layout.rest);
  staging_.resize(layout.size());
  for (size_t i = 0; i < staging_.size(); ++i) {
    const glm::dvec3 position = previous_rotation_ * glm::dvec3(layout.rest[i]);
    staging_[i] = glm::vec4(glm::vec3(position), layout.arc[i]);
  }
  position_ = gl::Buffer::of(desc_.name + " position", staging_);
  std::fill(staging_.begin(), staging_.end(), glm::vec4(0.0f));
  velocity_ = gl::Buffer::of(desc_.name + " velocity", staging_);
  rest_view_ = make_view(desc_.name + " rest", rest_);
  position_view_ = make_view(desc_.name + " position", position_);
  velocity_view_ = make_view(desc_.name + " velocity", velocity_);
  if (!desc_.has_offset) return;
  offset_ = gl::Buffer::of(desc_.name + " offset", staging_);
  offset_view_ = make_view(desc_.name + " offset", offset_);
}

const gl::Program& StrandKernel::program_for(size_t collider_count) const {
  const auto fitting =
      programs_.lower_bound(static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders)));
  return fitting == programs_.end() ? programs_.rbegin()->second : fitting->second;
}

void StrandKernel::substep(const StepInput& input) {
  StepBlock block = make_step_block(input, parameters_, layout_, previous_rotation_);
  block.odd_even = {desc_.iterations, desc_.has_exact_length ? 1u : 0u, step_index_++, 0u};
  block.previous_turn = block_columns(previous_turn_per_s_);
  step_.write(0, std::as_bytes(std::span(&block, 1)));
  const glm::dquat rotation = limited_rotation(input.world_from_head);
  const glm::dmat3 turned_back = glm::mat3_cast(previous_rotation_ * glm::conjugate(rotation));
  previous_turn_per_s_ = (glm::dmat3(1.0) - turned_back) / limited_substep_s(input);
  previous_rotation_ = rotation;

  step_.bind_uniform(shader::kBindingStep);
  position_.bind_storage(shader::kBindingPosition);
  velocity_.bind_storage(shader::kBindingVelocity);
  glBindTextureUnit(shader::kUnitRest, rest_view_.name());
  glBindTextureUnit(shader::kUnitPosition, position_view_.name());
  glBindTextureUnit(shader::kUnitVelocity, velocity_view_.name());
  if (desc_.has_offset) {
    offset_.bind_storage(shader::kBindingDisplacement);
    glBindTextureUnit(shader::kUnitDisplacement, offset_view_.name());
  }
  program_for(input.colliders.size()).use();
  glDispatchCompute(group_count(desc_, layout_), 1, 1);
  // The next substep fetches what this one stored; read() copies it.
  glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_SHADER_STORAGE_BARRIER_BIT |
                  GL_BUFFER_UPDATE_BARRIER_BIT);
}

void StrandKernel::read(SolverState& state) {
  const auto copy_out = [this](const gl::Buffer& buffer, std::vector<glm::vec3>& values) {
    buffer.read(0, std::as_writable_bytes(std::span(staging_)));
    values.resize(staging_.size());
    std::transform(staging_.begin(), staging_.end(), values.begin(),
                   [](const glm::vec4& v) { return glm::vec3(v); });
  };
  copy_out(position_, state.position_m);
  copy_out(velocity_, state.velocity_mps);
}

// A strand that is written as it was read keeps what its model stores beside the velocity; another one starts
// anew.
void StrandKernel::write(const SolverState& state) {
  CHECK(state.position_m.size() == staging_.size() && state.velocity_mps.size() == staging_.size());
  std::vector<bool> is_changed(layout_.strand_count, false);
  position_.read(0, std::as_writable_bytes(std::span(staging_)));  // keeps w
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.position_m[i]) is_changed[i % layout_.strand_count] = true;
    staging_[i] = glm::vec4(state.position_m[i], staging_[i].w);
  }
  position_.write(staging_);
  velocity_.read(0, std::as_writable_bytes(std::span(staging_)));
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (glm::vec3(staging_[i]) != state.velocity_mps[i]) is_changed[i % layout_.strand_count] = true;
  }
  for (size_t i = 0; i < staging_.size(); ++i) {
    const float kept = is_changed[i % layout_.strand_count] ? 0.0f : staging_[i].w;
    staging_[i] = glm::vec4(state.velocity_mps[i], kept);
  }
  velocity_.write(staging_);
  if (desc_.has_offset) clear_offset(is_changed);
}

void StrandKernel::clear_offset(const std::vector<bool>& is_changed) {
  offset_.read(0, std::as_writable_bytes(std::span(staging_)));
  for (size_t i = 0; i < staging_.size(); ++i) {
    if (is_changed[i % layout_.strand_count]) staging_[i] = glm::vec4(0.0f);
  }
  offset_.write(staging_);
}

uint64_t StrandKernel::memory_bytes() const {
  return rest_.size_bytes() + position_.size_bytes() + velocity_.size_bytes() + offset_.size_bytes() +
         step_.size_bytes();
}

}  // namespace strandcast
