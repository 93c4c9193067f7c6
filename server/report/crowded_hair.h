// CrowdedHair: hair with forces between strands that is shaken and then left alone; measures its final state
// in head space. Runs on its executor's thread.
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

/// Measurements of hair that should be at rest.
struct RestFindings {
  double speed_rms_mps = 0.0;
  double nyquist_m = 0.0;  // largest amplitude of what changes its sign from step to step, 99.9 % of vertices
  double volume_share = 0.0;   // of the groom's: (length of all hair)^2 / integral of the squared density
  double crowded_share = 0.0;  // of vertices that lie more than twice as dense as in the groom
  double highest_m = 0.0;      // height of the hair above the head joint
};

/// Makes a tuft that hangs from a disc and widens downwards, with a slightly different direction per strand.
/// Without forces between strands it falls together. Roots are pinned.
Groom make_tuft(uint32_t strand_count, uint32_t vertex_count, float length_m, uint32_t seed);

/// Returns the pose of a shaken head: 3 g to and fro at 2 Hz while it turns and nods.
Pose shaken_head(double time_s);

/// Runs the scene's solver on a moving head, with the scene's wind and colliders.
class HairRun {
 public:
  /// Makes a run; errors as SolverRow::make() and Solver::load(). `executor` must outlive it.
  static Result<HairRun> make(Executor& executor, const SceneDesc& scene, const SceneContent& content);

  /// Advances one step; `world_from_head` is the pose at its end.
  void step(const Pose& world_from_head);
  double time_s() const { return static_cast<double>(tick_) / scene_.step_rate_hz; }
  const SceneDesc& scene() const { return scene_; }
  const StrandLayout& layout() const { return layout_; }
  /// Positions (vertex_count x strand_count) in head space, m, and velocities relative to the head joint in
  /// head axes.
  const std::vector<glm::vec3>& position_in_head_m() const { return position_m_; }
  const std::vector<glm::vec3>& velocity_in_head_mps() const { return velocity_mps_; }
  /// Returns the processor time of the whole process during all steps.
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
  /// Makes a run of a groom without a head; a separate volume with `look_resolution` cells measures it.
  static Result<CrowdedHair> make(Executor& executor, const SceneDesc& scene, Groom groom,
                                  uint32_t look_resolution);

  /// Shake the hair for `seconds`, and hold it still.
  void shake(double seconds);
  void hold(double seconds);
  /// Measures the hair while it lies still for `seconds`.
  RestFindings look(double seconds);
  /// Returns the root mean square distance of vertices from their groomed positions.
  double shape_rms_m() const;
  /// Returns the mean displacement of all vertices from their groomed positions, head space.
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
