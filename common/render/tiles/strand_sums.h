// Sums drawn strands into the cells of the light lattice (common/render/light_lattice.h), as integers. No GL.
#pragma once

#include <cstdint>

#include "common/render/light_lattice.h"
#include "common/simd/variants.h"

namespace strandcast {

struct StrandSumArguments {
  const LatticeFrame* frame;
  const StrandPoints* points;
  LightStrands strands;
  uint32_t begin, end;  // strands
  int32_t* sums;        // (frame->size) in kLightSumUnit; added to
};
void sum_strands(simd::InstructionSet set, const StrandSumArguments& arguments);

}  // namespace strandcast
