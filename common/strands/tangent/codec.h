// Makers of the codecs "tangent" and "step" for the codec table (common/strands/strand_codec.h).
#pragma once

#include <memory>

#include "common/simd/variants.h"
#include "common/strands/step/step_reader.h"
#include "common/strands/strand_codec.h"

namespace strandcast::tangent {

std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers);
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers);
/// Codec "step": the "tangent" codec, predicted by solver steps where they are known (common/strands/step).
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers);
std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers);
/// Makes a codec for one of the processor's instruction sets; bytes and states are the same with all of them.
std::unique_ptr<StrandEncoder> make_encoder(WorkerPool& workers, simd::InstructionSet set);
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set);
/// Makes a decoder for "step" if `steps` is given, else for "tangent".
std::unique_ptr<StrandDecoder> make_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                            simd::InstructionSet set,
                                            std::unique_ptr<step::StepReader> steps);
std::unique_ptr<StrandEncoder> make_step_encoder(WorkerPool& workers, simd::InstructionSet set);
std::unique_ptr<StrandDecoder> make_step_decoder(const StrandStreamLimits& limits, WorkerPool& workers,
                                                 simd::InstructionSet set);
/// Does for these codecs what lattice_step_m() of strand_codec.h does.
float lattice_step_m(float bound_m);

}  // namespace strandcast::tangent
