// MotionSet: strands on a moving head in gusts, which work-precision measures besides exact solutions. Hair
// of real constants grows from a ring about the head: straight and hanging, or naturally curled or styled. It
// begins without weight, so that every model begins in its own equilibrium; head motion, wind and weight set
// in smoothly. The server's own StepBuilder makes the inputs. There are no colliders, because their effect
// depends on the positions of vertices. Any thread; immutable.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "common/motion/motion_file.h"
#include "server/report/strand_run.h"

namespace strandcast {

/// Shape of the strands without forces.
enum class MotionHair {
  Straight,  // hangs straight down
  Curled,    // helices of two turns, 20 mm wide, about an axis that hangs down
  Styled     // leaves the head outwards and turns down in one arc of 100 degrees
};
inline constexpr MotionHair kMotionHairs[] = {MotionHair::Straight, MotionHair::Curled, MotionHair::Styled};
/// Returns "straight", "curled" or "styled".
const char* to_string(MotionHair hair);

struct MotionSetOptions {
  std::filesystem::path clip;  // .bvh; empty: the built-in head motion
  double duration_s = 3.0;
  uint32_t strand_count = 8;
  MotionHair hair = MotionHair::Straight;
  MotionFileOptions clip_file = {};  // how to read the clip
};

/// Positions of one run at times that all rates share, kSampleS apart. Each has (vertex_count x strand_count)
/// points, vertex-major, head-relative world axes.
struct Trajectory {
  uint32_t strand_count = 0;
  uint32_t vertex_count = 0;
  std::vector<std::vector<glm::vec3>> position_m;
  double stretch = 0.0;   // largest at any sample
  bool is_finite = true;  // at every sample
};

class MotionSet {
 public:
  static constexpr double kSampleS = 1.0 / 30.0;
  static constexpr double kLengthM = 0.25;
  static constexpr double kAirDragPerS = 4.0;    // between a wisp and a single hair
  static constexpr double kFrameS = 1.0 / 60.0;  // times are given per strand and frame of this length

  static Result<MotionSet> make(const MotionSetOptions& options);

  /// Returns the strands, cut into segments; timing uses more strands than are measured.
  Groom groom(uint32_t vertex_count, uint32_t strand_count) const;
  Groom groom(uint32_t vertex_count) const { return groom(vertex_count, options_.strand_count); }
  /// Returns hair of the reference constants in air, with its material damping.
  RunPhysics physics() const;
  MotionHair hair() const { return options_.hair; }
  /// Returns the head's pose: twice differentiable in time, at rest and upright at 0.
  Pose head_at(double t_s) const;
  double duration_s() const { return options_.duration_s; }

  /// Runs the whole motion at the setting's rate, which must be a multiple of 1 / kSampleS.
  Result<Trajectory> run(const Workbench& workbench, const RunSetting& setting) const {
    return run(workbench, setting, options_.strand_count);
  }
  /// Runs with every n-th strand only; `strand_count` must divide the number of all.
  Result<Trajectory> run(const Workbench& workbench, const RunSetting& setting, uint32_t strand_count) const;
  /// Returns the inputs of the first `step_count` steps, substep by substep.
  std::vector<StepInput> inputs(const RunSetting& setting, int step_count) const;

 private:
  MotionSet(MotionSetOptions options, MotionClip clip)
      : options_(std::move(options)), clip_(std::move(clip)) {}

  Pose clip_pose(double clip_s) const;
  void for_each_step(const RunSetting& setting, int step_count,
                     const std::function<void(const std::vector<StepInput>&)>& take) const;

  MotionSetOptions options_;
  MotionClip clip_;  // empty: built in
};

/// Runs a row in double precision at its default effort.
Result<Trajectory> run_in_double(const MotionSet& motion, const std::string& solver, uint32_t vertex_count,
                                 double rate_hz);

/// Runs the rod that others are compared with: direct_rod in double precision.
Result<Trajectory> run_rod(const MotionSet& motion, uint32_t vertex_count, double rate_hz);

/// Returns the RMS distance of a run's free vertices from the reference's curve at equal arc share, over
/// strands and samples, relative to the length; infinity if either is not finite. If one strand count divides
/// the other, only common strands are compared.
double relative_rms(const Trajectory& run, const Trajectory& reference);

}  // namespace strandcast
