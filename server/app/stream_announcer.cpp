#include "server/app/stream_announcer.h"

#include <utility>

namespace strandcast {

StreamList StreamAnnouncer::list() const {
  const std::lock_guard lock(mutex_);
  return list_;
}

void StreamAnnouncer::change(const std::function<void(StreamList&)>& edit) {
  const std::lock_guard lock(mutex_);
  StreamList list = list_;
  edit(list);
  if (list == list_) return;
  list_ = std::move(list);
  for (const SessionId relay : relays_) net_->send(relay, list_);
}

void StreamAnnouncer::add(SessionId session) {
  const std::lock_guard lock(mutex_);
  relays_.insert(session);
  net_->send(session, list_);
}

void StreamAnnouncer::remove(SessionId session) {
  const std::lock_guard lock(mutex_);
  relays_.erase(session);
}

}  // namespace strandcast
