// PictureTurns: how often each view may be drawn when there is not time enough for all, so that a view that
// costs little keeps its rate beside views that cost much. Pure arithmetic on measured times, any thread.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace strandcast {

/// A drawing that takes longer than so many periods of another view holds that one up: nothing interrupts it.
/// A view that cannot be drawn at its rate even alone has the period at which it can.
inline constexpr double kBlockingPeriods = 2.0;
/// Share of the time that such drawings take together while others need less.
inline constexpr double kBlockingShare = 0.25;

/// What one view asks for.
struct PictureLoad {
  double cost_ms = 0.0;    // of one drawing with all its encodes; 0 = not known yet
  double period_ms = 0.0;  // from drawing to drawing, at the rate that it should have
};

struct PictureTurn {
  double spacing_ms = 0.0;   // from the beginning of a drawing to that of the next one, at least
  bool is_blocking = false;  // its drawings hold others up
};

/// Max-min fair: a view that needs no more than an even share gets all it needs, and the others divide what
/// is left evenly, whatever one drawing of theirs costs. Where some block others, they divide kBlockingShare.
/// One turn for each load.
std::vector<PictureTurn> share_drawing_time(std::span<const PictureLoad> loads);

/// When one view was drawn, and when it is due again.
class PictureSchedule {
 public:
  /// A drawing begins; times between two of them as in PictureTurn.
  void begin(int64_t time_ns, int64_t spacing_ns);
  /// 0 before the first drawing. A view that had to wait for others makes up for it as far as its period
  /// allows.
  int64_t due_ns(int64_t spacing_ns, int64_t period_ns) const;

 private:
  int64_t begin_ns_ = 0;
  int64_t owed_ns_ = 0;  // by how much the newest drawing was late
};

/// Something that waits to be drawn or encoded.
struct PictureWait {
  int64_t due_ns = 0;
  int64_t deadline_ns = 0;  // when its next turn is due
};
/// Of two that are due the one with the earlier deadline, else the one that is due first.
bool goes_before(const PictureWait& a, const PictureWait& b, int64_t time_ns);

/// How long blocking views rest after one of them took `cost_ms`, so that kBlockingShare holds for views
/// whose cost nobody knew.
double blocking_rest_ms(double cost_ms);

}  // namespace strandcast
