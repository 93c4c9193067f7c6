#include "server/report/process_time.h"

#include <time.h>

namespace strandcast {

double process_cpu_ms() {
  timespec cpu{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &cpu);
  return 1e3 * static_cast<double>(cpu.tv_sec) + 1e-6 * static_cast<double>(cpu.tv_nsec);
}

}  // namespace strandcast
