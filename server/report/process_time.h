// Clock by which reports time work.
#pragma once

namespace strandcast {

/// Returns the processor time of the whole process so far, over all its threads. Any thread.
double process_cpu_ms();

}  // namespace strandcast
