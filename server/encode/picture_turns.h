// PictureTurns: decides how often each view may be drawn when time does not suffice for all. A cheap view
// keeps its rate beside expensive ones. Pure arithmetic on measured times, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace strandcast {

/// A drawing that takes longer than this many periods of another view blocks that view, because nothing
/// interrupts it. A view that cannot reach its rate even alone counts with the period that it can reach.
inline constexpr double kBlockingPeriods = 2.0;
/// Share of the time for all blocking drawings together, while other views need less.
inline constexpr double kBlockingShare = 0.25;

/// Demand of one view.
struct PictureLoad {
  double cost_ms = 0.0;    // of one drawing with all its encodes; 0 = not known yet
  double period_ms = 0.0;  // from drawing to drawing, at the rate that it should have
};

struct PictureTurn {
  double spacing_ms = 0.0;   // from the beginning of a drawing to that of the next one, at least
  bool is_blocking = false;  // its drawings hold others up
};

/// Divides the time max-min fairly. Views that need at most an even share get what they need, and the others
/// divide the rest evenly, whatever one drawing costs. If some views block others, the blocking ones divide
/// kBlockingShare. Returns one turn per load.
std::vector<PictureTurn> share_drawing_time(std::span<const PictureLoad> loads);

/// When one view was drawn last, and when it is due next.
class PictureSchedule {
 public:
  /// Notes the beginning of a drawing; `spacing_ns` is the time between two drawings as in PictureTurn.
  void begin(int64_t time_ns, int64_t spacing_ns);
  /// Returns when the view is due; 0 before the first drawing. A view that had to wait catches up as far as
  /// its period allows.
  int64_t due_ns(int64_t spacing_ns, int64_t period_ns) const;

 private:
  int64_t begin_ns_ = 0;
  int64_t owed_ns_ = 0;  // by how much the newest drawing was late
};

/// A view that waits to be drawn or encoded.
struct PictureWait {
  int64_t due_ns = 0;
  int64_t deadline_ns = 0;  // when its next turn is due
};
/// Returns whether `a` precedes `b`: if both are due, the earlier deadline; otherwise, the one that is due
/// first.
bool goes_before(const PictureWait& a, const PictureWait& b, int64_t time_ns);

/// Returns how long blocking views must rest after one of them took `cost_ms`, so that kBlockingShare holds
/// even for views of unknown cost.
double blocking_rest_ms(double cost_ms);

}  // namespace strandcast
