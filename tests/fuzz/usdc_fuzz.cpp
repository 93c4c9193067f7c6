// libFuzzer entry: strands in binary USD, and in packages.
#include "common/groom/usd_loader.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::usdc_fuzz {

extern "C" int FUZZ_ENTRY(usdc)(const uint8_t* data, size_t size) {
  const auto stated = read_usd(FuzzInput(data, size).take_rest_as_text());
  if (!stated) return 0;
  CHECK(!stated->unit_m || *stated->unit_m > 0.0f);
  check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::usdc_fuzz
