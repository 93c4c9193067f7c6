// Prints what this processor's lanes make of numbers at the edges.
#include <cstdio>

#include "tests/web/lane_check.h"

int main() {
  std::fputs(strandcast::lane_results().c_str(), stdout);
}
