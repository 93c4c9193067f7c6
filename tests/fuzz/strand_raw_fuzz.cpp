// libFuzzer entry: a chain of "raw" strand messages; the input's layout is in strand_chain.h.
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/strand_chain.h"

namespace strandcast::strand_raw_fuzz {

extern "C" int FUZZ_ENTRY(strand_raw)(const uint8_t* data, size_t size) {
  return strandcast::fuzz_strand_chain("raw", data, size);
}

}  // namespace strandcast::strand_raw_fuzz
