// libFuzzer entry: a `.tfx` groom of the text version.
#include "common/groom/tfx_loader.h"

#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::tfx_text_fuzz {

extern "C" int FUZZ_ENTRY(tfx_text)(const uint8_t* data, size_t size) {
  if (const auto stated = read_tfx_text(FuzzInput(data, size).take_rest_as_text()))
    check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::tfx_text_fuzz
