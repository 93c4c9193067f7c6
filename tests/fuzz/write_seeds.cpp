// Writes the first inputs of the fuzzers whose format has structure: fuzz_seeds FOLDER makes
// FOLDER/<target>/seed_*. What fuzzing finds beside them is committed in the same folders.
#include <fmt/format.h>

#include "tests/fuzz/seed_folder.h"

int main(int argument_count, char** arguments) {
  using namespace strandcast;
  if (argument_count != 2) {
    fmt::print(stderr, "usage: fuzz_seeds FOLDER (for example tests/fuzz/corpus)\n");
    return 2;
  }
  const SeedFolder seeds(arguments[1]);
  add_wire_seeds(seeds);
  add_live_seeds(seeds);
  add_file_seeds(seeds);
  return 0;
}
