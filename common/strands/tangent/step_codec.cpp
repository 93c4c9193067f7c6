// Apart from codec.cpp: a program that decodes no steps links its own make_step_decoder() instead
// (client/web).
#include <utility>

#include "common/strands/shared_strands.h"
#include "common/strands/step/steps.h"
#include "common/strands/tangent/codec.h"

namespace strandcast::tangent {

std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers) {
  return make_step_decoder(limits, workers, simd::widest_set());
}
std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                                 simd::InstructionSet set) {
  return make_decoder(limits, workers, set, std::make_unique<step::DecoderSteps>(workers, set));
}

}  // namespace strandcast::tangent

namespace strandcast {

Result<SharedUpdate> read_shared(std::span<const std::byte> keyframe, const StrandStreamLimits& limits,
                                 std::span<const glm::vec3> rest_in_head_m, WorkerPool& workers) {
  const simd::InstructionSet set = simd::widest_set();
  auto steps = std::make_unique<step::DecoderSteps>(workers, set);
  step::DecoderSteps& reader = *steps;
  reader.keep_shared();
  const auto decoder = tangent::make_decoder(limits, workers, set, std::move(steps));
  decoder->set_rest_shape(rest_in_head_m);
  ASSIGN_OR_RETURN(const auto decoded, decoder->decode(keyframe));
  const std::shared_ptr<SharedUpdate> update = reader.take_shared();
  if (update == nullptr)
    return make_error(ErrorCode::Unavailable, "the keyframe tells no state of all strands");
  return std::move(*update);
}

}  // namespace strandcast
