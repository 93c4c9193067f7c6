#include "client/export/frame_sampler.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/units.h"

namespace strandcast {
FrameSampler::FrameSampler(const SampleRange& range, StrandFill fill)
    : range_(range), first_ns_(range.first_ns) {
  blend_.set_fill(std::move(fill));
}

int64_t FrameSampler::time_ns(uint64_t index) const {
  if (!range_.time_ns.empty()) return range_.time_ns[std::min<size_t>(index, range_.time_ns.size() - 1)];
  const double after_s =
      range_.from_s + static_cast<double>(index) * range_.fps.denominator / range_.fps.numerator;
  return *first_ns_ + std::llround(after_s * kNsPerS);
}

bool FrameSampler::is_done() const {
  if (!range_.time_ns.empty()) return next_index_ >= range_.time_ns.size();
  if (!first_ns_ || !range_.to_s) return false;
  // A frame at the very end belongs to it, however its time is rounded.
  return time_ns(next_index_) > *first_ns_ + std::llround(*range_.to_s * kNsPerS) + 1;
}

FrameSampler::Outcome FrameSampler::add(std::shared_ptr<const Snapshot> state) {
  if (!first_ns_) first_ns_ = state->sim_time_ns;
  if (!states_.empty() && state->sim_time_ns == states_.back()->sim_time_ns) {
    states_.back() = std::move(state);
    return Outcome::Repeated;
  }
  if (!states_.empty() && state->sim_time_ns < states_.back()->sim_time_ns) {
    finish();
    return Outcome::WentBack;
  }
  states_.push_back(std::move(state));
  forget_states();
  return Outcome::Kept;
}

/// The next frame lies between two states, and a cubic takes one more on either side.
void FrameSampler::forget_states() {
  while (states_.size() > 3 && states_[2]->sim_time_ns <= time_ns(next_index_)) states_.pop_front();
}

std::optional<SampledFrame> FrameSampler::next() {
  if (states_.empty() || is_done()) return std::nullopt;
  const int64_t at_ns = time_ns(next_index_);
  const auto later = std::find_if(states_.begin(), states_.end(),
                                  [at_ns](const auto& state) { return state->sim_time_ns > at_ns; });
  const bool is_exact = later != states_.begin() && (*std::prev(later))->sim_time_ns == at_ns;
  // Whether a cubic leads there is known once the state after the later one has come.
  const bool is_known = is_exact || is_finished_ || std::distance(later, states_.end()) >= 2;
  if (!is_known || (!is_exact && (later == states_.end() || later == states_.begin()))) return std::nullopt;
  SampledFrame frame{next_index_++, static_cast<double>(at_ns) / kNsPerS, {}};
  frame.strands = is_exact ? blend_.at(**std::prev(later))
                           : blend_.between(states_, static_cast<size_t>(later - states_.begin()), at_ns);
  forget_states();
  return frame;
}

}  // namespace strandcast
