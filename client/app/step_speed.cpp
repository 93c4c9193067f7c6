#include "client/app/step_speed.h"

#include "common/kernels/step_speed.h"

namespace strandcast {
double measured_step_ns() {
  static const double step_ns = measure_kernel_step_ns();
  return step_ns;
}

}  // namespace strandcast
