#include "server/relay/relay.h"

#include <utility>

#include "common/log/log.h"
#include "server/app/session_desk.h"

namespace strandcast {

Relay::Relay(const RelayConfig& config)
    : id_(make_start_id()),
      upstream_(config.upstream, id_),
      voices_(config.upstream),
      desk_(id_, upstream_, voices_) {}

Result<std::unique_ptr<Relay>> Relay::start(const RelayConfig& config) {
  std::unique_ptr<Relay> relay(new Relay(config));
  NetConfig net = config.net;
  net.page = built_in_page();
  ASSIGN_OR_RETURN(relay->net_, NetServer::listen(net, relay->desk_));
  relay->desk_.connect(*relay->net_);
  RelayDesk& desk = relay->desk_;
  relay->voices_.start(*relay->net_);
  relay->upstream_.start(*relay->net_, {[&desk](RelayedPtr relayed) { desk.set_relayed(std::move(relayed)); },
                                        [&desk](const CameraChange& camera) { desk.move_views(camera); }});
  relay->net_->start();
  log_info("relay", "relaying {} on {} port {}", relay->upstream_.server(), config.net.address,
           relay->net_->port());
  return relay;
}

void Relay::stop() {
  // Viewers first, so that they hear of it.
  if (net_ != nullptr) net_->stop();
  upstream_.stop();
  voices_.stop();
}

}  // namespace strandcast
