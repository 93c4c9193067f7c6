// What reports time work by.
#pragma once

namespace strandcast {

/// Processor time of the whole process so far, of all its threads. Any thread.
double process_cpu_ms();

}  // namespace strandcast
