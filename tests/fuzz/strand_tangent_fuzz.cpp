// libFuzzer entry: a chain of "tangent" strand messages; the input's layout is in strand_chain.h.
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/strand_chain.h"

namespace strandcast::strand_tangent_fuzz {

extern "C" int FUZZ_ENTRY(strand_tangent)(const uint8_t* data, size_t size) {
  return strandcast::fuzz_strand_chain("tangent", data, size);
}

}  // namespace strandcast::strand_tangent_fuzz
