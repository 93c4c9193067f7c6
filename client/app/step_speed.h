// Measures the cost of a strand model's step on this machine. The server uses it to decide whether a viewer
// can afford a codec whose decoder runs the simulation's own steps. Any thread.
#pragma once

namespace strandcast {

/// Returns the nanoseconds that one vertex of one solver step takes on one thread. The first call measures
/// it, which takes some milliseconds; later calls return the same value. 0 = this build cannot predict.
double measured_step_ns();

}  // namespace strandcast
