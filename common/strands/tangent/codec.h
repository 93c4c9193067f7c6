// The codecs "tangent" and "step" as rows of the codec table need it (common/strands/strand_codec.h).
#pragma once

#include <memory>

#include "common/simd/variants.h"
#include "common/strands/step/step_reader.h"
#include "common/strands/strand_codec.h"

namespace strandcast::tangent {

std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers);
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers);
/// The codec "step": the same, predicted by steps of the solver where they are known (common/strands/step).
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers);
std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers);
/// For one instruction set of those that the processor has: the same bytes and states with all of them.
std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers, simd::InstructionSet set);
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set);
/// Of "step" where there are `steps`, else of "tangent".
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set,
                                            std::unique_ptr<step::StepReader> steps);
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers, simd::InstructionSet set);
std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                                 simd::InstructionSet set);
/// As lattice_step_m() of strand_codec.h.
float lattice_step_m(float bound_m);

}  // namespace strandcast::tangent
