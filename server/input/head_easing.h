// HeadEasing: what is shown of a head whose source falls silent, and when it speaks again. The head slows
// from its last speed and rests where it comes to. Once the source speaks, what the head is away from it
// shrinks to nothing. Pure arithmetic on frames; not thread-safe.
#pragma once

#include <glm/glm.hpp>

#include "common/math/pose.h"
#include "common/motion/clip_path.h"

namespace strandcast {

/// Shortest time in which a silent head slows, s.
inline constexpr double kShortestEasingS = kClipBlendS;
/// Longest time in which a silent head slows, s. Faster heads than an easy start brings about in it, 2.5 m/s
/// or 10 rad/s, slow harder: they would be far by then.
inline constexpr double kLongestSlowingS = 0.5;
/// Acceleration by which a head is believed to move as its source says: what is beyond it is a correction,
/// and no speed to go on with.
inline constexpr MotionPeaks kBelievedStart{.mps2 = 50.0, .rad_per_s2 = 120.0};
/// Swiftest way back: after kShortestEasingS a tenth is left of what the head was away, 1/s.
inline constexpr double kSwiftestPerS = 4.0 / kShortestEasingS;

class HeadEasing {
 public:
  /// Starts again from a head at rest in this pose.
  void restart(const Pose& seen);

  /// Returns whether two frames have shown how fast the head moves.
  bool knows_speed() const { return knows_speed_; }

  /// Returns the pose to show of a head that its source says is at `seen`, `passed_s` after the frame before;
  /// `since_s` is the source's time since what it said before. It is that very pose, unless the source was
  /// silent: then the head gets there with no more acceleration than kEasyStart beyond the source's own, as
  /// far as its speed is known.
  Pose follow(const Pose& seen, double since_s, double passed_s);

  /// Returns the pose to show while the source says nothing, `passed_s` after the frame before. The head
  /// slows by no more than kEasyStart, for at most kLongestSlowingS. A head on its way back to the source
  /// goes on with that meanwhile.
  Pose coast(double passed_s);
  /// Does what coast() does for a head whose source has left: one that did not slow yet stays where it is.
  Pose hold(double passed_s);
  /// Returns how much later the source says what is shown than what it said last, in its time, s.
  double ahead_s() const { return reached_s_ + time_.away.x; }

 private:
  static constexpr double kSwiftTime = 1e9;  // time is never what slows the head

  /// Place (m) or turn (rad, world axes) of the head, or time (s).
  struct Part {
    double easy_per_s2 = 0.0;      // greatest acceleration
    double believed_per_s2 = 0.0;  // likewise of the source, of what is gone on with
    glm::dvec3 seen_per_s{0.0};    // speed when the source spoke last
    glm::dvec3 shown_per_s{0.0};   // in the newest frame
    glm::dvec3 away{0.0};          // shown less where the source is taken to be
    glm::dvec3 away_per_s{0.0};    // likewise of the speed

    glm::dvec3 slowed(double silent_s) const;
    void see(const glm::dvec3& way, double passed_s);
    void approach(double passed_s);
  };
  void hear_again(const Pose& seen, double since_s, double passed_s);
  Pose show(double passed_s, double heard_s);

  Part place_{.easy_per_s2 = kEasyStart.mps2, .believed_per_s2 = kBelievedStart.mps2};
  Part turn_{.easy_per_s2 = kEasyStart.rad_per_s2, .believed_per_s2 = kBelievedStart.rad_per_s2};
  Part time_{.easy_per_s2 = kSwiftTime};  // of the source, along x: it slows and returns as the head does
  double shown_s_ = 0.0;                  // ahead_s() of the newest frame
  double reached_s_ = 0.0;                // as reached_, in the source's time after heard_
  Pose heard_;                            // what the source said last
  Pose reached_;                          // where the source is taken to be since
  Pose shown_;                            // in the newest frame
  double silent_s_ = 0.0;                 // since the frame that showed heard_; 0: the source speaks
  bool knows_speed_ = false;
};

}  // namespace strandcast
