// CrowdedHair: hair that acts on hair, shaken and left alone, and how it lies afterwards, seen from the head.
// From the thread of its executor.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/kernels/volume/hair_volume.h"
#include "server/scene/scene_content.h"
#include "server/scene/step_builder.h"
#include "server/sim/executor/executor.h"
#include "server/sim/solver_registry.h"

namespace strandcast {

/// What is seen of hair that should lie still.
struct RestFindings {
  double speed_rms_mps = 0.0;
  double nyquist_m = 0.0;  // largest amplitude of what changes its sign from step to step, 99.9 % of vertices
  double volume_share = 0.0;   // of the groom's: (length of all hair)^2 / integral of the squared density
  double crowded_share = 0.0;  // of vertices that lie more than twice as dense as in the groom
  double highest_m = 0.0;      // height of the hair above the head joint
};

/// A tuft that hangs from a disc and gets wider downwards, each strand a little in its own direction: without
/// forces between strands it falls together. Roots are pinned.
Groom make_tuft(uint32_t strand_count, uint32_t vertex_count, float length_m, uint32_t seed);

/// Where a shaken head is: 3 g to and fro at 2 Hz while it says no and nods.
Pose shaken_head(double time_s);

/// The scene's solver under that head: no wind but the scene's own, and the colliders that are given.
class HairRun {
 public:
  /// As SolverRow::make() and Solver::load(). `executor` outlives the run.
  static Result<HairRun> make(Executor& executor, const SceneDesc& scene, const SceneContent& content);

  /// One step, with the head there at its end.
  void step(const Pose& world_from_head);
  double time_s() const { return static_cast<double>(tick_) / scene_.step_rate_hz; }
  const SceneDesc& scene() const { return scene_; }
  const StrandLayout& layout() const { return layout_; }
  /// (vertex_count x strand_count) head space, m; velocities relative to the head joint, head axes.
  const std::vector<glm::vec3>& position_in_head_m() const { return position_m_; }
  const std::vector<glm::vec3>& velocity_in_head_mps() const { return velocity_mps_; }
  /// Of the simulation's thread, over all steps: processor time of the whole process.
  double cpu_ms() const { return cpu_ms_; }
  uint64_t steps() const { return tick_; }

 private:
  HairRun(const SceneDesc& scene, StrandLayout layout, std::vector<SphereCollider> colliders);

  SceneDesc scene_;
  StrandLayout layout_;
  StepBuilder builder_;
  SceneFeatures features_;
  std::unique_ptr<Solver> solver_;
  SolverState state_;
  std::vector<glm::vec3> position_m_;
  std::vector<glm::vec3> velocity_mps_;
  Pose before_;
  double cpu_ms_ = 0.0;
  uint64_t tick_ = 0;
};

class CrowdedHair {
 public:
  /// A groom without a head; it is looked at by a volume of its own, of so many cells.
  static Result<CrowdedHair> make(Executor& executor, const SceneDesc& scene, Groom groom,
                                  uint32_t look_resolution);

  /// Shakes for so long, then holds still.
  void shake(double seconds);
  void hold(double seconds);
  /// While it lies for so long.
  RestFindings look(double seconds);
  /// Root mean square of how far vertices are from where the groom has them.
  double shape_rms_m() const;
  /// Of all vertices from where the groom has them, head space.
  glm::dvec3 mean_shift_m() const;
  const HairRun& run() const { return run_; }

 private:
  CrowdedHair(HairRun run, HairVolume volume);

  void fill();
  std::vector<double> densities();
  double filled_volume_m3();

  HairRun run_;
  HairVolume volume_;  // that it is looked at by
  std::vector<glm::vec4> nodes_;
  std::vector<double> groom_density_;
  double groom_volume_m3_ = 0.0;
  Pose still_ = shaken_head(0.0);
};

}  // namespace strandcast
