// Bullet's soft-body rope (Debian package libbullet-dev): distance constraints between point masses,
// iterated; no bending. What it stretches and what it costs, for comparison in the same run. One thread.
#pragma once

#include <cstdint>

namespace strandcast {

struct RopeSetup {
  uint32_t rope_count = 1;
  uint32_t node_count = 32;  // per rope
  double length_m = 0.3;
  double step_s = 1.0 / 60.0;
  uint32_t iterations = 4;  // of the position solver
};

/// "Bullet 3.24"; "" when the bench was built without it.
const char* rope_peer_name();

/// Largest relative lengthening while ropes held at one end fall from horizontal for `seconds`: of the worst
/// segment, and of a whole rope.
struct RopeStretch {
  double segment = 0.0;
  double whole = 0.0;
};
RopeStretch rope_stretch(const RopeSetup& setup, double seconds);

/// Milliseconds per step of the same ropes: the best of `steps` after as many to warm up.
double rope_step_ms(const RopeSetup& setup, int steps);

}  // namespace strandcast
