// Head motion and wind as functions of time, for the feeder and for tests. Built-in generators are
// deterministic. Files are read in bvh.h and wind_csv.h; network streams are in common/wire and server/input.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "common/math/pose.h"

namespace strandcast {

/// Head poses at a fixed rate; the clip loops seamlessly only if its data does.
struct MotionClip {
  double frame_s = 1.0 / 60.0;
  std::vector<Pose> world_from_head;  // one per frame
  // Joints of the body, by the names that body_desc.h gives them or those of the file; none where not asked
  // for.
  std::vector<std::string> joint_name;
  std::vector<glm::dvec3> joint_m;   // (frames x joints) head space
  double file_unit_m = 1.0;          // metres per unit of the file it came from
  std::string up = "+Y";             // of the file it came from
  std::string unit_reason;           // why this unit, when nobody stated it; else empty
  std::string unit_doubt;            // why the stated unit is none of a body's; else empty
  std::string up_doubt;              // likewise, the stated up axis
  std::vector<std::string> repairs;  // what a file needed to be read, a sentence for each kind
  std::string up_reason;             // likewise why not +Y, of a file with another up axis
  std::string facing_reason;         // why its rest pose faces another side than most; else empty
  std::string head_reason;           // which joint of a file is taken as the head

  /// Returns the time of the last pose, s; 0 for an empty clip.
  double duration_s() const;
  /// Returns the pose at time t (linear and spherical interpolation), clamped to the clip; the identity for
  /// an empty clip.
  Pose sample(double t_s) const;
  /// Returns the positions of the joints at time t, clamped to the clip.
  std::vector<glm::dvec3> sample_joints(double t_s) const;
};

/// Wind velocity over time at the head, world axes.
struct WindSeries {
  std::vector<double> time_s;  // increasing, from 0
  std::vector<glm::vec3> velocity_mps;
  std::vector<std::string> repairs;  // what a file needed to be read, a sentence for each kind

  /// Returns the time of the last sample, s; 0 for an empty series.
  double duration_s() const;
  /// Returns the velocity at time t, linearly interpolated and clamped to the series; zero for an empty
  /// series.
  glm::vec3 sample(double t_s) const;
};

/// Returns a pose of the built-in head motion: walking, looks to the sides, nods and one fast turn. Repeats
/// every kBuiltInMotionPeriodS and is twice differentiable.
Pose built_in_motion(double t_s);
inline constexpr double kBuiltInMotionPeriodS = 12.0;

/// Seeded turbulence about a mean wind: a sum of harmonics whose amplitudes follow the von Karman spectrum.
/// `intensity` is standard deviation / mean speed along the mean; it is 0.8 times as strong sideways and 0.5
/// times across (IEC 61400-1). Without a mean there are no gusts. Works for any t; the same seed gives the
/// same wind.
class GustGenerator {
 public:
  GustGenerator(const glm::vec3& mean_mps, float intensity, float length_m, uint32_t seed);
  /// Returns the wind velocity at time t, m/s, world axes.
  glm::vec3 sample(double t_s) const;

 private:
  struct Harmonic {
    glm::dvec3 amplitude_mps;
    double omega_rad_per_s;
    glm::dvec3 phase_rad;
  };
  glm::dvec3 mean_mps_;
  std::vector<Harmonic> harmonics_;
};

}  // namespace strandcast
