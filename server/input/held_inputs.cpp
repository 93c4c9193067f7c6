#include "server/input/held_inputs.h"

#include <algorithm>
#include <iterator>

#include "server/input/input_hub.h"

namespace strandcast {
namespace {

/// The message with one of its samples.
MotionSamples with_one(const MotionSamples& samples, const MotionSamples::Sample& sample) {
  return {{sample}, samples.held_back, samples.joint_names, timecode_of(samples, sample)};
}
WindSamples with_one(const WindSamples&, const WindSamples::Sample& sample) {
  return {{sample}};
}

HeldInputs::Due due_of(uint64_t source_id, int64_t due_ns, MotionSamples one) {
  return {source_id, due_ns, std::make_shared<const MotionSamples>(std::move(one))};
}
HeldInputs::Due due_of(uint64_t source_id, int64_t due_ns, WindSamples one) {
  return {source_id, due_ns, nullptr, std::make_shared<const WindSamples>(std::move(one))};
}

}  // namespace

size_t HeldInputs::held_count() const {
  size_t count = 0;
  for (const auto& [id, source] : sources_) count += source.waiting.size();
  return count;
}

template <class Message>
uint64_t HeldInputs::hold_each(uint64_t source_id, const Message& samples, int64_t time_ns) {
  uint64_t refused = 0;
  size_t room = kMaxHeldSamples - std::min(kMaxHeldSamples, held_count());
  for (const auto& sample : samples.samples) {
    if (room == 0 || (!sources_.contains(source_id) && sources_.size() >= kMaxInputSources)) {
      ++refused;
      continue;
    }
    const auto [found, is_new] = sources_.try_emplace(source_id);
    Source& source = found->second;
    // Times that no clock shows are left to the hub, which refuses them.
    const int64_t sample_ns = std::clamp(sample.time_ns, -kMaxSampleTimeNs, kMaxSampleTimeNs);
    const int64_t present_ns =
        std::max(time_ns, source.waiting.empty() ? time_ns : source.waiting.back().arrival_ns);
    const bool goes_back = sample_ns < source.newest_ns - kHeldClockJumpNs;
    const bool leaps = source.waiting.empty() && sample_ns + source.offset_ns > time_ns + kHeldClockJumpNs;
    if (is_new || goes_back || leaps) {
      source.offset_ns = present_ns - sample_ns;
      source.newest_ns = sample_ns;
    }
    source.newest_ns = std::max(source.newest_ns, sample_ns);
    const int64_t due_ns = sample_ns + source.offset_ns;
    const auto place =
        std::upper_bound(source.waiting.begin(), source.waiting.end(), due_ns,
                         [](int64_t before_ns, const Due& due) { return before_ns < due.arrival_ns; });
    source.waiting.insert(place, due_of(source_id, due_ns, with_one(samples, sample)));
    --room;
  }
  return refused;
}

uint64_t HeldInputs::hold(uint64_t source_id, const MotionSamples& samples, int64_t time_ns) {
  return hold_each(source_id, samples, time_ns);
}

uint64_t HeldInputs::hold(uint64_t source_id, const WindSamples& samples, int64_t time_ns) {
  return hold_each(source_id, samples, time_ns);
}

void HeldInputs::leave(uint64_t source_id) {
  if (const auto found = sources_.find(source_id); found != sources_.end()) found->second.has_left = true;
}

std::vector<uint64_t> HeldInputs::take_left() {
  std::vector<uint64_t> left;
  for (const auto& [id, source] : sources_)
    if (source.has_left && source.waiting.empty()) left.push_back(id);
  for (const uint64_t id : left) sources_.erase(id);
  return left;
}

std::deque<HeldInputs::Due> HeldInputs::take_due(int64_t time_ns) {
  std::deque<Due> due;
  for (auto& [id, source] : sources_) {
    auto end = source.waiting.begin();
    while (end != source.waiting.end() && end->arrival_ns <= time_ns + kHeldSlackNs) ++end;
    due.insert(due.end(), std::make_move_iterator(source.waiting.begin()), std::make_move_iterator(end));
    source.waiting.erase(source.waiting.begin(), end);
  }
  std::stable_sort(due.begin(), due.end(),
                   [](const Due& a, const Due& b) { return a.arrival_ns < b.arrival_ns; });
  return due;
}

}  // namespace strandcast
