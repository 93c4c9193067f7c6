// Apart from codec.cpp: a program that decodes no steps links its own make_step_decoder() instead
// (client/web).
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
