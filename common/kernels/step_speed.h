// How fast this machine steps strands by kernels. Any thread.
#pragma once

namespace strandcast {

/// Nanoseconds that one thread takes for one vertex of one step of dftl: measured anew with each call, which
/// takes some milliseconds. 0 = no kernel was built for this processor.
double measure_kernel_step_ns();
/// Returns what the first call of this program measured.
inline double measured_step_ns() {
  static const double step_ns = measure_kernel_step_ns();
  return step_ns;
}

}  // namespace strandcast
