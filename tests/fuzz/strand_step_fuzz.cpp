// libFuzzer entry: a chain of "step" strand messages with the trails of two solvers; the input's layout is in
// strand_chain.h.
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/strand_chain.h"

namespace strandcast::strand_step_fuzz {

extern "C" int FUZZ_ENTRY(strand_step)(const uint8_t* data, size_t size) {
  return strandcast::fuzz_strand_chain("step", data, size);
}

}  // namespace strandcast::strand_step_fuzz
