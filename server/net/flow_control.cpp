#include "server/net/flow_control.h"

#include <algorithm>

#include "common/base/quantile.h"
#include "common/base/units.h"

namespace strandcast {
namespace {

/// Enough that a viewer which had to wait for its processor while it decoded does not seem slow.
constexpr size_t kDecodes = 31;
constexpr size_t kLeastDecodes = 5;

}  // namespace

void FlowControl::on_ack(uint16_t stream_id, uint32_t sequence, int64_t time_ns, const ClientTimes& client) {
  std::optional<AckedFrame> frame = gate_.take_acked(stream_id, sequence);
  if (!frame) return;
  frame->client = client;
  queue_delay_ns_ = link_.on_acked(*frame, time_ns);
  choice_.on_delay({link_.link_delay_ns(), queue_delay_ns_}, time_ns);
  // A keyframe takes longer, and comes once.
  if (client.decode_ns <= 0 || frame->is_large) return;
  decodes_ns_.push_back(client.decode_ns);
  if (decodes_ns_.size() > kDecodes) decodes_ns_.pop_front();
}

void FlowControl::on_asset_left(size_t bytes, int64_t time_ns) {
  // A proxy may have taken all of it at once: only the client knows then.
  if (bytes == 0) return;
  const AckedFrame* const asset = awaits_asset() ? gate_.asset_alone() : nullptr;
  if (asset == nullptr || link_.capacity_bytes_per_s(time_ns) > 0.0) return;
  link_.on_part(*asset, asset->bytes - std::min(bytes, asset->bytes), time_ns);
  if (link_.capacity_bytes_per_s(time_ns) > 0.0) gate_.pass_asset();
}

bool FlowControl::pass_late_asset(int64_t late_ns, int64_t time_ns) {
  const AckedFrame* const asset = awaits_asset() ? gate_.asset_alone() : nullptr;
  if (asset == nullptr || link_.base_ns() == 0 || time_ns - asset->sent_ns - link_.base_ns() < late_ns)
    return false;
  gate_.pass_asset();
  return true;
}

/// Blames the link only while the client is heard: a silent one may be away, and a slow link shows when it is
/// back.
void FlowControl::on_chain_loss(int64_t time_ns) {
  const int64_t due_ns = gate_.oldest_due_ns(time_ns);
  const bool is_silent = due_ns != 0 && time_ns > due_ns + kHighDelayNs;
  if (!is_silent) choice_.on_chain_loss(time_ns);
}

bool FlowControl::may_send(int64_t time_ns) const {
  const auto delay = choice_.is_trying(time_ns) ? SendGate::Delay::Short : SendGate::Delay::Usual;
  return !has_acks_ || gate_.may_send(delay, time_ns);
}

bool FlowControl::may_start(int64_t time_ns) const {
  return may_send(time_ns) && (!has_acks_ || gate_.has_short_queue(time_ns));
}

/// Of each class, by its share of the strands and its rate; empty = unknown.
std::vector<double> FlowControl::decode_shares(const Classes& classes) const {
  if (classes.strands.size() != classes.costs.size() || decodes_ns_.size() < kLeastDecodes) return {};
  const auto decode_ns = static_cast<double>(median(std::vector(decodes_ns_.begin(), decodes_ns_.end())));
  const double all_strands_s = decode_ns * kSPerNs / classes.strands[classes.present].strand_share;
  std::vector<double> shares;
  for (const StrandClass& row : classes.strands)
    shares.push_back(all_strands_s * row.strand_share * row.frame_rate_hz);
  return shares;
}

/// Scales the measured decoding times to another class, until frames of that class are measured.
void FlowControl::expect_decodes(const Classes& classes, size_t chosen) {
  if (classes.strands.size() != classes.costs.size()) return decodes_ns_.clear();
  const double factor = static_cast<double>(classes.strands[chosen].strand_share) /
                        static_cast<double>(classes.strands[classes.present].strand_share);
  for (int64_t& decode_ns : decodes_ns_)
    decode_ns = static_cast<int64_t>(factor * static_cast<double>(decode_ns));
}

/// 0 = unknown.
double FlowControl::allowed_bytes_per_s(const Classes& classes, int64_t time_ns) const {
  const double cap = classes.cap_bytes_per_s;
  const double capacity = link_.capacity_bytes_per_s(time_ns);
  const double usable = kUsableShare * capacity;
  return cap <= 0.0 ? usable : capacity > 0.0 ? std::min(usable, cap) : cap;
}

size_t FlowControl::begin_codec(const Classes& classes, int64_t time_ns) {
  decodes_ns_.clear();
  choice_ = {};
  return choice_.begin({.costs = classes.costs, .allowed_bytes_per_s = allowed_bytes_per_s(classes, time_ns)},
                       time_ns);
}

size_t FlowControl::choose_class(const Classes& classes, int64_t time_ns) {
  const size_t present = classes.present;
  const bool is_unknown = link_.last_ack_ns() == 0 && link_.capacity_bytes_per_s(time_ns) <= 0.0;
  if (classes.costs.size() < 2 || (has_acks_ && is_unknown)) return present;
  const double allowed = allowed_bytes_per_s(classes, time_ns);
  const std::vector<double> shares = decode_shares(classes);
  const size_t chosen =
      choice_.choose({present, classes.costs, allowed, classes.cap_bytes_per_s, has_acks_, shares}, time_ns);
  if (chosen != present) expect_decodes(classes, chosen);
  return chosen;
}

}  // namespace strandcast
