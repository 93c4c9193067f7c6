#include "server/sim/strand_kernel.h"

#include <epoxy/gl.h>

#include "shaders/shared/bindings.h"

namespace strandcast {

Result<std::unique_ptr<Solver>> StrandKernel::make(StrandKernelDesc desc, const StrandParameters& parameters,
                                                   const GpuSolverContext& context) {
  std::unique_ptr<StrandKernel> kernel(new StrandKernel(std::move(desc), parameters, context));
  RETURN_IF_ERROR(kernel->compile(false));
  return std::unique_ptr<Solver>(std::move(kernel));
}

Status StrandKernel::compile(bool has_pinned_tail) {
  const KernelDesc kernel = {
      desc_.shader_path, {{"HAS_PINNED_TAIL", has_pinned_tail ? 1 : 0}}, desc_.constants};
  ASSIGN_OR_RETURN(programs_, StrandPrograms::make(shaders(), features(), kernel));
  is_compiled_for_tail_ = has_pinned_tail;
  return {};
}

uint32_t StrandKernel::group_count() const {
  const uint32_t per_group =
      desc_.is_per_vertex ? desc_.local_size / layout().vertex_count : desc_.local_size;
  return (layout().strand_count + per_group - 1) / per_group;
}

Status StrandKernel::prepare() {
  RETURN_IF_ERROR(check_group_count(layout(), group_count()));
  const bool has_pinned_tail = layout().pinned_tail_count > 0;
  if (has_pinned_tail != is_compiled_for_tail_) RETURN_IF_ERROR(compile(has_pinned_tail));
  if (desc_.has_offset)
    offset_ = StrandPlane(desc_.name + " offset", std::vector<glm::vec4>(layout().size(), glm::vec4(0.0f)));
  return {};
}

void StrandKernel::run(const gl::Program&) {
  if (desc_.has_offset) {
    offset_.bind_storage(shader::kBindingDisplacement);
    offset_.bind_view(shader::kUnitDisplacement);
  }
  glDispatchCompute(group_count(), 1, 1);
}

void StrandKernel::forget(const std::vector<bool>& is_changed) {
  if (!desc_.has_offset) return;
  std::vector<glm::vec4> offset = offset_.read();
  for (size_t i = 0; i < offset.size(); ++i) {
    if (is_changed[i % layout().strand_count]) offset[i] = glm::vec4(0.0f);
  }
  offset_.write(offset);
}

void StrandKernel::turn_memory(const glm::dquat& turn) {
  if (desc_.has_offset) turn_plane(offset_, turn);
}

}  // namespace strandcast
