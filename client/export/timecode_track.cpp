#include "client/export/timecode_track.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "common/base/units.h"

namespace strandcast {
namespace {

/// Between two states timecode goes on as long as time does, but for this. A head whose source is late coasts
/// ahead of what it says next, and then shows moments again: those states are no jump.
constexpr double kGapS = 0.5;
constexpr double kFrameRounding = 1e-6;

}  // namespace

void TimecodeTrack::add(int64_t sim_time_ns, const Timecode& timecode) {
  Stretch* last = stretches_.empty() ? nullptr : &stretches_.back();
  if (last != nullptr && is_same_count(last->first, timecode)) {
    const Point& before = last->point.back();
    const double frames = frames_between(advanced(last->first, before.place), timecode);
    const double passed_s = static_cast<double>(sim_time_ns - before.sim_time_ns) / kNsPerS;
    if (frames == 0.0 && sim_time_ns == before.sim_time_ns) return;
    if (std::abs(frames / timecode.rate.hz() - passed_s) <= kGapS) {
      if (frames > 0.0) last->point.push_back({sim_time_ns, before.place + frames});
      return;
    }
    if (frames == 0.0) return;  // it stands still
  }
  stretches_.push_back({timecode, {{sim_time_ns, 0.0}}});
}

std::optional<Timecode> TimecodeTrack::first() const {
  return stretches_.empty() ? std::nullopt : std::optional(stretches_.front().first);
}

bool TimecodeTrack::is_whole(int64_t first_ns) const {
  return stretches_.size() == 1 && stretches_.front().point.front().sim_time_ns - first_ns <= kSInNs;
}

std::string TimecodeTrack::text() const {
  if (stretches_.empty()) return {};
  const Stretch& last = stretches_.back();
  const Timecode first = stretches_.front().first;
  std::string text = fmt::format("{} to {} of {} frames per second{}", timecode_text(first),
                                 timecode_text(advanced(last.first, last.point.back().place)),
                                 frame_rate_text(first.rate.hz()), first.is_drop ? ", drop-frame" : "");
  const size_t jumps = stretches_.size() - 1;
  if (jumps > 0)
    text += fmt::format(", with {} jump{}{} to {}", jumps, jumps == 1 ? "" : "s",
                        jumps == 1 ? "" : ", the first", timecode_text(stretches_[1].first));
  if (!std::all_of(stretches_.begin(), stretches_.end(),
                   [&](const Stretch& one) { return is_same_count(one.first, first); }))
    text += ", and other rates";
  return text;
}

/// `begin`, `end`: places within the stretch.
TimecodeTrack::Frames TimecodeTrack::frames_of(const Stretch& stretch, double begin, double end) {
  // Frames lie a whole number behind the one that the first state is part of.
  const double part = stretch.first.part;
  const double first = std::ceil(begin + part - kFrameRounding);
  constexpr double kBehindRounding = 0.25;
  Frames frames{advanced(stretch.first, first - part + kBehindRounding), {}};
  frames.first.part = 0.0;
  auto later = stretch.point.begin();
  for (double place = first - part; place <= end + kFrameRounding; place += 1.0) {
    while (later != stretch.point.end() && later->place < place) ++later;
    if (later == stretch.point.begin() || later == stretch.point.end()) {
      frames.time_ns.push_back(later == stretch.point.end() ? stretch.point.back().sim_time_ns
                                                            : later->sim_time_ns);
      continue;
    }
    const Point &a = *std::prev(later), &b = *later;
    const double share = (place - a.place) / (b.place - a.place);
    frames.time_ns.push_back(a.sim_time_ns +
                             std::llround(share * static_cast<double>(b.sim_time_ns - a.sim_time_ns)));
  }
  return frames;
}

Result<TimecodeTrack::Frames> TimecodeTrack::frames(const std::optional<Timecode>& from,
                                                    const std::optional<Timecode>& to) const {
  for (const Stretch& stretch : stretches_) {
    const double length = stretch.point.back().place;
    const auto place_of = [&](const Timecode& timecode) { return frames_between(stretch.first, timecode); };
    const auto has = [&](const Timecode& timecode) {
      return is_same_count(stretch.first, timecode) && place_of(timecode) > -1.0 &&
             place_of(timecode) < length + 1.0;
    };
    if ((from && !has(*from)) || (!from && to && !has(*to))) continue;
    const double begin = from ? std::max(place_of(*from), 0.0) : 0.0;
    const double end = to && is_same_count(stretch.first, *to) ? std::min(place_of(*to), length) : length;
    if (end < begin)
      return make_error(ErrorCode::BadInput, "the end, {}, is before the beginning, {}",
                        timecode_text(to.value_or(stretch.first)),
                        timecode_text(from.value_or(stretch.first)));
    return frames_of(stretch, begin, end);
  }
  if (stretches_.empty())
    return make_error(ErrorCode::BadInput, "the states carry no timecode: say seconds after the first state");
  const Stretch &first = stretches_.front(), &last = stretches_.back();
  return make_error(ErrorCode::BadInput, "no state is of {}: they go from {} to {}{}",
                    timecode_text(from ? *from : *to), timecode_text(first.first),
                    timecode_text(advanced(last.first, last.point.back().place)),
                    stretches_.size() > 1 ? ", with jumps" : "");
}

}  // namespace strandcast
