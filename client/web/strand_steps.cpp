// Of the modules that take steps.
#include "client/web/core_export.h"
#include "client/web/strand_core.h"
#include "common/kernels/step_speed.h"

STRAND_CORE_EXPORT double strand_core_step_ns() {
  return strandcast::measure_kernel_step_ns();
}
