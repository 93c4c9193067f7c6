#include "server/app/head_sender.h"

#include <cstdlib>
#include <utility>

#include "common/base/units.h"
#include "common/log/log.h"
#include "server/app/mocap_option.h"
#include "server/input/live/live_source.h"
#include "server/net/ip_address.h"

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

Status check_sends(const std::vector<HeadSend>& sends, const SceneDesc& scene) {
  std::vector<LiveDesc> inputs = scene.live;
  for (const SceneDesc& head : scene.heads) inputs.insert(inputs.end(), head.live.begin(), head.live.end());
  for (const HeadSend& send : sends) {
    const auto to = IpAddress::parse(send.to.host);
    if (send.to.host != "localhost" && !(to && to->is_loopback())) continue;
    for (size_t i = 0; i < inputs.size(); ++i) {
      ASSIGN_OR_RETURN(const auto input, LiveSource::make(inputs[i], i));
      if (input->protocol().transport == LiveTransport::Udp && input->port() == send.to.port)
        return make_error(ErrorCode::BadInput,
                          "--send {} goes to port {} of this machine, where this server hears {}: "
                          "--send {}://HOST:PORT names another place",
                          send.protocol, send.to.port, inputs[i].protocol, send.protocol);
    }
  }
  return {};
}

HeadSender::HeadSender(std::vector<Way> ways, HeadSenderConfig config)
    : ways_(std::move(ways)), config_(std::move(config)) {}

Result<std::unique_ptr<HeadSender>> HeadSender::open(const std::vector<HeadSend>& sends,
                                                     HeadSenderConfig config) {
  std::vector<Way> ways;
  for (const HeadSend& send : sends) {
    ASSIGN_OR_RETURN(const MocapEncoding encoding, find_mocap_encoding(send.protocol));
    if (config.head > 0 && !encoding.numbers_sources) continue;
    auto sender = DatagramSender::open(send.to);
    if (!sender) return at("--send", sender.error());
    log_info("app", "the head is sent to {} as {}", send.to.to_string(), send.protocol);
    ways.push_back({encoding, std::move(*sender)});
  }
  return std::unique_ptr<HeadSender>(new HeadSender(std::move(ways), std::move(config)));
}

/// As the clock had it when the state was due: even, as simulated time is, and near the clock.
double HeadSender::time_s(int64_t sim_time_ns) {
  constexpr int64_t kFarNs = 100'000'000;  // simulated time stood still, or the clock was set
  const int64_t now_ns = config_.clock.time_ns();
  if (!clock_from_sim_ns_ || std::abs(sim_time_ns + *clock_from_sim_ns_ - now_ns) > kFarNs)
    clock_from_sim_ns_ = now_ns - sim_time_ns;
  return static_cast<double>(sim_time_ns + *clock_from_sim_ns_) * kSPerNs;
}

void HeadSender::on_state(const std::shared_ptr<const Snapshot>& state) {
  MocapMoment moment;
  moment.time_s = time_s(state->sim_time_ns);
  moment.world_from_head = state->world_from_head;
  moment.number = number_++;
  moment.rate_hz = config_.rate_hz;
  moment.source = config_.head + 1;
  moment.timecode = state->timecode;
  if (config_.tell) {
    HeadTold told = config_.tell();
    moment.wind_mps = told.wind_mps;
    moment.is_recording = told.is_recording;
    moment.slate = std::move(told.slate);
  }
  for (const Way& way : ways_)
    if (!way.sender->send(way.encoding.encode(moment))) ++unsent_;
}

}  // namespace strandcast
