#include "server/sim/strand_programs.h"

#include <epoxy/gl.h>
#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/gl/device_limits.h"

namespace strandcast {
namespace {

// Values of the variant COLLIDERS in shaders/sim/follow.glsl besides 0.
constexpr uint32_t kColliderCapacities[] = {1, 4, kMaxSphereColliders};

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

}  // namespace

bool is_software_device() {
  const auto* renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  return renderer != nullptr && std::string_view(renderer).find("llvmpipe") != std::string_view::npos;
}

Result<StrandPrograms> StrandPrograms::make(const gl::ShaderLibrary& shaders, const SceneFeatures& features,
                                            const KernelDesc& desc) {
  std::vector<uint32_t> capacities = {0};
  if (features.has_colliders)
    capacities.assign(std::begin(kColliderCapacities), std::end(kColliderCapacities));
  StrandPrograms programs;
  for (const uint32_t capacity : capacities) {
    gl::Variant variant = desc.variant;
    variant["COLLIDERS"] = static_cast<int>(capacity);
    if (desc.meets_air) variant["HAS_TURBULENCE"] = features.has_turbulence ? 1 : 0;
    ASSIGN_OR_RETURN(gl::Program program, gl::Program::make(shaders, {desc.shader_path}, variant));
    RETURN_IF_ERROR(set_constants(program, desc.constants));
    programs.by_capacity_[capacity] = std::move(program);
  }
  return programs;
}

const gl::Program& StrandPrograms::fitting(size_t collider_count) const {
  const auto found =
      by_capacity_.lower_bound(static_cast<uint32_t>(std::min<size_t>(collider_count, kMaxSphereColliders)));
  return found == by_capacity_.end() ? by_capacity_.rbegin()->second : found->second;
}

Status check_group_count(const StrandLayout& layout, uint32_t group_count) {
  return gl::check_device_limit(
      gl::read_device_limits(), gl::DeviceLimit::GroupCount, group_count,
      fmt::format("a groom of {} strands x {} vertices", layout.strand_count, layout.vertex_count));
}

}  // namespace strandcast
