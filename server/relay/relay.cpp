#include "server/relay/relay.h"

#include <algorithm>
#include <utility>

#include "common/log/log.h"
#include "server/app/session_manager.h"

namespace strandcast {

Relay::Relay(const RelayConfig& config) : uplinks_(config.upstream, config.idle_uplink_ns) {
  const bool has_all_heads = config.upstream.head.empty();
  const RelayManagerParts parts{make_start_id(), has_all_heads, uplinks_, [this] { return counters(); }};
  for (size_t i = 0; i < (has_all_heads ? kMaxHeads : 1); ++i)
    heads_.push_back(std::make_unique<RelayedHead>(config.upstream, parts, i));
}

Result<std::unique_ptr<Relay>> Relay::start(const RelayConfig& config) {
  std::unique_ptr<Relay> relay(new Relay(config));
  NetConfig net = config.net;
  net.page = built_in_page();
  std::vector<NetHead> places;
  for (const auto& head : relay->heads_) places.push_back({.name = {}, .handler = &head->manager});
  ASSIGN_OR_RETURN(relay->net_, NetServer::listen(net, std::move(places)));
  relay->uplinks_.start(*relay->net_);
  for (size_t i = 0; i < relay->heads_.size(); ++i) {
    RelayManager& manager = relay->heads_[i]->manager;
    manager.connect(*relay->net_);
    Upstream::Hooks hooks;
    hooks.on_relayed = [&manager](RelayedPtr relayed) { manager.set_relayed(std::move(relayed)); };
    hooks.on_camera = [&manager](const CameraChange& camera) { manager.move_views(camera); };
    hooks.on_heads = [self = relay.get(), i](const std::vector<std::string>& names) {
      if (i == 0) self->follow_heads(names);
    };
    relay->heads_[i]->upstream.connect(*relay->net_, std::move(hooks));
  }
  relay->heads_.front()->upstream.follow(config.upstream.head);
  relay->net_->start();
  log_info("relay", "relaying {} on {} port {}", config.upstream.address.to_string(), config.net.address,
           relay->net_->port());
  return relay;
}

/// The first tells which others there are; one call after the other.
void Relay::follow_heads(const std::vector<std::string>& names) {
  for (size_t i = 1; i < heads_.size(); ++i) {
    const bool is_there = i < names.size();
    net_->name_head(i, is_there ? names[i] : std::string());
    if (is_there)
      heads_[i]->upstream.follow(names[i]);
    else
      heads_[i]->upstream.rest();
  }
  if (heads_.size() > 1) net_->name_head(0, names.empty() ? std::string() : names.front());
}

uint32_t Relay::viewer_count() const {
  uint32_t viewers = 0;
  for (const auto& head : heads_) viewers += head->manager.viewer_count();
  return viewers;
}

UpstreamCounters Relay::counters() const {
  UpstreamCounters all;
  for (const auto& head : heads_) all += head->upstream.counters();
  return all;
}

Status Relay::readiness() const {
  for (const auto& head : heads_) RETURN_IF_ERROR(head->upstream.readiness());
  return {};
}

bool Relay::is_shut_down_wanted() const {
  return std::any_of(heads_.begin(), heads_.end(),
                     [](const auto& head) { return head->manager.is_shut_down_wanted(); });
}

void Relay::stop() {
  // Viewers first, so that they hear of it; then the first head, which has the others followed.
  if (net_ != nullptr) net_->stop();
  for (const auto& head : heads_) head->upstream.stop();
  uplinks_.stop();
}

}  // namespace strandcast
