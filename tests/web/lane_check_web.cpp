// The same in WebAssembly, for tests/web/lanes.mjs.
#include "tests/web/lane_check.h"

extern "C" __attribute__((used, visibility("default"))) const char* lane_check() {
  static const std::string lines = strandcast::lane_results();
  return lines.c_str();
}
