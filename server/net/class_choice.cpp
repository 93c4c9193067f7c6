#include "server/net/class_choice.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "common/base/quantile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

/// A change needs time to show: nothing is decided before.
constexpr int64_t kSettleNs = 500 * kMsInNs;
constexpr double kDrainingShare = 0.95;

/// Whether frames wait for decoding; where nothing is known of it, it may be that.
bool is_viewer_busy(const ClassChoice::Question& question) {
  const std::span<const double> shares = question.decode_shares;
  return shares.empty() || shares[question.present] > kBusyDecodeShare;
}

/// What a cheaper class could shorten.
int64_t curable_ns(const ClassChoice::Question& question, const ClassChoice::Delay& delay) {
  return is_viewer_busy(question) ? delay.all_ns : delay.link_ns;
}

}  // namespace

size_t affordable_class(size_t first, std::span<const double> costs, double allowed_bytes_per_s) {
  while (allowed_bytes_per_s > 0.0 && first + 1 < costs.size() && costs[first] > allowed_bytes_per_s) ++first;
  return first;
}

void ClassChoice::on_delay(const Delay& delay, int64_t time_ns) {
  delays_.push_back({time_ns, delay});
  while (delays_.front().time_ns < time_ns - kDelayWindowNs) delays_.pop_front();
}

void ClassChoice::on_chain_loss(int64_t time_ns) {
  losses_ns_.push_back(time_ns);
  while (losses_ns_.front() < time_ns - kLossWindowNs) losses_ns_.pop_front();
}

/// One loss is no trouble: quick hair takes more than the class usually does, for a moment.
bool ClassChoice::is_troubled(const Question& question, int64_t time_ns) const {
  const auto recent_losses =
      static_cast<size_t>(std::count_if(losses_ns_.begin(), losses_ns_.end(), [&](int64_t lost_ns) {
        return lost_ns > std::max(quiet_since_ns_, time_ns - kLossWindowNs);
      }));
  if (recent_losses >= kTroublingLosses) return true;
  size_t high = 0, all = 0;
  for (const TimedDelay& sample : delays_) {
    if (sample.time_ns <= quiet_since_ns_) continue;
    ++all;
    high += curable_ns(question, sample.delay) > kHighDelayNs ? 1 : 0;
  }
  // A queue that drains is no trouble: a keyframe left it behind.
  return all >= kMinDelaySamples && high == all &&
         delays_.back().time_ns - delays_.front().time_ns >= kDelayWindowNs * 3 / 4 &&
         static_cast<double>(curable_ns(question, delays_.back().delay)) >
             kDrainingShare * static_cast<double>(curable_ns(question, delays_.front().delay));
}

void ClassChoice::change(size_t from, size_t to, int64_t time_ns) {
  const bool has_failed = to > from && improved_ns_ != 0 && time_ns - improved_ns_ < kProbationNs;
  if (has_failed) {
    probe_ns_ = std::min(2 * probe_ns_, kLongestProbeNs);
    failed_class_ = from;
  }
  // What has lasted no longer counts as failed.
  const bool has_lasted = improved_ns_ != 0 && time_ns - improved_ns_ > 2 * kProbationNs;
  if (has_lasted && from <= failed_class_) probe_ns_ = kFirstProbeNs;
  if (to < from) improved_ns_ = time_ns;
  if (to > from) improved_ns_ = 0;
  quiet_since_ns_ = time_ns;
}

/// A better class was tried and did not get through even once: nothing is gained by waiting.
bool ClassChoice::has_failed_try(int64_t time_ns) const {
  return is_trying(time_ns) && !losses_ns_.empty() && losses_ns_.back() > improved_ns_;
}

bool ClassChoice::is_trying(int64_t time_ns) const {
  return improved_ns_ != 0 && time_ns - improved_ns_ < kProbationNs;
}

/// Keeps the candidates for the maximum of the window: each newer one is lower than all before it.
void ClassChoice::note_demand(double cost, int64_t time_ns) {
  while (!demands_.empty() && demands_.back().value <= cost) demands_.pop_back();
  demands_.push_back({time_ns, cost});
  while (demands_.front().time_ns < time_ns - kDemandWindowNs) demands_.pop_front();
}

/// Frames usually wait; that a client looks for them only now and then does not count.
bool ClassChoice::has_standing_delay(const Question& question) const {
  std::vector<int64_t> delays_ns;
  for (const TimedDelay& sample : delays_) delays_ns.push_back(curable_ns(question, sample.delay));
  return !delays_ns.empty() && median(std::move(delays_ns)) > kLowDelayNs;
}

/// A link seldom changes, and what was seen to be too much for it would be tried and taken back whenever that
/// is forgotten.
size_t ClassChoice::begin(const Question& question, int64_t time_ns) {
  quiet_since_ns_ = time_ns;
  const size_t chosen = affordable_class(question.present, question.costs, question.allowed_bytes_per_s);
  if (chosen == question.present) return chosen;
  failed_class_ = chosen - 1;
  probe_ns_ = kLongestProbeNs;
  return chosen;
}

size_t ClassChoice::choose(const Question& question, int64_t time_ns) {
  if (quiet_since_ns_ == 0) return begin(question, time_ns);
  note_demand(question.costs[0], time_ns);
  const bool has_failed = has_failed_try(time_ns);
  if (!question.has_acks || (time_ns - quiet_since_ns_ < kSettleNs && !has_failed)) return question.present;
  const bool is_over_cap =
      question.cap_bytes_per_s > 0.0 && question.costs[question.present] > question.cap_bytes_per_s;
  const bool must_lower = is_over_cap || has_failed || is_troubled(question, time_ns);
  return must_lower ? choose_lower(question, time_ns) : choose_better(question, time_ns);
}

size_t ClassChoice::choose_lower(const Question& question, int64_t time_ns) {
  if (question.present + 1 == question.costs.size()) {
    quiet_since_ns_ = time_ns;  // nothing cheaper; what is better has to wait
    return question.present;
  }
  const size_t chosen = affordable_class(question.present + 1, question.costs, question.allowed_bytes_per_s);
  change(question.present, chosen, time_ns);
  return chosen;
}

size_t ClassChoice::choose_better(const Question& question, int64_t time_ns) {
  const size_t present = question.present;
  const std::span<const double> costs = question.costs;
  const double allowed = question.allowed_bytes_per_s;
  const bool has_delay = has_standing_delay(question);
  // Back to where it went well the way is short; what failed is tried more and more rarely.
  const int64_t wait_ns = present == 0 || present - 1 > failed_class_ ? kFirstProbeNs : probe_ns_;
  if (has_delay) quiet_since_ns_ = std::max(quiet_since_ns_, time_ns - wait_ns / 2);
  if (present == 0 || has_delay || time_ns - quiet_since_ns_ < wait_ns) return present;
  const std::span<const double> decode_shares = question.decode_shares;
  if (!decode_shares.empty() && decode_shares[present - 1] > kBusyDecodeShare) return present;
  const double most = costs[present - 1] * demands_.front().value / costs[0];
  if (allowed > 0.0 && (costs[present - 1] > allowed || most > allowed / kUsableShare * kBurstShare))
    return present;
  change(present, present - 1, time_ns);
  return present - 1;
}

}  // namespace strandcast
