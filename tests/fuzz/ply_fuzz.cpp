// libFuzzer entry: strands in a `.ply`.
#include "common/groom/ply_loader.h"

#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/groom_checks.h"

namespace strandcast::ply_fuzz {

extern "C" int FUZZ_ENTRY(ply)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  const uint32_t strand_vertex_count = input.take<uint8_t>();
  const auto stated = read_ply(input.take_rest(), strand_vertex_count);
  if (!stated) return 0;
  CHECK(!stated->unit_m || *stated->unit_m > 0.0f);
  check_loaded_groom(stated->groom);
  return 0;
}

}  // namespace strandcast::ply_fuzz
