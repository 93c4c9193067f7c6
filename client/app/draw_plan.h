// DrawPlan: chooses how finely a viewer draws strands, from the duration of its pictures and from what moves.
// While something moves, pictures must come soon; once everything is still, a picture may take its time. Pure
// logic on given times and measurements, one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/picture_size.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"

namespace strandcast {

/// One level of quality: size of the picture before it is stretched to the window, and share of its strands.
struct DrawStep {
  double size_share;    // of the window's sides
  double strand_share;  // of the strands that a picture of this size shows
  double cost;          // about, of the first step's time: measured with the built-in scene on llvmpipe
};

/// Levels, finest first.
inline constexpr std::array<DrawStep, 6> kDrawSteps{{
    {1.0, 1.0, 1.0},
    {0.75, 1.0, 0.65},
    {0.5, 1.0, 0.35},
    {0.5, 0.5, 0.18},
    {0.35, 0.5, 0.1},
    {0.25, 0.35, 0.05},
}};
/// Coarsest level used when local drawing is compared with the server's pictures, which are never smaller
/// either (server/encode/picture_ladder.h halves the sides at most).
inline constexpr size_t kCoarsestFairStep = 2;
/// Longest time of a picture while something moves: ten pictures a second.
inline constexpr double kMovingBudgetMs = 100.0;
/// Factors on that time beyond which a coarser, or below which a finer level is chosen.
inline constexpr double kTooLong = 1.25;
inline constexpr double kLeavesRoom = 0.8;
/// Time without motion after which everything counts as still.
inline constexpr int64_t kStandNs = 200'000'000;
/// Time for which the measured duration of a level is trusted.
inline constexpr int64_t kForgetStepNs = 20'000'000'000;
/// Motion below this many pixels of the window counts as invisible.
inline constexpr double kSeenPx = 0.5;

/// Returns the farthest distance that a vertex has moved between two states of equal size, from a sample of
/// some thousands. In pixels of a window of this size, with all vertices taken at the camera's target.
/// Infinite if it cannot be computed.
double seen_motion_px(const PosedStrands& from, const PosedStrands& to, const CameraDesc& camera,
                      RenderSize size);

/// Returns the picture size of a level for a window of this size.
RenderSize size_of_step(size_t step, RenderSize window);

class DrawPlan {
 public:
  /// Starts with `first_step` until something has been measured.
  explicit DrawPlan(size_t first_step) : moving_step_(first_step) {}

  /// Sets the pixels of the window; durations measured at another size are scaled.
  void set_pixels(uint64_t pixels);
  /// Notes that the camera, or strands visibly, have moved.
  void note_motion(int64_t time_ns) { moved_ns_ = time_ns; }
  /// Notes that a picture of this level was drawn in `ms`.
  void note_drawn(size_t step, double ms, int64_t time_ns);

  bool is_standing(int64_t time_ns) const { return time_ns - moved_ns_ >= kStandNs; }
  /// Returns when everything will count as still if nothing moves until then.
  int64_t standing_from_ns() const { return moved_ns_ + kStandNs; }
  /// Returns the level to draw now, after a picture of level `drawn`. It is the finest while everything is
  /// still; after a coarse picture, an intermediate level comes first.
  size_t step_at(int64_t time_ns, size_t drawn) const {
    if (!is_standing(time_ns)) return moving_step_;
    return drawn > kCoarsestFairStep ? kCoarsestFairStep : 0;
  }
  size_t moving_step() const { return moving_step_; }
  /// Returns the expected duration of a picture of this level, measured or derived from other levels; 0
  /// before the first measurement.
  double expected_ms(size_t step, int64_t time_ns) const;
  /// Returns the duration of a picture during motion, for comparison with the server's pictures. It is that
  /// of the level in use, but none coarser than kCoarsestFairStep. Pictures drawn while everything is still
  /// do not count. 0 = unknown.
  double fair_ms(int64_t time_ns) const;

 private:
  static constexpr size_t kKept = 5;
  struct Measured {
    std::deque<double> ms;  // the newest kKept
    int64_t time_ns = 0;
  };
  bool is_fresh(size_t step, int64_t time_ns) const;
  double median_ms(size_t step) const;
  void choose(int64_t time_ns);

  std::array<Measured, kDrawSteps.size()> measured_;
  size_t moving_step_;
  size_t last_step_ = 0;  // that was measured
  uint64_t pixels_ = 0;
  int64_t moved_ns_ = 0;
};

}  // namespace strandcast
