// libFuzzer entry: a `.hair` groom.
#include "common/groom/hair_loader.h"

#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace strandcast;
  if (const auto groom = read_hair(ByteView(FuzzInput(data, size).take_rest()))) check_loaded_groom(*groom);
  return 0;
}
