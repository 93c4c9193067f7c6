#include "server/net/flow_control.h"

#include <algorithm>

namespace strandcast {

void FlowControl::on_ack(uint16_t stream_id, uint32_t sequence, int64_t time_ns) {
  const std::optional<AckedFrame> frame = gate_.take_acked(stream_id, sequence);
  if (!frame) return;
  queue_delay_ns_ = link_.on_acked(*frame, time_ns);
  choice_.on_delay(queue_delay_ns_, time_ns);
}

bool FlowControl::may_send(int64_t time_ns) const {
  const auto delay = choice_.is_trying(time_ns) ? SendGate::Delay::Short : SendGate::Delay::Usual;
  return !has_acks_ || gate_.may_send(delay, time_ns);
}

bool FlowControl::may_start(int64_t time_ns) const {
  return may_send(time_ns) && (!has_acks_ || gate_.has_short_queue(time_ns));
}

size_t FlowControl::choose_class(size_t present, std::span<const double> costs, double cap_bytes_per_s,
                                 int64_t time_ns) {
  if (costs.size() < 2 || (has_acks_ && link_.last_ack_ns() == 0)) return present;
  const double capacity = link_.capacity_bytes_per_s(time_ns);
  const double usable = kUsableShare * capacity;
  const double allowed = cap_bytes_per_s <= 0.0 ? usable
                         : capacity > 0.0       ? std::min(usable, cap_bytes_per_s)
                                                : cap_bytes_per_s;
  return choice_.choose({present, costs, allowed, cap_bytes_per_s, has_acks_}, time_ns);
}

}  // namespace strandcast
