// DrawPlan: how finely a viewer draws strands, from what pictures took and from what moves. While something
// moves a picture has to be there soon; once all stands still it may take its time. Pure logic on given times
// and measurements, one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "common/base/picture_size.h"
#include "common/scene/scene_desc.h"
#include "common/strands/posed_strands.h"

namespace strandcast {

/// One way to draw: how large the picture is before it is stretched over the window, and with how many of its
/// strands.
struct DrawStep {
  double size_share;    // of the window's sides
  double strand_share;  // of the strands that a picture of this size shows
  double cost;          // about, of the first step's time: measured with the built-in scene on llvmpipe
};

/// Finest first.
inline constexpr std::array<DrawStep, 6> kDrawSteps{{
    {1.0, 1.0, 1.0},
    {0.75, 1.0, 0.65},
    {0.5, 1.0, 0.35},
    {0.5, 0.5, 0.18},
    {0.35, 0.5, 0.1},
    {0.25, 0.35, 0.05},
}};
/// The coarsest step that still counts as a picture when drawing here is weighed against the server's
/// pictures: those are never smaller than this either (server/encode/picture_ladder.h halves the sides at
/// most).
inline constexpr size_t kCoarsestFairStep = 2;
/// A picture may take so long while something moves: ten a second.
inline constexpr double kMovingBudgetMs = 100.0;
/// So far beyond, or below, before another step is taken.
inline constexpr double kTooLong = 1.25;
inline constexpr double kLeavesRoom = 0.8;
/// Nothing has moved for so long: it stands.
inline constexpr int64_t kStandNs = 200'000'000;
/// What a step took is believed for so long; then it is as good as never tried.
inline constexpr int64_t kForgetStepNs = 20'000'000'000;
/// A movement of less than this many pixels of the window nobody sees.
inline constexpr double kSeenPx = 0.5;

/// The farthest that a vertex has gone between two states of equal sizes, in pixels of a window of this size,
/// as if all were where the camera looks; of some thousands of vertices. Infinite when nobody can tell.
double seen_motion_px(const PosedStrands& from, const PosedStrands& to, const CameraDesc& camera,
                      RenderSize size);

/// The picture for a window of this size that this step draws.
RenderSize size_of_step(size_t step, RenderSize window);

class DrawPlan {
 public:
  /// Begins with `first_step` while nothing has been measured.
  explicit DrawPlan(size_t first_step) : moving_step_(first_step) {}

  /// The size of the window; what was measured at another one is converted.
  void set_pixels(uint64_t pixels);
  /// The camera moved, or strands did so that it can be seen.
  void note_motion(int64_t time_ns) { moved_ns_ = time_ns; }
  /// A picture was drawn with this step.
  void note_drawn(size_t step, double ms, int64_t time_ns);

  bool is_standing(int64_t time_ns) const { return time_ns - moved_ns_ >= kStandNs; }
  /// When it will stand if nothing moves until then.
  int64_t standing_from_ns() const { return moved_ns_ + kStandNs; }
  /// How to draw now, after a picture with step `drawn`: the finest while all stands, and from a coarse
  /// picture one in between first.
  size_t step_at(int64_t time_ns, size_t drawn) const {
    if (!is_standing(time_ns)) return moving_step_;
    return drawn > kCoarsestFairStep ? kCoarsestFairStep : 0;
  }
  size_t moving_step() const { return moving_step_; }
  /// What a picture with this step takes, measured or told from others; 0 before the first measurement.
  double expected_ms(size_t step, int64_t time_ns) const;
  /// What one picture takes in motion, for whoever compares it with the server's pictures: of the step in
  /// use, but none coarser than kCoarsestFairStep. Sharpening does not count: nothing moves then. 0 =
  /// unknown.
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
