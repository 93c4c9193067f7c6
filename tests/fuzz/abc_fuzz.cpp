// libFuzzer entry: strands in Alembic files.
#include "common/groom/abc_loader.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::abc_fuzz {

extern "C" int FUZZ_ENTRY(abc)(const uint8_t* data, size_t size) {
  const auto stated = read_abc(FuzzInput(data, size).take_rest());
  if (!stated) return 0;
  CHECK(!stated->unit_m || *stated->unit_m > 0.0f);
  check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::abc_fuzz
