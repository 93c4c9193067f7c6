#include "server/sim/strand_kernel.h"

namespace strandcast {

void StrandKernel::prepare() {
  if (desc_.has_offset)
    offset_ = make_plane(desc_.name + " offset", std::vector<glm::vec4>(layout().size(), glm::vec4(0.0f)));
}

KernelDesc StrandKernel::kernel() const {
  KernelDesc desc;
  desc.shader_path = desc_.shader_path;
  desc.variant = {{"HAS_PINNED_TAIL", layout().pinned_tail_count > 0 ? 1 : 0}};
  desc.constants = desc_.constants;
  desc.is_per_vertex = desc_.is_per_vertex;
  return desc;
}

void StrandKernel::bind(BoundPlanes& planes) const {
  plane_of(planes, PlaneRole::Displacement) = offset_.get();
}

void StrandKernel::forget(const std::vector<bool>& is_changed) {
  if (!desc_.has_offset) return;
  std::vector<glm::vec4> offset;
  offset_->read(offset);
  for (size_t i = 0; i < offset.size(); ++i) {
    if (is_changed[i % layout().strand_count]) offset[i] = glm::vec4(0.0f);
  }
  offset_->write(offset);
}

void StrandKernel::turn_memory(const glm::dquat& turn) {
  if (desc_.has_offset) turn_plane(*offset_, turn);
}

}  // namespace strandcast
