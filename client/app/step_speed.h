// What a step of a strand model takes on this machine, so that the server can tell whether a viewer can
// afford a codec whose decoder runs the simulation's own steps. Any thread.
#pragma once

namespace strandcast {

/// Nanoseconds that one vertex of one solver step takes, by one thread: measured with the first call, which
/// takes some milliseconds, and remembered. 0 = this build cannot predict.
double measured_step_ns();

}  // namespace strandcast
