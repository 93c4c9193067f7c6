// libFuzzer entry: a binary `.tfx` groom.
#include "common/groom/tfx_loader.h"

#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::tfx_fuzz {

extern "C" int FUZZ_ENTRY(tfx)(const uint8_t* data, size_t size) {
  if (const auto stated = read_tfx_binary(ByteView(FuzzInput(data, size).take_rest())))
    check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::tfx_fuzz
