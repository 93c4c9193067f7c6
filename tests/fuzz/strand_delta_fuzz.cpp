// libFuzzer entry: a chain of "delta" strand messages; the input's layout is in strand_chain.h.
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/strand_chain.h"

namespace strandcast::strand_delta_fuzz {

extern "C" int FUZZ_ENTRY(strand_delta)(const uint8_t* data, size_t size) {
  return strandcast::fuzz_strand_chain("delta", data, size);
}

}  // namespace strandcast::strand_delta_fuzz
