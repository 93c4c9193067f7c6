#include "server/app/head_sender.h"

#include <utility>

#include "common/base/units.h"
#include "common/log/log.h"
#include "server/app/mocap_option.h"

namespace strandcast {

Result<HeadSend> parse_head_send(const std::string& text) {
  ASSIGN_OR_RETURN(const LiveDesc place, parse_mocap(text, "--send"));
  const auto encoding = find_mocap_encoding(place.protocol);
  if (!encoding) return at("--send", encoding.error());
  HeadSend send;
  send.protocol = place.protocol;
  if (!place.host.empty()) send.to.host = place.host;
  send.to.port = place.port != 0 ? static_cast<uint16_t>(place.port) : encoding->port;
  return send;
}

HeadSender::HeadSender(std::vector<Way> ways, uint32_t head, double rate_hz)
    : ways_(std::move(ways)), head_(head), rate_hz_(rate_hz) {}

Result<std::unique_ptr<HeadSender>> HeadSender::open(const std::vector<HeadSend>& sends, uint32_t head,
                                                     double rate_hz) {
  std::vector<Way> ways;
  for (const HeadSend& send : sends) {
    ASSIGN_OR_RETURN(const MocapEncoding encoding, find_mocap_encoding(send.protocol));
    if (head > 0 && !encoding.numbers_sources) continue;
    auto sender = DatagramSender::open(send.to);
    if (!sender) return at("--send", sender.error());
    log_info("app", "the head is sent to {} as {}", send.to.to_string(), send.protocol);
    ways.push_back({encoding, std::move(*sender)});
  }
  return std::unique_ptr<HeadSender>(new HeadSender(std::move(ways), head, rate_hz));
}

void HeadSender::on_state(const std::shared_ptr<const Snapshot>& state) {
  MocapMoment moment;
  moment.time_s = static_cast<double>(state->sim_time_ns) * kSPerNs;
  moment.world_from_head = state->world_from_head;
  moment.number = number_++;
  moment.rate_hz = rate_hz_;
  moment.source = head_ + 1;
  for (const Way& way : ways_)
    if (!way.sender->send(way.encoding.encode(moment))) ++unsent_;
}

}  // namespace strandcast
