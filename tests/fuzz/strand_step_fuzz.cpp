// libFuzzer entry: a chain of "step" strand messages with the trails of two solvers; the input's layout is in
// strand_chain.h.
#include "tests/fuzz/strand_chain.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  return strandcast::fuzz_strand_chain("step", data, size);
}
