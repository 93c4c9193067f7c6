// Motion of curves in an Alembic file that move as one rigid body: a groom that another program has put on an
// animated head. Untrusted input. Any thread.
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/math/pose.h"

namespace strandcast {

inline constexpr uint64_t kMaxCurveMotionSamples = 100'000;
/// What exports of ours say of themselves.
inline constexpr std::string_view kAbcRestSample = "Sample 0 is the rest shape";
/// How far a root may be from where the rigid motion takes it, over the mean distance from their middle.
inline constexpr double kRigidShare = 0.01;

struct CurveMotion {
  std::vector<double> time_s;  // increasing, from 0
  /// (samples) from the roots of the file's first sample to theirs; its place is in units of the file.
  std::vector<Pose> from_first;
  size_t object_count = 0, root_count = 0;
  bool is_behind_rest = false;  // the file's first sample is the rest shape, and no part of the motion

  double duration_s() const { return time_s.empty() ? 0.0 : time_s.back(); }
  /// Returns the movement at a time, held before the first sample and after the last.
  Pose sample(double t_s) const;
};

/// Reads the motion of all visible curves' roots. The rest shape that our own exports begin with counts as
/// the hair's place alone, so that the motion begins with the sample behind it. BadInput where there is none,
/// where roots come and go, or where they do not move as one (kRigidShare); errors name the file.
Result<CurveMotion> load_abc_motion(const std::filesystem::path& path);

}  // namespace strandcast
