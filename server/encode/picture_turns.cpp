#include "server/encode/picture_turns.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace strandcast {
namespace {

/// No view makes up for more than so many drawings: one that had nothing to show for long is owed nothing.
constexpr int64_t kMaxOwedDrawings = 4;

/// Of the view that alone would be drawn most often.
double shortest_period_ms(std::span<const PictureLoad> loads) {
  double shortest_ms = std::numeric_limits<double>::infinity();
  for (const PictureLoad& load : loads)
    shortest_ms = std::min(shortest_ms, std::max(load.period_ms, load.cost_ms));
  return shortest_ms;
}

/// The level up to which each of these demands can be met when they have `capacity` together.
double fair_level(std::vector<double> demands, double capacity) {
  std::sort(demands.begin(), demands.end());
  for (size_t i = 0; i < demands.size(); ++i) {
    const double even = capacity / static_cast<double>(demands.size() - i);
    if (demands[i] > even) return even;
    capacity -= demands[i];
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<PictureTurn> share_drawing_time(std::span<const PictureLoad> loads) {
  std::vector<PictureTurn> turns(loads.size());
  const double longest_ms = kBlockingPeriods * shortest_period_ms(loads);
  std::vector<double> all, blocking, others;
  for (size_t i = 0; i < loads.size(); ++i) {
    turns[i].is_blocking = loads[i].cost_ms > longest_ms;
    all.push_back(loads[i].cost_ms / loads[i].period_ms);
    (turns[i].is_blocking ? blocking : others).push_back(all.back());
  }
  const double blocking_use =
      std::min(std::accumulate(blocking.begin(), blocking.end(), 0.0), kBlockingShare);
  double blocking_level = fair_level(std::move(blocking), kBlockingShare);
  double level = fair_level(std::move(others), 1.0 - blocking_use);
  // So many others want the time that an even share is less than blocking views could have.
  if (blocking_level > level) blocking_level = level = fair_level(std::move(all), 1.0);
  for (size_t i = 0; i < loads.size(); ++i) {
    const double most = turns[i].is_blocking ? blocking_level : level;
    turns[i].spacing_ms = std::max(loads[i].period_ms, loads[i].cost_ms / most);
  }
  return turns;
}

void PictureSchedule::begin(int64_t time_ns, int64_t spacing_ns) {
  const int64_t late_ns = begin_ns_ == 0 ? 0 : time_ns - (begin_ns_ + spacing_ns - owed_ns_);
  owed_ns_ = std::clamp<int64_t>(late_ns, 0, kMaxOwedDrawings * spacing_ns);
  begin_ns_ = time_ns;
}

int64_t PictureSchedule::due_ns(int64_t spacing_ns, int64_t period_ns) const {
  return begin_ns_ == 0 ? 0 : begin_ns_ + std::max(period_ns, spacing_ns - owed_ns_);
}

bool goes_before(const PictureWait& a, const PictureWait& b, int64_t time_ns) {
  const bool are_both_due = a.due_ns <= time_ns && b.due_ns <= time_ns;
  return are_both_due ? a.deadline_ns < b.deadline_ns : a.due_ns < b.due_ns;
}

double blocking_rest_ms(double cost_ms) {
  return cost_ms * (1.0 / kBlockingShare - 1.0);
}

}  // namespace strandcast
