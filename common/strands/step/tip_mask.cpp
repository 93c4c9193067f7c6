#include "common/strands/step/tip_mask.h"

#include <algorithm>

namespace strandcast::step {

constexpr size_t kBits = 8;

void write_tails(std::span<const uint8_t> has_tail, ByteWriter& to) {
  for (size_t begin = 0; begin < has_tail.size(); begin += kBits) {
    uint8_t bits = 0;
    for (size_t i = begin; i < std::min(begin + kBits, has_tail.size()); ++i)
      bits = static_cast<uint8_t>(bits | (has_tail[i] != 0 ? 1u << (i - begin) : 0u));
    to.put(bits);
  }
}

Result<std::vector<uint8_t>> read_tails(ByteReader& bytes, uint32_t strand_count) {
  const auto bits = bytes.take_bytes((size_t{strand_count} + kBits - 1) / kBits);
  if (!bytes.ok()) return make_error(ErrorCode::BadInput, "the tips of a step's strands are cut off");
  std::vector<uint8_t> has_tail(strand_count);
  for (uint32_t s = 0; s < strand_count; ++s)
    has_tail[s] = (std::to_integer<uint8_t>(bits[s / kBits]) >> (s % kBits)) & 1u;
  return has_tail;
}

Result<std::unique_ptr<TipMask>> TipMask::make(std::span<const uint8_t> has_tail, const MovingPlanes& moving,
                                               simd::InstructionSet set, const LaneWork& work) {
  auto mask = std::make_unique<TipMask>();
  for (const Tips of : kBothTips) {
    const KernelDesc desc = put_back_kernel(of);
    const LaneKernel* kernel = find_lane_kernel(desc, set);
    if (kernel == nullptr)
      return make_error(ErrorCode::Unsupported, "this build has no {} for this processor to predict with",
                        desc.shader_path);
    mask->program_[static_cast<size_t>(of)].emplace(*kernel, desc, work);
  }
  std::vector<glm::vec4> rows;
  for (const uint8_t value : has_tail) rows.emplace_back(static_cast<float>(value));
  mask->has_tail_ = std::make_unique<StrandBlocks>(work.strand_count, 1);
  pack_blocks(std::span<const glm::vec4>(rows), *mask->has_tail_);
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr)
      mask->kept_[role] = std::make_unique<StrandBlocks>(work.strand_count, work.vertex_count);
  return mask;
}

void TipMask::keep(Tips of, const StepBlock& step, const MovingPlanes& moving) {
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr) copy(of, step, *moving[role], *kept_[role]);
}

void TipMask::put_back(Tips of, const StepBlock& step, const MovingPlanes& moving) {
  for (size_t role = 0; role < kPlaneRoleCount; ++role)
    if (moving[role] != nullptr) copy(of, step, *kept_[role], *moving[role]);
}

void TipMask::copy(Tips of, const StepBlock& step, StrandBlocks& from, StrandBlocks& to) {
  LanePlanes planes{};
  planes[static_cast<size_t>(PlaneRole::RodStrand)] = has_tail_.get();
  planes[static_cast<size_t>(PlaneRole::PlaceBefore)] = &from;
  planes[static_cast<size_t>(PlaneRole::Position)] = &to;
  program_[static_cast<size_t>(of)]->run(step, 0, planes, {});
}

}  // namespace strandcast::step
