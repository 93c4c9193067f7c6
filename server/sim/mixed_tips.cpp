#include "server/sim/mixed_tips.h"

namespace strandcast {

Result<MixedTips> MixedTips::make(Executor& executor, const SceneFeatures& features,
                                  const StrandLayout& layout, const BoundPlanes& moving) {
  MixedTips mixed;
  for (const Tips of : kBothTips) {
    ASSIGN_OR_RETURN(mixed.program_[static_cast<size_t>(of)],
                     executor.make_program(put_back_kernel(of), features, layout));
  }
  std::vector<glm::vec4> has_tail;
  for (const uint8_t value : layout.has_tail) has_tail.emplace_back(static_cast<float>(value));
  mixed.has_tail_ = executor.make_plane("pinned tips", layout.strand_count, has_tail);
  const std::vector<glm::vec4> zero(layout.size(), glm::vec4(0.0f));
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr)
      mixed.kept_[role] = executor.make_plane("strands kept", layout.strand_count, zero);
  return mixed;
}

void MixedTips::keep(Tips of, const StepBlock& step, const BoundPlanes& moving) {
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr) copy(of, step, *moving[role], *kept_[role]);
}

void MixedTips::put_back(Tips of, const StepBlock& step, const BoundPlanes& moving) {
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr) copy(of, step, *kept_[role], *moving[role]);
}

void MixedTips::copy(Tips of, const StepBlock& step, StrandPlane& from, StrandPlane& to) {
  BoundPlanes planes{};
  plane_of(planes, PlaneRole::RodStrand) = has_tail_.get();
  plane_of(planes, PlaneRole::PlaceBefore) = &from;
  plane_of(planes, PlaneRole::Position) = &to;
  program_[static_cast<size_t>(of)]->run(step, 0, planes);
}

uint64_t MixedTips::size_bytes() const {
  uint64_t bytes = has_tail_->size_bytes();
  for (const auto& program : program_) bytes += program->size_bytes();
  for (const auto& plane : kept_)
    if (plane) bytes += plane->size_bytes();
  return bytes;
}

}  // namespace strandcast
