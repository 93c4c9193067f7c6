// libFuzzer entry: a `.hair` groom.
#include "common/groom/hair_loader.h"

#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::hair_fuzz {

extern "C" int FUZZ_ENTRY(hair)(const uint8_t* data, size_t size) {
  if (const auto stated = read_hair(ByteView(FuzzInput(data, size).take_rest())))
    check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::hair_fuzz
