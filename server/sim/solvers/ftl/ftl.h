// Static Follow-The-Leader: every vertex is put onto the sphere about the one before it, from root to tip,
// and velocities are differences of positions. Exact lengths; but nothing of a vertex's correction reaches
// the vertices before it, so each moves as if those after it weighed nothing: a strand swings with the
// frequency of one segment and damps unevenly. That is what the model is, and why Dynamic Follow-The-Leader
// exists. Source: Woodhouse 2017, 2.1.4, equations of dv, p_i and d_i.
#pragma once

#include "server/sim/solver_registry.h"

namespace strandcast {

SolverRow ftl_row();

}  // namespace strandcast
