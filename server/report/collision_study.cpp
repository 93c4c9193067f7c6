#include "server/report/collision_study.h"

#include "server/sim/solver_registry.h"

namespace strandcast {

Result<CollisionStudy> run_collision_study(const CollisionStudyDesc& desc, Executor& executor,
                                           const CollisionProgress& progress) {
  ASSIGN_OR_RETURN(const SolverRow* row, find_solver(desc.scene.solver.name));
  if (!row->has_kernel)
    return make_error(
        ErrorCode::BadInput,
        "{} has no kernel, and meets neither a head's field nor a body; --set solver.name= names "
        "another (strandcast-server --list-solvers)",
        row->name);
  CollisionStudy study;
  study.solver = row->name;
  study.device = executor.info().name;
  RETURN_IF_ERROR(measure_head_collisions(desc, executor, progress, study));
  RETURN_IF_ERROR(measure_body_answers(desc, executor, progress, study));
  return study;
}

}  // namespace strandcast
